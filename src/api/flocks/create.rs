//! POST /v1/flocks: queues a job that makes a flock of a library, or first an analysis of a video that comes with
//! the request.

use axum::extract::{FromRequest, Request};

use super::{FlockAccepted, FlockForm, FlockRequest};
use crate::api::extract::{Access, Json};
use crate::api::footage::admit;
use crate::api::jobs::{accepted, job_to_follow};
use crate::api::problem::{Answer, ProblemBody};
use crate::api::receive::{Form, is_film, receive_with_json};
use crate::jobs::flock::Input;
use crate::jobs::{IdSequence, analysis};
use crate::store::footage::Added;
use crate::store::resources::Library;
use flockreel_core::flock::Params;
use flockreel_core::formats::params;
use flockreel_core::ids::{FootageId, JobId, LibraryId};

/// Start making a flock.
///
/// Queues a job that simulates, plans and films a flock. The body is JSON with the id of a library. If its
/// analysis is still queued or running, the flock's job waits for it. The body may also be a form with a
/// video: the video is stored and analyzed first.
///
/// The response is 202. `Location` is the address of the job, and `Link` that of the future flock. With
/// `Prefer: wait=N`, a job that ends in time gives 201. An unknown library and wrong parameters fail with
/// `invalid_params`. If too many jobs are queued or running, the call fails with `quota_exceeded` or
/// `queue_full`.
#[utoipa::path(post, path = "/v1/flocks",
    request_body(content((FlockRequest = "application/json"), (FlockForm = "multipart/form-data"))), responses(
    (status = 202, body = FlockAccepted, headers(("location" = String), ("link" = String))),
    (status = 201, body = FlockAccepted, headers(("location" = String)), description = "done within the requested wait"),
    (status = "4XX", body = ProblemBody, content_type = "application/problem+json"),
    (status = "5XX", body = ProblemBody, content_type = "application/problem+json"),
))]
pub(in crate::api) async fn create_flock(
    access: Access,
    mut ids: IdSequence,
    request: Request,
) -> Answer {
    if is_film(&request) {
        return create_flock_of_film(&access, ids, request).await;
    }
    let Json(request) = Json::<FlockRequest>::from_request(request, &access.state).await?;
    let params: Params = params::read(request.params)?;
    let library_id = access.id_of::<Library>(request.library_id).await?;
    let library_id = LibraryId(library_id);
    let after_job = job_to_follow(&access, library_id).await?;
    let input = Input { library_id, params };
    queue(&access, input, after_job, &mut ids).await
}

/// Stores a video, queues its analysis, and queues the flock after that.
async fn create_flock_of_film(access: &Access, mut ids: IdSequence, request: Request) -> Answer {
    let form = Form {
        name: None,
        owner: access.caller.account.owner.clone(),
        json_fields: &["params", "analysis"],
        film: None,
    };
    let (received, mut fields) = receive_with_json(&access.state, request, form).await?;
    let params = params::read(fields.remove("params").unwrap_or_default())?;
    let analysis_params = params::read(fields.remove("analysis").unwrap_or_default())?;
    let (Added::New(footage) | Added::Known(footage)) = admit(&access.state, received).await?;
    let analysis = analysis::Input {
        footage_id: FootageId(footage.id),
        params: analysis_params,
    };
    let (analysis_job, library_id) = access.enqueue(&analysis, None, &mut ids).await?;
    let input = Input { library_id, params };
    queue(access, input, Some(analysis_job), &mut ids).await
}

/// Queues a flock and returns 202. If `after_job` is given, the flock waits for that job.
async fn queue(
    access: &Access,
    input: Input,
    after_job: Option<JobId>,
    ids: &mut IdSequence,
) -> Answer {
    let (job_id, flock_id) = access.enqueue(&input, after_job, ids).await?;
    let body = FlockAccepted {
        job_id,
        flock_id,
        library_id: input.library_id,
    };
    Ok(accepted(job_id, &format!("/v1/flocks/{flock_id}"), body))
}
