//! POST /v1/jobs/{id}/retry: another attempt at a job that failed or was cancelled.

use axum::http::{StatusCode, header};
use axum::response::IntoResponse;

use super::{JobView, find};
use crate::api::extract::{Access, Id};
use crate::api::problem::{Answer, Problem, ProblemBody};
use crate::store::jobs::retry::Retry;
use flockreel_core::code::Code;
use flockreel_core::ids::JobId;

/// Try a job again.
///
/// Returns a job to the queue that was cancelled, or that failed with `crashed_worker`, `internal`, `storage_full`,
/// `time_limit`, `memory_limit` or `decoder_crashed`. It keeps its id, its parameters, its input and the address of
/// its result. The jobs that ended because it did return with it.
///
/// Any other job fails with `retry_refused`. If too many jobs are queued or running, the call fails with
/// `quota_exceeded` or `queue_full`.
#[utoipa::path(post, path = "/v1/jobs/{id}/retry", params(("id" = Uuid, Path)), responses(
    (status = 202, body = JobView, headers(("location" = String))),
    (status = "4XX", body = ProblemBody, content_type = "application/problem+json"),
    (status = "5XX", body = ProblemBody, content_type = "application/problem+json"),
))]
pub(in crate::api) async fn retry_job(access: Access, Id(id): Id) -> Answer {
    let (context, caller) = (&access.state.context, &access.caller);
    match context
        .retry(JobId(id), &caller.owners, &caller.account)
        .await?
    {
        Retry::Queued => {}
        Retry::Refused(refusal) => {
            return Err(Problem::new(Code::RetryRefused, refusal.to_string()));
        }
        Retry::Absent => return Err(Problem::not_found()),
    }
    let job = find(&access, JobId(id)).await?;
    let location = [(header::LOCATION, format!("/v1/jobs/{id}"))];
    Ok((StatusCode::ACCEPTED, location, axum::Json(job)).into_response())
}
