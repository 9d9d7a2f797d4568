//! POST /v1/flocks/preview: simulates and plans a flock while the client waits, without a video.

use std::time::{Duration, Instant};

use axum::http::{HeaderMap, HeaderName, header};
use axum::response::IntoResponse;

use super::FlockRequest;
use crate::api::extract::{Access, Json};
use crate::api::problem::{Answer, Problem, ProblemBody};
use crate::jobs::synchronous::{self, Preview};
use crate::store::resources::Library;
use flockreel_core::code::Code;
use flockreel_core::flock::{Flock, Params};
use flockreel_core::formats::{flock_json, flock_plan, params};

/// Largest product of individuals and frames of a preview: about a second of computing.
pub(super) const MAX_PREVIEWED_POSES: u64 = 200_000;

/// Preview a flock without a video.
///
/// Simulates and plans a flock while the client waits. The response is its `flock.json`, or its `flock.plan`
/// with `Accept: application/vnd.flockreel.plan`. Nothing is stored. The library must exist.
///
/// The number of individuals (20 if `count` is null) times `frames` is at most 200,000, else the call fails
/// with `invalid_params`. Previews run one at a time, and owners take turns. A preview that cannot start within 20 seconds fails
/// with `busy`. The computation ends when the client closes the connection. `Server-Timing` tells how long it
/// took.
#[utoipa::path(post, path = "/v1/flocks/preview", request_body = FlockRequest, responses(
    (status = 200, headers(("server-timing" = String)), content((Value = "application/json"), (Vec<u8> = "application/vnd.flockreel.plan"))),
    (status = "4XX", body = ProblemBody, content_type = "application/problem+json"),
    (status = "5XX", body = ProblemBody, content_type = "application/problem+json"),
))]
pub(in crate::api) async fn preview_flock(
    access: Access,
    headers: HeaderMap,
    Json(request): Json<FlockRequest>,
) -> Answer {
    let params: Params = params::read(request.params)?;
    let n_poses = u64::from(params.most_individuals()) * u64::from(params.frames);
    if n_poses > MAX_PREVIEWED_POSES {
        let sentence = format!(
            "count times frames of a preview must be at most {MAX_PREVIEWED_POSES}, not {n_poses}: make a flock instead"
        );
        return Err(Problem::new(Code::InvalidParams, sentence));
    }
    let library_id = access.id_of::<Library>(request.library_id).await?;
    let library = access.find::<Library>(library_id).await?;
    access.note_use::<Library>(&library);
    let accepted = headers.get(header::ACCEPT);
    let accepted = accepted.and_then(|value| value.to_str().ok());
    let mut types = accepted.unwrap_or_default().split(',');
    let is_plan =
        |one: &str| one.split(';').next().unwrap_or_default().trim() == flock_plan::MEDIA_TYPE;
    let (media_type, write): (_, fn(&Flock) -> Vec<u8>) = if types.any(is_plan) {
        (flock_plan::MEDIA_TYPE, flock_plan::write)
    } else {
        ("application/json", flock_json::write)
    };
    let (context, owner) = (&access.state.context, &access.caller.account.owner);
    let begun = Instant::now();
    let preview = synchronous::preview_flock(context, owner, &library, params, write).await?;
    let timing = timing(&preview, begun.elapsed());
    let headers = [
        (header::CONTENT_TYPE, media_type),
        (header::VARY, "accept"),
        (HeaderName::from_static("server-timing"), timing.as_str()),
    ];
    Ok((headers, preview.file).into_response())
}

/// Returns the value of Server-Timing: milliseconds of planning, of writing the file, and of the rest, which is
/// waiting for other previews and loading the library.
fn timing(preview: &Preview, total: Duration) -> String {
    let ms = |time: Duration| time.as_secs_f64() * 1000.0;
    let rest = total.saturating_sub(preview.planning + preview.writing);
    format!(
        "plan;dur={:.1}, write;dur={:.1}, load;dur={:.1}",
        ms(preview.planning),
        ms(preview.writing),
        ms(rest)
    )
}
