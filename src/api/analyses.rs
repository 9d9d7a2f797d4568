//! Analyses: footage to library, as a job.

use axum::body::Body;
use axum::extract::State;
use axum::http::Response;
use serde::{Deserialize, Serialize};
use serde_json::{Map, Value};
use utoipa::ToSchema;

use super::AppState;
use super::access::Caller;
use super::extract::Json;
use super::jobs::accepted;
use super::problem::{Problem, ProblemBody};
use crate::analysis::Params;
use crate::code::Code;
use crate::formats::params;
use crate::ids::{FootageId, JobId, LibraryId};
use crate::jobs::analysis::{Input, enqueue};

/// What to measure, and how.
#[derive(Debug, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub(super) struct AnalysisRequest {
    #[schema(value_type = uuid::Uuid)]
    footage_id: FootageId,
    /// Overrides of the defaults, or of `preset` (`papers`).
    #[serde(default)]
    #[schema(value_type = Params)]
    params: Map<String, Value>,
}

/// The job, and the library that it will make.
#[derive(Debug, Serialize, ToSchema)]
pub(super) struct AnalysisAccepted {
    #[schema(value_type = uuid::Uuid)]
    job_id: JobId,
    #[schema(value_type = uuid::Uuid)]
    library_id: LibraryId,
}

/// Measure the animal of a footage.
#[utoipa::path(post, path = "/v1/analyses", request_body = AnalysisRequest, responses(
    (status = 202, body = AnalysisAccepted, headers(("location" = String), ("link" = String))),
    (status = "4XX", body = ProblemBody, content_type = "application/problem+json"),
    (status = "5XX", body = ProblemBody, content_type = "application/problem+json"),
))]
pub(super) async fn create_analysis(
    State(state): State<AppState>,
    caller: Caller,
    Json(request): Json<AnalysisRequest>,
) -> Result<Response<Body>, Problem> {
    let params: Params = params::read(request.params)?;
    let footage_id = request.footage_id;
    let footage = state.context.store.footage(footage_id.0, &caller.reach);
    if footage.await?.is_none() {
        let sentence = format!("there is no such footage: {footage_id}");
        return Err(Problem::new(Code::InvalidParams, sentence));
    }
    let input = Input { footage_id, params };
    let (job_id, library_id) = enqueue(&state.context, &input, &caller.account).await?;
    let result = format!("/v1/libraries/{library_id}");
    Ok(accepted(
        job_id,
        &result,
        AnalysisAccepted { job_id, library_id },
    ))
}
