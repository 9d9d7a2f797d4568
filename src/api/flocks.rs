//! Flocks: start the job that makes a flock, preview a flock, and read or delete flocks and their files.

use axum::body::Body;
use axum::extract::{FromRequest, Request, State};
use axum::http::{Response, StatusCode, header};
use axum::response::IntoResponse;
use serde::{Deserialize, Serialize};
use serde_json::{Map, Value};
use utoipa::ToSchema;
use uuid::Uuid;

use super::access::Caller;
use super::analyses::AnalysisOverrides;
use super::download::{Download, Files, disposition, find as find_file};
use super::extract::{Conditions, FileOf, Id, Json};
use super::footage::admit;
use super::jobs::{absent_result, accepted, job_to_follow};
use super::paging::{Page, Paging};
use super::problem::{Problem, ProblemBody, gone};
use super::receive::{is_film, receive_with};
use super::timestamp::rfc3339;
use super::{AppState, libraries};
use crate::code::Code;
use crate::flock::Params;
use crate::formats::params;
use crate::ids::{FlockId, FootageId, JobId, LibraryId};
use crate::jobs::flock::{Input, Summary, enqueue};
use crate::jobs::{analysis, at_once};
use crate::store::flocks::Film;
use crate::store::footage::Added;

pub(super) const FILES: Files = &[
    ("flock.json", "application/json"),
    ("frames.zip", "application/zip"),
    ("ground-truth.zip", "application/zip"),
    ("overlay.mp4", "video/mp4"),
    ("plan.svg", "image/svg+xml"),
    ("poster.png", "image/png"),
    ("preview.gif", "image/gif"),
    ("preview.webp", "image/webp"),
    ("tracks.csv", "text/csv; charset=utf-8"),
    ("video.mov", "video/quicktime"),
    ("video.webm", "video/webm"),
    ("video.mp4", "video/mp4"),
];

/// Largest product of individuals and frames of a preview: about a second of computing.
const MOST_PREVIEWED: u64 = 200_000;

/// Library and parameters of a flock.
///
/// The parameters override the values of `preset`, or the defaults if there is no preset.
#[derive(Debug, Deserialize, ToSchema)]
pub(super) struct FlockRequest {
    /// Library to make the flock from.
    #[schema(value_type = Uuid)]
    library_id: LibraryId,
    #[serde(flatten)]
    #[schema(value_type = Params)]
    params: Map<String, Value>,
}

/// The queued job, and the flock that it makes.
#[derive(Debug, Serialize, ToSchema)]
pub(super) struct FlockAccepted {
    /// Job that makes the flock.
    #[schema(value_type = Uuid)]
    job_id: JobId,
    /// Flock that the job makes. It exists once the job is done.
    #[schema(value_type = Uuid)]
    flock_id: FlockId,
    /// Library that the flock is made from. If it does not exist yet, the job waits for it.
    #[schema(value_type = Uuid)]
    library_id: LibraryId,
}

/// Form with a video to make a flock from.
#[derive(ToSchema)]
#[expect(
    dead_code,
    reason = "it only describes the form in the OpenAPI document"
)]
pub(super) struct FlockForm {
    /// Video, zip of numbered pictures, or TIFF of several pages.
    #[schema(value_type = String, format = Binary)]
    footage: Vec<u8>,
    /// Picture of the scene without the animal, of the same width and height as the video.
    #[schema(value_type = Option<String>, format = Binary)]
    background: Option<Vec<u8>>,
    /// Parameters of the flock to override, as JSON.
    params: Option<FlockOverrides>,
    /// Parameters of the analysis to override, as JSON.
    analysis: Option<AnalysisOverrides>,
}

/// Parameters of a flock to override.
///
/// They override the values of `preset`, or the defaults if there is no preset.
#[derive(ToSchema)]
#[expect(
    dead_code,
    reason = "it only describes the parameters in the OpenAPI document"
)]
pub(super) struct FlockOverrides {
    preset: Option<String>,
    #[serde(flatten)]
    params: Params,
}

