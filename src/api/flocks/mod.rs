//! Flocks: their JSON, and reading and deleting them with their files. The other files of this folder queue,
//! preview and share flocks.

pub(super) mod create; // JSON or a form -> queued job
pub(super) mod datasets; // many flocks with labels
pub(super) mod links; // signed links to files
pub(super) mod preview; // flock.json without a video
pub(super) mod school; // virtual animals in one 3-D model

use axum::http::StatusCode;
use serde::{Deserialize, Serialize};
use serde_json::{Map, Value};
use utoipa::ToSchema;
use uuid::Uuid;

use super::analyses::AnalysisOverrides;
use super::download::names::{saved_as, stem};
use super::download::{Download, Files, find as find_file};
use super::extract::{Access, Conditions, FileOf, Id, Json};
use super::paging::{FilmQuery, Filtered, Page};
use super::problem::{Answer, JsonAnswer, Problem, ProblemBody};
use super::resources::{FileView, Reference, ResultChange, ResultView, View};
use super::timestamp::rfc3339;
use crate::jobs::flock::Summary;
use crate::store::jobs::JobState;
use crate::store::resources::{FilmRow, Flock};
use flockreel_core::flock::Params;
use flockreel_core::formats::flock_plan;
use flockreel_core::ids::{FlockId, JobId, LibraryId};

const FILES: Files = &[
    ("flock.json", "application/json"),
    ("flock.plan", flock_plan::MEDIA_TYPE),
    ("frames.zip", "application/zip"),
    ("ground-truth.zip", "application/zip"),
    ("overlay.mp4", "video/mp4"),
    ("plan.svg", "image/svg+xml"),
    ("poster.png", "image/png"),
    ("preview.gif", "image/gif"),
    ("preview.webp", "image/webp"),
    ("thumb.webp", "image/webp"),
    ("tracks.csv", "text/csv; charset=utf-8"),
    ("video.mov", "video/quicktime"),
    ("video.webm", "video/webm"),
    ("video.mp4", "video/mp4"),
];

/// Names of the pictures of a flock in lists. To see them there is no use of the flock.
const LIST_PICTURES: [&str; 2] = ["thumb.webp", "poster.png"];

/// Library and parameters of a flock.
///
/// The parameters override the values of `preset`, or the defaults if there is no preset.
#[derive(Debug, Deserialize, ToSchema)]
pub(super) struct FlockRequest {
    /// Id of the library to make the flock from, or `sample`: the newest library of the sample.
    #[schema(value_type = String)]
    library_id: Reference,
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
    /// Video, zip of numbered pictures, or TIFF of several pages. The field may also be called `video`.
    #[schema(value_type = String, format = Binary)]
    footage: Vec<u8>,
    /// Picture of the scene without the animal, of the same width and height as the video.
    #[schema(value_type = Option<String>, format = Binary)]
    background: Option<Vec<u8>>,
    /// One mask per frame, as a gray video, a zip of pictures or a TIFF. White is the animal, black the rest.
    /// Gray is the share of the pixel that the animal covers.
    #[schema(value_type = Option<String>, format = Binary)]
    masks: Option<Vec<u8>>,
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
    /// State of the job: always `done`. Before, this address answers 404 with `not_ready`, or with the reason
    /// why there is no flock.
    state: &'static str,
    /// Library that the flock was made from.
    library_id: Uuid,
    /// Name of the footage.
    name: String,
    /// Whether it was made from the sample of an empty data folder.
    sample: bool,
    /// Whether it stays even if nobody uses it.
    pinned: bool,
    /// Time of the last use, exact to the hour, RFC 3339 in UTC.
    used_at: String,
    /// Size of all files, bytes.
    size_bytes: i64,
    /// Time of creation, RFC 3339 in UTC.
    created_at: String,
    /// All parameters of the flock, including defaults.
    #[schema(value_type = Params)]
    params: Value,
    #[serde(flatten)]
    summary: Summary,
    /// Files that can be downloaded, by name. Only in the response for one flock.
    #[serde(skip_serializing_if = "Option::is_none")]
    files: Option<Vec<FileView>>,
}

/// List all flocks, newest first.
#[utoipa::path(get, path = "/v1/flocks", params(FilmQuery), responses(
    (status = 200, body = Page<FlockView>),
    (status = "4XX", body = ProblemBody, content_type = "application/problem+json"),
))]
pub(super) async fn list_flocks(
    access: Access,
    query: Filtered<FilmQuery>,
) -> JsonAnswer<Page<FlockView>> {
    access.list(query.0).await
}

