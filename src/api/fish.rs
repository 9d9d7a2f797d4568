//! Virtual fish: start the job that makes one from the poses of a library, and read or delete it and its
//! files.

use axum::http::StatusCode;
use serde::{Deserialize, Serialize};
use serde_json::{Map, Value};
use utoipa::ToSchema;
use uuid::Uuid;

use super::download::names::{saved_as, stem};
use super::download::{Download, Files, find as find_file};
use super::extract::{Access, Conditions, FileOf, Id, Json};
use super::jobs::{accepted, job_to_follow};
use super::paging::{FilmQuery, Filtered, Page};
use super::problem::{Answer, JsonAnswer, Problem, ProblemBody};
use super::resources::{FileView, Reference, ResultChange, ResultView, View};
use super::timestamp::rfc3339;
use crate::jobs::IdSequence;
use crate::jobs::fish::{Input, Summary};
use crate::store::jobs::JobState;
use crate::store::resources::{FilmRow, Fish, Library};
use flockreel_core::fish::Params;
use flockreel_core::formats::params;
use flockreel_core::ids::{FishId, JobId, LibraryId};

const FILES: Files = &[
    ("fish.json", "application/json"),
    ("model.glb", "model/gltf-binary"),
    ("video.mp4", "video/mp4"),
];

/// Library and parameters of a virtual fish.
///
/// The parameters override the values of `preset`, or the defaults if there is no preset.
#[derive(Debug, Deserialize, ToSchema)]
pub(super) struct FishRequest {
    /// Id of the library whose poses move the fish, or `sample`: the newest library of the sample.
    #[schema(value_type = String)]
    library_id: Reference,
    #[serde(flatten)]
    #[schema(value_type = Params)]
    params: Map<String, Value>,
}

/// The queued job, and the virtual fish that it makes.
#[derive(Debug, Serialize, ToSchema)]
pub(super) struct FishAccepted {
    /// Job that makes the virtual fish.
    #[schema(value_type = Uuid)]
    job_id: JobId,
    /// Virtual fish that the job makes. It exists once the job is done.
    #[schema(value_type = Uuid)]
    fish_id: FishId,
}

/// Summary of a virtual fish.
#[derive(Debug, Serialize, ToSchema)]
pub(super) struct FishView {
    id: Uuid,
    /// Job that made the virtual fish.
    job_id: Uuid,
    /// State of the job: always `done`. Before, this address answers 404 with `not_ready`, or with the reason
    /// why there is no virtual fish.
    state: &'static str,
    /// Library whose poses move the fish.
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
    /// All parameters of the virtual fish, including defaults.
    #[schema(value_type = Params)]
    params: Value,
    #[serde(flatten)]
    summary: Summary,
    /// Files that can be downloaded, by name. Only in the response for one virtual fish.
    #[serde(skip_serializing_if = "Option::is_none")]
    files: Option<Vec<FileView>>,
}

/// Start making a virtual fish.
///
/// Queues a job that renders a virtual animal moved by the poses of a library. It looks like the filmed animal, or
/// like a goldfish (`body`). If the analysis of the library is still
/// queued or running, the job waits for it.
///
/// The response is 202. `Location` is the address of the job, and `Link` that of the future virtual fish.
/// With `Prefer: wait=N`, a job that ends in time gives 201. An unknown library and wrong parameters fail
/// with `invalid_params`. If too many jobs are queued or running, the call fails with `quota_exceeded` or
/// `queue_full`.
#[utoipa::path(post, path = "/v1/fish", request_body = FishRequest, responses(
    (status = 202, body = FishAccepted, headers(("location" = String), ("link" = String))),
    (status = 201, body = FishAccepted, headers(("location" = String)), description = "done within the requested wait"),
    (status = "4XX", body = ProblemBody, content_type = "application/problem+json"),
    (status = "5XX", body = ProblemBody, content_type = "application/problem+json"),
))]
pub(super) async fn create_fish(
    access: Access,
    mut ids: IdSequence,
    Json(request): Json<FishRequest>,
) -> Answer {
    let params: Params = params::read(request.params)?;
    let library_id = access.id_of::<Library>(request.library_id).await?;
    let library_id = LibraryId(library_id);
    let after_job = job_to_follow(&access, library_id).await?;
    let input = Input { library_id, params };
    let (job_id, fish_id) = access.enqueue(&input, after_job, &mut ids).await?;
    let result = format!("/v1/fish/{fish_id}");
    Ok(accepted(job_id, &result, FishAccepted { job_id, fish_id }))
}

