//! Jobs: their state and cancellation, and the responses about jobs that other routes share.

pub(super) mod events; // server-sent events
pub(super) mod retry; // another attempt

pub(super) mod wait; // Prefer: wait=N

use axum::body::Body;
use axum::http::{HeaderMap, Response, StatusCode, header};
use axum::response::IntoResponse;
use serde::Serialize;
use serde_json::Value;
use utoipa::ToSchema;
use uuid::Uuid;

use self::wait::Wait;
use super::extract::{Access, Id};
use super::paging::{Page, Paging};
use super::problem::{Answer, JsonAnswer, Problem, ProblemBody};
use super::timestamp::rfc3339;

use crate::jobs::clock::now_ms;
use crate::jobs::refusal::FILE_NAME;
use crate::jobs::refusal::mend::Mend;
use crate::store::jobs::cancel::Cancel;
use crate::store::jobs::read::{Failure, JobRow};
use crate::store::jobs::{JobState, Kind};
use crate::store::resources::Library;
use flockreel_core::analysis::Params;
use flockreel_core::code::Code;
use flockreel_core::ids::{JobId, LibraryId};

/// A unit of queued work.
#[derive(Clone, Debug, PartialEq, Serialize, ToSchema)]
pub(super) struct JobView {
    #[schema(value_type = Uuid)]
    id: JobId,
    /// `sample` (films the sample of an empty data folder), `analysis`, `views` (makes `film.mp4` and `overlay.mp4` of a
    /// library, queued by the service), `flock` or `fish`.
    kind: &'static str,
    /// `queued`, `running`, `done`, `failed` or `cancelled`.
    state: &'static str,
    /// Current stage, such as `tracking`. null before the first stage and after the job has ended.
    stage: Option<String>,
    /// Progress of the whole job, 0..=1.
    progress: f64,
    /// Number of attempts so far, including the current one.
    attempt: i64,
    /// Whether the job was asked to stop while running.
    cancel_requested: bool,
    /// Whether `POST /v1/jobs/{id}/retry` would start the job again.
    retriable: bool,
    /// Reason of the failure; null unless the job failed.
    error: Option<JobFailure>,
    /// Time at which the job was queued, RFC 3339 in UTC.
    created_at: String,
    /// Time at which the first attempt began; null before.
    started_at: Option<String>,
    /// Time at which the job was done, failed or was cancelled; null before.
    finished_at: Option<String>,
    /// Footage or library that the job works on; null for a `sample` job.
    subject: Option<JobSubject>,
    /// Addresses of the job and its result.
    links: JobLinks,
}

/// Footage or library that a job works on. It does not exist before its own job is done.
#[derive(Clone, Debug, PartialEq, Serialize, ToSchema)]
pub(super) struct JobSubject {
    /// `footage` or `library`.
    kind: &'static str,
    /// Id of the footage or library.
    id: Uuid,
}

/// Reason why a job failed.
#[derive(Clone, Debug, PartialEq, Serialize, ToSchema)]
pub(super) struct JobFailure {
    /// Stable error code.
    code: &'static str,
    /// Meaning of the code.
    title: &'static str,
    /// Description of this failure.
    detail: String,
    /// Advice on what to do.
    advice: &'static str,
    /// Address of a picture of the frames that show the reason; null if there is none.
    picture: Option<String>,
    /// Changes of the request that may mend it, the most promising first. Empty if none does.
    mends: Vec<Mend>,
    /// Parameters of the analysis that failed, of which `mends` proposes changes; null for other jobs.
    #[schema(value_type = Option<Params>)]
    params: Option<Value>,
}

/// Addresses of a job and its result.
#[derive(Clone, Debug, PartialEq, Serialize, ToSchema)]
pub(super) struct JobLinks {
    /// Address of the job.
    #[serde(rename = "self")]
    this: String,
    /// Address of its server-sent events.
    events: String,
    /// Address of its result, which exists once the job is done.
    result: String,
}

