//! Signed links to a file of a flock. They need no token and expire
//! (docs/explanation/promises.md, "Owners are isolated").
//!
//! With a link, another person can watch a film, or another program can open it. `access/link` signs and checks
//! links.

use std::ops::RangeInclusive;

use axum::http::StatusCode;
use axum::response::IntoResponse;
use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use super::FILES;
use crate::api::access::signed;
use crate::api::download::find as find_file;
use crate::api::extract::{Access, Id, Json};
use crate::api::problem::{Answer, Problem, ProblemBody};
use crate::api::timestamp::rfc3339;
use crate::jobs::clock::now_ms;
use crate::store::resources::Flock;
use flockreel_core::code::Code;

/// Range of the lifetime of a link, seconds: a minute to a week. Free choice.
const LIFETIMES_S: RangeInclusive<i64> = 60..=604_800;

/// File and lifetime of a link.
#[derive(Debug, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub(in crate::api) struct LinkRequest {
    /// Name of one of the flock's files.
    #[serde(default = "default_file")]
    #[schema(default = "video.mp4")]
    file: String,
    /// Lifetime of the link, seconds, 60..=604800 (a week).
    #[serde(default = "default_lifetime_s")]
    #[schema(minimum = 60, maximum = 604_800, default = 3600)]
    expires_s: i64,
}

/// A signed link.
#[derive(Debug, Serialize, ToSchema)]
pub(in crate::api) struct LinkView {
    /// Path with signature, relative to this host.
    url: String,
    /// Time at which the link expires, RFC 3339 in UTC.
    expires_at: String,
}

fn default_file() -> String {
    "video.mp4".to_owned()
}

fn default_lifetime_s() -> i64 {
    3600
}

/// Create a link to a file of a flock.
///
/// The link needs no token: until it expires, everyone who has it can read this one file. Fails with
/// `not_found` for an unknown flock or file name, and with `invalid_params` for a lifetime out of range.
#[utoipa::path(post, path = "/v1/flocks/{id}/links", params(("id" = Uuid, Path)),
    request_body = LinkRequest, responses(
    (status = 201, body = LinkView),
    (status = "4XX", body = ProblemBody, content_type = "application/problem+json"),
))]
pub(in crate::api) async fn create_flock_link(
    access: Access,
    Id(id): Id,
    Json(request): Json<LinkRequest>,
) -> Answer {
    let flock = access.find::<Flock>(id).await?;
    let (name, _) = find_file(FILES, &request.file)?;
    if !LIFETIMES_S.contains(&request.expires_s) {
        let sentence = format!("expires_s must lie in 60..=604800: {}", request.expires_s);
        return Err(Problem::new(Code::InvalidParams, sentence));
    }
    let expires_s = now_ms() / 1000 + request.expires_s;
    let key = access.store().signing_key().await?;
    let view = LinkView {
        url: signed(&key, &format!("/v1/flocks/{}/{name}", flock.id), expires_s),
        expires_at: rfc3339(expires_s * 1000),
    };
    Ok((StatusCode::CREATED, axum::Json(view)).into_response())
}