/// List all virtual fish, newest first.
#[utoipa::path(get, path = "/v1/fish", params(FilmQuery), responses(
    (status = 200, body = Page<FishView>),
    (status = "4XX", body = ProblemBody, content_type = "application/problem+json"),
))]
pub(super) async fn list_fish(
    access: Access,
    query: Filtered<FilmQuery>,
) -> JsonAnswer<Page<FishView>> {
    access.list(query.0).await
}

/// Get one virtual fish: a summary and its parameters.
///
/// Fails with `not_ready` if its job has not ended, and with the code of the job if that failed or was
/// cancelled. The status is 404 in all these cases. The message names the job and its state.
#[utoipa::path(get, path = "/v1/fish/{id}", params(("id" = Uuid, Path)), responses(
    (status = 200, body = FishView),
    (status = "4XX", body = ProblemBody, content_type = "application/problem+json"),
))]
pub(super) async fn get_fish(access: Access, Id(id): Id) -> JsonAnswer<FishView> {
    access.get_result(id).await
}

/// Pin a virtual fish, or unpin it.
///
/// A pinned virtual fish stays even if nobody uses it, and so does everything that it was made from.
#[utoipa::path(patch, path = "/v1/fish/{id}", params(("id" = Uuid, Path)), request_body = ResultChange,
    responses(
    (status = 200, body = FishView),
    (status = "4XX", body = ProblemBody, content_type = "application/problem+json"),
    (status = "5XX", body = ProblemBody, content_type = "application/problem+json"),
))]
pub(super) async fn change_fish(
    access: Access,
    Id(id): Id,
    Json(change): Json<ResultChange>,
) -> JsonAnswer<FishView> {
    access.change_result(id, &change.properties()).await
}

/// Delete a virtual fish and its job.
#[utoipa::path(delete, path = "/v1/fish/{id}", params(("id" = Uuid, Path)), responses(
    (status = 204, description = "deleted"),
    (status = "4XX", body = ProblemBody, content_type = "application/problem+json"),
))]
pub(super) async fn delete_fish(access: Access, Id(id): Id) -> Result<StatusCode, Problem> {
    access.delete::<Fish>(id).await
}

/// Download a file of a virtual fish.
///
/// - `video.mp4`: the fish in front of the background of the footage
/// - `fish.json`: its motion, and the measured beat of the tail
/// - `model.glb`: an animated 3-D model (binary glTF)
///
/// Range and conditional requests are supported.
#[utoipa::path(get, path = "/v1/fish/{id}/{file}",
    params(("id" = Uuid, Path), ("file" = String, Path)), responses(
    (status = 200, description = "the file"),
    (status = 206, description = "the requested range of the file"),
    (status = 304, description = "not modified"),
    (status = "4XX", body = ProblemBody, content_type = "application/problem+json"),
))]
pub(super) async fn get_fish_file(
    access: Access,
    FileOf(id, name): FileOf,
    conditions: Conditions,
) -> Answer {
    let (name, media_type) = find_file(FILES, &name)?;
    let fish = access.find::<Fish>(id).await?;
    access.note_use::<Fish>(&fish);
    let extension = if name == "video.mp4" { "mp4" } else { "glb" };
    let label = format!("{}_fish.{extension}", stem(&fish.name));
    let download = Download {
        folder: &fish.folder,
        name,
        media_type,
        disposition: saved_as(media_type, &label),
    };
    download.answer(access.store(), &conditions).await
}

impl View for FishView {
    type Stored = Fish;

    fn id(&self) -> Uuid {
        self.id
    }

    fn from_row(row: FilmRow) -> Result<FishView, Problem> {
        Ok(FishView {
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

impl ResultView for FishView {
    const FILES: Files = FILES;

    fn folders(row: &FilmRow) -> Vec<&str> {
        vec![&row.folder]
    }

    fn with_files(self, files: Vec<FileView>) -> FishView {
        FishView {
            files: Some(files),
            ..self
        }
    }
}