/// Summary of a flock.
#[derive(Debug, Serialize, ToSchema)]
pub(super) struct FlockView {
    id: Uuid,
    /// Job that made the flock.
    job_id: Uuid,
    /// Library that the flock was made from.
    library_id: Uuid,
    /// Whether it was made from the sample of an empty data folder.
    sample: bool,
    /// Size of all files, bytes.
    size_bytes: i64,
    /// Time of creation, RFC 3339 in UTC.
    created_at: String,
    /// All parameters of the flock, including defaults.
    #[schema(value_type = Params)]
    params: Value,
    #[serde(flatten)]
    summary: Summary,
}

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
pub(super) async fn create_flock(
    State(state): State<AppState>,
    caller: Caller,
    request: Request,
) -> Result<Response<Body>, Problem> {
    if is_film(&request) {
        return create_flock_of_film(&state, &caller, request).await;
    }
    let Json(request) = Json::<FlockRequest>::from_request(request, &state).await?;
    let params: Params = params::read(request.params)?;
    let library_id = request.library_id;
    let after_job = job_to_follow(&state, &caller, library_id).await?;
    make(&state, &caller, (library_id, after_job), params).await
}

/// Stores a video, queues its analysis, and queues the flock after that.
async fn create_flock_of_film(
    state: &AppState,
    caller: &Caller,
    request: Request,
) -> Result<Response<Body>, Problem> {
    let (label, wishes) = ((None, caller.account.owner.clone()), ["params", "analysis"]);
    let (arrival, mut wishes) = receive_with(state, request, label, &wishes).await?;
    let params = params::read(wishes.remove("params").unwrap_or_default())?;
    let analysis = params::read(wishes.remove("analysis").unwrap_or_default())?;
    let (Added::New(footage) | Added::Known(footage)) = admit(state, arrival).await?;
    let input = analysis::Input {
        footage_id: FootageId(footage.id),
        params: analysis,
    };
    let queued = analysis::enqueue(&state.context, &input, None, &caller.account);
    let (job_id, library_id) = queued.await?;
    make(state, caller, (library_id, Some(job_id)), params).await
}

/// Queues a flock and returns 202. If `after_job` is given, the flock waits for that job.
async fn make(
    state: &AppState,
    caller: &Caller,
    (library_id, after_job): (LibraryId, Option<JobId>),
    params: Params,
) -> Result<Response<Body>, Problem> {
    let input = Input { library_id, params };
    let (job_id, flock_id) = enqueue(&state.context, &input, after_job, &caller.account).await?;
    let result = format!("/v1/flocks/{flock_id}");
    Ok(accepted(
        job_id,
        &result,
        FlockAccepted {
            job_id,
            flock_id,
            library_id,
        },
    ))
}

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
pub(super) async fn preview_flock(
    State(state): State<AppState>,
    caller: Caller,
    Json(request): Json<FlockRequest>,
) -> Result<Response<Body>, Problem> {
    let params: Params = params::read(request.params)?;
    let n_shown = u64::from(params.most_individuals()) * u64::from(params.frames);
    if n_shown > MOST_PREVIEWED {
        return Err(Problem {
            code: Code::InvalidParams,
            detail: format!(
                "count times frames of a preview must be at most {MOST_PREVIEWED}, not {n_shown}: make a flock instead"
            ),
        });
    }
    let library = libraries::find(&state, &caller, request.library_id.0).await?;
    let flock = at_once::flock(&state.context, &library, params).await?;
    let json = [(header::CONTENT_TYPE, "application/json")];
    Ok((json, flock).into_response())
}

/// List all flocks, newest first.
#[utoipa::path(get, path = "/v1/flocks", params(Paging), responses(
    (status = 200, body = Page<FlockView>),
    (status = "4XX", body = ProblemBody, content_type = "application/problem+json"),
))]
pub(super) async fn list_flocks(
    State(state): State<AppState>,
    caller: Caller,
    paging: Paging,
) -> Result<axum::Json<Page<FlockView>>, Problem> {
    let store = &state.context.store;
    let rows = store
        .list_flocks(paging.limit + 1, paging.cursor, &caller.reach)
        .await?;
    Page::of(rows, paging, |row| row.id, FlockView::of)
}