/// List all jobs, newest first.
#[utoipa::path(get, path = "/v1/jobs", params(Paging), responses(
    (status = 200, body = Page<JobView>),
    (status = "4XX", body = ProblemBody, content_type = "application/problem+json"),
))]
pub(super) async fn list_jobs(access: Access, paging: Paging) -> JsonAnswer<Page<JobView>> {
    let (limit, owners) = (paging.n_rows(), &access.caller.owners);
    let rows = access.store().list_jobs(limit, paging.cursor, owners);
    let views = rows.await?.into_iter().map(JobView::from).collect();
    Ok(axum::Json(Page::new(views, paging, |view: &JobView| {
        view.id.0
    })))
}

/// Get one job.
///
/// With `Prefer: wait=N` the response is sent when the job has ended, or after N seconds, at most 60.
#[utoipa::path(get, path = "/v1/jobs/{id}", params(("id" = Uuid, Path)), responses(
    (status = 200, body = JobView),
    (status = "4XX", body = ProblemBody, content_type = "application/problem+json"),
))]
pub(super) async fn get_job(access: Access, Id(id): Id, headers: HeaderMap) -> Answer {
    let job = find(&access, JobId(id)).await?;
    let Some(wait) = Wait::from_headers(&headers) else {
        return Ok(axum::Json(job).into_response());
    };
    let job = wait.until_ended(&access.state, job.id).await?;
    let job = job.map(JobView::from).ok_or_else(Problem::not_found)?;
    let mut answer = axum::Json(job).into_response();
    wait.mark_applied(answer.headers_mut());
    Ok(answer)
}

/// Get the picture that shows why a video was refused.
///
/// It is a JPEG of a frame with boxes around moving objects, or of the frames before and after a change.
/// Fails with `not_found` if the job has no picture.
#[utoipa::path(get, path = "/v1/jobs/{id}/refused.jpg", params(("id" = Uuid, Path)), responses(
    (status = 200, content_type = "image/jpeg"),
    (status = "4XX", body = ProblemBody, content_type = "application/problem+json"),
))]
pub(super) async fn get_refused_jpeg(
    access: Access,
    Id(id): Id,
) -> Result<impl IntoResponse, Problem> {
    let store = access.store();
    let jpeg = store.refused_jpeg(JobId(id), &access.caller.owners).await?;
    let jpeg = jpeg.ok_or_else(Problem::not_found)?;
    let headers = [
        (header::CONTENT_TYPE, "image/jpeg"),
        (
            header::CACHE_CONTROL,
            "private, max-age=31536000, immutable",
        ),
    ];
    Ok((headers, jpeg))
}

/// Cancel a job.
///
/// A queued job is cancelled at once (200), with the jobs that wait for it. A running job is asked to stop
/// (202) and ends soon after. A job that has ended fails with `already_finished`.
#[utoipa::path(delete, path = "/v1/jobs/{id}", params(("id" = Uuid, Path)), responses(
    (status = 200, body = JobView),
    (status = 202, body = JobView),
    (status = "4XX", body = ProblemBody, content_type = "application/problem+json"),
))]
pub(super) async fn cancel_job(access: Access, Id(id): Id) -> Answer {
    let owners = &access.caller.owners;
    let status = match access.store().cancel(JobId(id), owners, now_ms()).await? {
        Cancel::Cancelled => StatusCode::OK,
        Cancel::Requested => StatusCode::ACCEPTED,
        Cancel::Final(_) => return Err(Code::AlreadyFinished.into()),
        Cancel::Absent => return Err(Problem::not_found()),
    };
    let job = find(&access, JobId(id)).await?;
    Ok((status, axum::Json(job)).into_response())
}

async fn find(access: &Access, id: JobId) -> Result<JobView, Problem> {
    let job = access.store().job(id, &access.caller.owners).await?;
    job.map(JobView::from).ok_or_else(Problem::not_found)
}

/// Returns 202 with the address of the job in `Location` and that of its future result in `Link`.
pub(super) fn accepted(job: JobId, result: &str, body: impl Serialize) -> Response<Body> {
    let headers = [
        (header::LOCATION, format!("/v1/jobs/{job}")),
        (header::LINK, format!("<{result}>; rel=\"related\"")),
        (header::RETRY_AFTER, "1".to_owned()),
    ];
    (StatusCode::ACCEPTED, headers, axum::Json(body)).into_response()
}

