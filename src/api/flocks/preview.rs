//! POST /v1/flocks/preview: simulates and plans a flock while the client waits, without a video.

use axum::http::header;
use axum::response::IntoResponse;

use super::FlockRequest;
use crate::api::extract::{Access, Json};
use crate::api::problem::{Answer, Problem, ProblemBody};
use crate::jobs::synchronous;
use crate::store::resources::Library;
use flockreel_core::code::Code;
use flockreel_core::flock::Params;
use flockreel_core::formats::params;

/// Largest product of individuals and frames of a preview: about a second of computing.
const MAX_PREVIEWED_POSES: u64 = 200_000;

/// Preview a flock without a video.
///
/// Simulates and plans a flock while the client waits. The response is its `flock.json`. Nothing is stored.
/// The library must exist.
///
/// The number of individuals (20 if `count` is null) times `frames` is at most 200,000, else the call fails
/// with `invalid_params`. Previews run one at a time. A preview that cannot start within 20 seconds fails
/// with `busy`.
#[utoipa::path(post, path = "/v1/flocks/preview", request_body = FlockRequest, responses(
    (status = 200, content_type = "application/json", body = Value),
    (status = "4XX", body = ProblemBody, content_type = "application/problem+json"),
    (status = "5XX", body = ProblemBody, content_type = "application/problem+json"),
))]
pub(in crate::api) async fn preview_flock(
    access: Access,
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
    let library = access.find::<Library>(request.library_id.0).await?;
    let flock = synchronous::preview_flock(&access.state.context, &library, params).await?;
    let json = [(header::CONTENT_TYPE, "application/json")];
    Ok((json, flock).into_response())
}