/// Get one flock: a summary, its parameters and advice.
///
/// Fails with `not_ready` if its job has not ended, and with the code of the job if that failed or was
/// cancelled. The status is 404 in all these cases. The message names the job and its state.
#[utoipa::path(get, path = "/v1/flocks/{id}", params(("id" = Uuid, Path)), responses(
    (status = 200, body = FlockView),
    (status = "4XX", body = ProblemBody, content_type = "application/problem+json"),
))]
pub(super) async fn get_flock(access: Access, Id(id): Id) -> JsonAnswer<FlockView> {
    access.get_result(id).await
}

/// Pin a flock, or unpin it.
///
/// A pinned flock stays even if nobody uses it, and so does everything that it was made from.
#[utoipa::path(patch, path = "/v1/flocks/{id}", params(("id" = Uuid, Path)), request_body = ResultChange,
    responses(
    (status = 200, body = FlockView),
    (status = "4XX", body = ProblemBody, content_type = "application/problem+json"),
    (status = "5XX", body = ProblemBody, content_type = "application/problem+json"),
))]
pub(super) async fn change_flock(
    access: Access,
    Id(id): Id,
    Json(change): Json<ResultChange>,
) -> JsonAnswer<FlockView> {
    access.change_result(id, &change.properties()).await
}

/// Delete a flock and its job.
#[utoipa::path(delete, path = "/v1/flocks/{id}", params(("id" = Uuid, Path)), responses(
    (status = 204, description = "deleted"),
    (status = "4XX", body = ProblemBody, content_type = "application/problem+json"),
))]
pub(super) async fn delete_flock(access: Access, Id(id): Id) -> Result<StatusCode, Problem> {
    access.delete::<Flock>(id).await
}

/// Download a file of a flock.
///
/// - `video.mp4`: the film
/// - `flock.json`: all data of the flock
/// - `flock.plan`: positions and frames as binary columns, for drawing the flock (docs/reference/formats.md)
/// - `thumb.webp`: the middle frame, at most 320 pixels wide and 30 KB long
/// - `plan.svg`: chart of the headings of boids and individuals
/// - `tracks.csv`, `ground-truth.zip`: the ground truth, unless `render.ground_truth` is false
/// - `video.webm`, `video.mov`, `frames.zip`, `preview.gif`, `preview.webp`, `poster.png`: if
///   `render.formats` names them, by default only `poster.png`
/// - `overlay.mp4`: the film with the position and heading of every boid, if `render.overlay` is true
///
/// `school.glb` has an operation of its own.
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
    access: Access,
    FileOf(id, name): FileOf,
    conditions: Conditions,
) -> Answer {
    let (name, media_type) = find_file(FILES, &name)?;
    let flock = access.find::<Flock>(id).await?;
    if !LIST_PICTURES.contains(&name) {
        access.note_use::<Flock>(&flock);
    }
    let download = Download {
        folder: &flock.folder,
        name,
        media_type,
        disposition: saved_as(media_type, &saved_name(&flock, name)?),
    };
    download.answer(access.store(), &conditions).await
}

/// Returns the name under which a browser saves the file, such as `finch_40x240_s1.mp4` for 40 individuals, 240
/// frames and the seed 1.
fn saved_name(flock: &FilmRow, name: &str) -> Result<String, Problem> {
    let Summary {
        count,
        frames,
        seed,
        ..
    } = super::stored(&flock.summary)?;
    let flock = format!("{}_{count}x{frames}_s{seed}", stem(&flock.name));
    let main = ["video.", "flock."];
    let kind = main.iter().find_map(|main| name.strip_prefix(main));
    Ok(match kind {
        Some(kind) => format!("{flock}.{kind}"),
        None => format!("{flock}_{name}"),
    })
}

impl View for FlockView {
    type Stored = Flock;

    fn id(&self) -> Uuid {
        self.id
    }

    fn from_row(row: FilmRow) -> Result<FlockView, Problem> {
        Ok(FlockView {
            id: row.id,
            job_id: row.job_id,
            state: JobState::Done.name(),
            library_id: row.library_id,
            name: row.name,
            sample: row.sample,
            pinned: row.pinned,
            used_at: rfc3339(row.used_ms),
            size_bytes: row.size_bytes,
            created_at: rfc3339(row.created_ms),
            params: super::stored(&row.params)?,
            summary: super::stored(&row.summary)?,
            files: None,
        })
    }
}

impl ResultView for FlockView {
    const FILES: Files = FILES;

    fn folders(row: &FilmRow) -> Vec<&str> {
        vec![&row.folder]
    }

    fn with_files(self, files: Vec<FileView>) -> FlockView {
        FlockView {
            files: Some(files),
            ..self
        }
    }
}