/// Get one flock: a summary, its parameters and advice.
///
/// Fails with `not_ready` if its job is not done. The message names the job and its state.
#[utoipa::path(get, path = "/v1/flocks/{id}", params(("id" = Uuid, Path)), responses(
    (status = 200, body = FlockView),
    (status = "4XX", body = ProblemBody, content_type = "application/problem+json"),
))]
pub(super) async fn get_flock(
    State(state): State<AppState>,
    caller: Caller,
    Id(id): Id,
) -> Result<axum::Json<FlockView>, Problem> {
    Ok(axum::Json(FlockView::of(find(&state, &caller, id).await?)?))
}

/// Delete a flock and its job.
#[utoipa::path(delete, path = "/v1/flocks/{id}", params(("id" = Uuid, Path)), responses(
    (status = 204, description = "deleted"),
    (status = "4XX", body = ProblemBody, content_type = "application/problem+json"),
))]
pub(super) async fn delete_flock(
    State(state): State<AppState>,
    caller: Caller,
    Id(id): Id,
) -> Result<StatusCode, Problem> {
    find(&state, &caller, id).await?;
    gone(state.context.store.delete_film(id).await?)
}

/// Download a file of a flock.
///
/// - `video.mp4`: the film
/// - `flock.json`: all data of the flock
/// - `plan.svg`: chart of the headings of boids and individuals
/// - `tracks.csv`, `ground-truth.zip`: the ground truth, unless `render.ground_truth` is false
/// - `video.webm`, `video.mov`, `frames.zip`, `preview.gif`, `preview.webp`, `poster.png`: if
///   `render.formats` names them, by default only `poster.png`
/// - `overlay.mp4`: the film with the position and heading of every boid, if `render.overlay` is true
///
/// Range and conditional requests are supported. A file that was not made fails with `not_found`.
#[utoipa::path(get, path = "/v1/flocks/{id}/{file}",
    params(("id" = Uuid, Path), ("file" = String, Path)), responses(
    (status = 200, description = "the file"),
    (status = 206, description = "the requested range of the file"),
    (status = 304, description = "not modified"),
    (status = "4XX", body = ProblemBody, content_type = "application/problem+json"),
))]
pub(super) async fn get_flock_file(
    State(state): State<AppState>,
    caller: Caller,
    FileOf(id, name): FileOf,
    conditions: Conditions,
) -> Result<Response<Body>, Problem> {
    let (name, media_type) = find_file(FILES, &name)?;
    let flock = find(&state, &caller, id).await?;
    // A browser cannot show these, so it saves them.
    let kind = match media_type {
        "application/zip" | "video/quicktime" => "attachment",
        _ => "inline",
    };
    let download = Download {
        folder: &flock.folder,
        name,
        media_type,
        disposition: disposition(kind, &label_of(name, id)),
    };
    download.answer(&state.context.store, &conditions).await
}

/// Returns the name under which a browser saves the file.
fn label_of(name: &str, id: Uuid) -> String {
    match name {
        "flock.json" => format!("flock-{id}.json"),
        _ => match name.strip_prefix("video.") {
            Some(kind) => format!("flock-{id}.{kind}"),
            None => format!("flock-{id}-{name}"),
        },
    }
}

/// Returns a flock. Fails with `not_ready` if its job is not done, and with `not_found` if there is none.
pub(super) async fn find(state: &AppState, caller: &Caller, id: Uuid) -> Result<Film, Problem> {
    match state.context.store.flock(id, &caller.reach).await? {
        Some(flock) => Ok(flock),
        None => Err(absent_result(state, caller, id).await?),
    }
}

impl FlockView {
    fn of(row: Film) -> Result<FlockView, Problem> {
        Ok(FlockView {
            id: row.id,
            job_id: row.job_id,
            library_id: row.library_id,
            sample: row.sample,
            size_bytes: row.size_bytes,
            created_at: rfc3339(row.created_ms),
            params: super::stored(&row.params)?,
            summary: super::stored(&row.summary)?,
        })
    }
}
