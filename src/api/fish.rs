//! Virtual fish: driven by a library's poses, as a job.

use axum::body::Body;
use axum::extract::State;
use axum::http::{Response, StatusCode};
use serde::{Deserialize, Serialize};
use serde_json::{Map, Value};
use utoipa::ToSchema;
use uuid::Uuid;

use super::AppState;
use super::access::Caller;
use super::download::{Download, Files, disposition, find as find_file};
use super::extract::{Conditions, FileOf, Id, Json};
use super::jobs::{absent_result, accepted, job_to_follow};
use super::paging::{Page, Paging};
use super::problem::{Problem, ProblemBody, gone};
use super::timestamp::rfc3339;
use crate::fish::Params;
use crate::formats::params;
use crate::ids::{FishId, JobId, LibraryId};
use crate::jobs::fish::{Input, Summary, enqueue};
use crate::store::flocks::Film;

const FILES: Files = &[
    ("model.glb", "model/gltf-binary"),
    ("video.mp4", "video/mp4"),
];

/// What to make it of, and how: overrides of the defaults, or of `preset` (`papers`).
#[derive(Debug, Deserialize, ToSchema)]
pub(super) struct FishRequest {
    #[schema(value_type = Uuid)]
    library_id: LibraryId,
    #[serde(flatten)]
    #[schema(value_type = Params)]
    params: Map<String, Value>,
}

/// The job, and the virtual fish that it will make.
#[derive(Debug, Serialize, ToSchema)]
pub(super) struct FishAccepted {
    #[schema(value_type = Uuid)]
    job_id: JobId,
    #[schema(value_type = Uuid)]
    fish_id: FishId,
}

/// One virtual fish.
#[derive(Debug, Serialize, ToSchema)]
pub(super) struct FishView {
    id: Uuid,
    job_id: Uuid,
    library_id: Uuid,
    /// Whether it came of the sample that the program made itself.
    sample: bool,
    size_bytes: i64,
    created_at: String,
    /// The parameters it was made with.
    #[schema(value_type = Params)]
    params: Value,
    #[serde(flatten)]
    summary: Summary,
}

/// Make a virtual fish of a library, or of one that is still being made.
#[utoipa::path(post, path = "/v1/fish", request_body = FishRequest, responses(
    (status = 202, body = FishAccepted, headers(("location" = String), ("link" = String))),
    (status = 201, body = FishAccepted, headers(("location" = String)), description = "done within the wait asked for"),
    (status = "4XX", body = ProblemBody, content_type = "application/problem+json"),
    (status = "5XX", body = ProblemBody, content_type = "application/problem+json"),
))]
pub(super) async fn create_fish(
    State(state): State<AppState>,
    caller: Caller,
    Json(request): Json<FishRequest>,
) -> Result<Response<Body>, Problem> {
    let params: Params = params::read(request.params)?;
    let library_id = request.library_id;
    let after_job = job_to_follow(&state, &caller, library_id).await?;
    let input = Input { library_id, params };
    let (job_id, fish_id) = enqueue(&state.context, &input, after_job, &caller.account).await?;
    let result = format!("/v1/fish/{fish_id}");
    Ok(accepted(job_id, &result, FishAccepted { job_id, fish_id }))
}

/// Every virtual fish, newest first.
#[utoipa::path(get, path = "/v1/fish", params(Paging), responses(
    (status = 200, body = Page<FishView>),
    (status = "4XX", body = ProblemBody, content_type = "application/problem+json"),
))]
pub(super) async fn list_fish(
    State(state): State<AppState>,
    caller: Caller,
    paging: Paging,
) -> Result<axum::Json<Page<FishView>>, Problem> {
    let store = &state.context.store;
    let rows = store
        .list_fish(paging.limit + 1, paging.cursor, &caller.reach)
        .await?;
    Page::of(rows, paging, |row| row.id, FishView::of)
}

/// One virtual fish at a glance.
#[utoipa::path(get, path = "/v1/fish/{id}", params(("id" = Uuid, Path)), responses(
    (status = 200, body = FishView),
    (status = "4XX", body = ProblemBody, content_type = "application/problem+json"),
))]
pub(super) async fn get_fish(
    State(state): State<AppState>,
    caller: Caller,
    Id(id): Id,
) -> Result<axum::Json<FishView>, Problem> {
    Ok(axum::Json(FishView::of(find(&state, &caller, id).await?)?))
}

/// Delete a virtual fish.
#[utoipa::path(delete, path = "/v1/fish/{id}", params(("id" = Uuid, Path)), responses(
    (status = 204, description = "it is gone"),
    (status = "4XX", body = ProblemBody, content_type = "application/problem+json"),
))]
pub(super) async fn delete_fish(
    State(state): State<AppState>,
    caller: Caller,
    Id(id): Id,
) -> Result<StatusCode, Problem> {
    find(&state, &caller, id).await?;
    gone(state.context.store.delete_film(id).await?)
}

/// A file of a virtual fish: model.glb, video.mp4.
#[utoipa::path(get, path = "/v1/fish/{id}/{file}",
    params(("id" = Uuid, Path), ("file" = String, Path)), responses(
    (status = 200, description = "the file"),
    (status = 206, description = "a part of the file"),
    (status = 304, description = "the client has it already"),
    (status = "4XX", body = ProblemBody, content_type = "application/problem+json"),
))]
pub(super) async fn get_fish_file(
    State(state): State<AppState>,
    caller: Caller,
    FileOf(id, name): FileOf,
    conditions: Conditions,
) -> Result<Response<Body>, Problem> {
    let (name, media_type) = find_file(FILES, &name)?;
    let fish = find(&state, &caller, id).await?;
    let label = match name {
        "video.mp4" => format!("fish-{id}.mp4"),
        _ => format!("fish-{id}.glb"),
    };
    let download = Download {
        folder: &fish.folder,
        name,
        media_type,
        disposition: disposition("inline", &label),
    };
    download.answer(&state.context.store, &conditions).await
}

async fn find(state: &AppState, caller: &Caller, id: Uuid) -> Result<Film, Problem> {
    match state.context.store.fish(id, &caller.reach).await? {
        Some(fish) => Ok(fish),
        None => Err(absent_result(state, caller, id).await?),
    }
}

impl FishView {
    fn of(row: Film) -> Result<FishView, Problem> {
        Ok(FishView {
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