/// Returns the problem for an absent result: `not_ready` if its job has not ended, the job's own code if it
/// failed or was cancelled, or `not_found` if no job makes it.
pub(super) async fn absent_result(access: &Access, result: Uuid) -> Result<Problem, Problem> {
    let job = access.store().job_of_result(result, &access.caller.owners);
    Ok((job.await?.as_ref()).map_or_else(Problem::not_found, absent_result_of))
}

/// Returns the problem for the absent result of a job, as [`absent_result`] does.
pub(super) fn absent_result_of(job: &JobRow) -> Problem {
    let (state, id) = (job.state.name(), job.id);
    let sentence = format!("the job of this result is {state}: /v1/jobs/{id}");
    match (job.state, job.failure()) {
        (JobState::Failed, Some(failure)) => {
            Problem::lost_result(failure.code, format!("{sentence}: {}", failure.detail), id)
        }
        (JobState::Cancelled, _) => Problem::lost_result(Code::Cancelled, sentence, id),
        _ => Problem::new(Code::NotReady, sentence),
    }
}

/// Returns the analysis that must finish before a library can be used, or `None` if the library exists. Fails
/// with `invalid_params` if there is no such library and no unfinished analysis makes it.
pub(super) async fn job_to_follow(
    access: &Access,
    library_id: LibraryId,
) -> Result<Option<JobId>, Problem> {
    let store = access.store();
    let library = store.resource::<Library>(library_id.0, &access.caller.owners);
    if let Some(library) = library.await? {
        access.note_use::<Library>(&library);
        return Ok(None);
    }
    match store
        .job_of_result(library_id.0, &access.caller.owners)
        .await?
    {
        Some(job)
            if job.kind == Kind::Analysis
                && !matches!(job.state, JobState::Failed | JobState::Cancelled) =>
        {
            Ok(Some(job.id))
        }
        _ => {
            let sentence = format!("the library does not exist: {library_id}");
            Err(Problem::new(Code::InvalidParams, sentence))
        }
    }
}

/// Returns the address of a job's result, which may not exist yet. The views are files of their library.
pub(super) fn result_path(row: &JobRow) -> String {
    if let (Kind::Views, Some(library_id)) = (row.kind, row.subject_id()) {
        return format!("/v1/libraries/{library_id}");
    }
    format!("/v1/{}/{}", row.kind.result_kind().plural(), row.result_id)
}

/// Returns the footage or library that a job works on.
fn subject(row: &JobRow) -> Option<JobSubject> {
    let kind = match row.kind {
        Kind::Sample => return None,
        Kind::Analysis => "footage",
        Kind::Views | Kind::Flock | Kind::Fish | Kind::Dataset => "library",
    };
    row.subject_id().map(|id| JobSubject { kind, id })
}

/// Returns the mends of a failure. Older versions stored none.
fn mends_of(failure: &Failure) -> Vec<Mend> {
    let stored = failure.mends.as_deref();
    let stored = stored.and_then(|json| serde_json::from_str(json).ok());
    stored.unwrap_or_else(|| Mend::all_for(failure.code))
}

fn is_final(job: &JobView) -> bool {
    job.finished_at.is_some()
}

impl From<JobRow> for JobView {
    fn from(row: JobRow) -> JobView {
        let path = format!("/v1/jobs/{}", row.id);
        JobView {
            id: row.id,
            kind: row.kind.name(),
            state: row.state.name(),
            progress: row.progress,
            attempt: row.attempt,
            cancel_requested: row.cancel_requested,
            retriable: row.is_retriable(),
            error: row.failure().map(|failure| JobFailure {
                picture: row.has_picture.then(|| format!("{path}/{FILE_NAME}")),
                code: failure.code.name(),
                title: failure.code.meaning(),
                mends: mends_of(&failure),
                params: (failure.params.as_deref())
                    .and_then(|json| serde_json::from_str(json).ok()),
                detail: failure.detail,
                advice: failure.code.advice(),
            }),
            created_at: rfc3339(row.created_ms),
            started_at: row.started_ms.map(rfc3339),
            finished_at: row.finished_ms.map(rfc3339),
            subject: subject(&row),
            links: JobLinks {
                events: format!("{path}/events"),
                this: path,
                result: result_path(&row),
            },
            stage: row.stage,
        }
    }
}
