//! Libraries: what was measured, with pictures.

use axum::body::Body;
use axum::extract::State;
use axum::http::{Response, StatusCode, header};
use serde::Serialize;
use serde_json::Value;
use tokio_util::io::ReaderStream;
use utoipa::ToSchema;
use uuid::Uuid;

use super::AppState;
use super::access::Caller;
use super::download::{Download, Files, built, disposition, find as find_file};
use super::extract::{Conditions, FileOf, Id};
use super::jobs::absent_result;
use super::paging::{Page, Paging};
use super::problem::{Problem, ProblemBody, gone};
use super::timestamp::rfc3339;
use crate::jobs::analysis::Summary;
use crate::jobs::{self, at_once};
use crate::store::libraries::Library;

const FILES: Files = &[
    ("library.json", "application/json"),
    ("poses.json", "application/json"),
    ("poses.csv", "text/csv; charset=utf-8"),
    ("background.png", "image/png"),
    ("occluders.png", "image/png"),
    ("distance.png", "image/png"),
    ("candidates.png", "image/png"),
    ("headings.svg", "image/svg+xml"),
    ("trajectory.svg", "image/svg+xml"),
    ("confidence.svg", "image/svg+xml"),
    ("transitions.svg", "image/svg+xml"),
    ("overlay.mp4", "video/mp4"),
    ("sprites.zip", "application/zip"),
    ("mattes.zip", "application/zip"),
];

/// The one file that is not kept.
const NUMBERS: &str = "distance.npy";

/// What one analysis yielded.
#[derive(Debug, Serialize, ToSchema)]
pub(super) struct LibraryView {
    id: Uuid,
    job_id: Uuid,
    footage_id: Uuid,
    /// What the footage is called.
    name: String,
    /// Whether it came of the sample that the program made itself.
    sample: bool,
    size_bytes: i64,
    created_at: String,
    /// The parameters it was made with.
    #[schema(value_type = crate::analysis::Params)]
    params: Value,
    #[serde(flatten)]
    summary: Summary,
}

/// Every library, newest first.
#[utoipa::path(get, path = "/v1/libraries", params(Paging), responses(
    (status = 200, body = Page<LibraryView>),
    (status = "4XX", body = ProblemBody, content_type = "application/problem+json"),
))]
pub(super) async fn list_libraries(
    State(state): State<AppState>,
    caller: Caller,
    paging: Paging,
) -> Result<axum::Json<Page<LibraryView>>, Problem> {
    let store = &state.context.store;
    let rows = store
        .list_libraries(paging.limit + 1, paging.cursor, &caller.reach)
        .await?;
    Page::of(rows, paging, |row| row.id, LibraryView::of)
}

/// One library at a glance.
#[utoipa::path(get, path = "/v1/libraries/{id}", params(("id" = Uuid, Path)), responses(
    (status = 200, body = LibraryView),
    (status = "4XX", body = ProblemBody, content_type = "application/problem+json"),
))]
pub(super) async fn get_library(
    State(state): State<AppState>,
    caller: Caller,
    Id(id): Id,
) -> Result<axum::Json<LibraryView>, Problem> {
    Ok(axum::Json(LibraryView::of(
        find(&state, &caller, id).await?,
    )?))
}

/// Delete a library with all that was made of it.
#[utoipa::path(delete, path = "/v1/libraries/{id}", params(("id" = Uuid, Path)), responses(
    (status = 204, description = "it is gone"),
    (status = "4XX", body = ProblemBody, content_type = "application/problem+json"),
))]
pub(super) async fn delete_library(
    State(state): State<AppState>,
    caller: Caller,
    Id(id): Id,
) -> Result<StatusCode, Problem> {
    find(&state, &caller, id).await?;
    gone(state.context.store.delete_library(id).await?)
}

/// A file of a library: library.json, poses.json, poses.csv, background.png, occluders.png, distance.png,
/// candidates.png, headings.svg, trajectory.svg, confidence.svg, transitions.svg, overlay.mp4, sprites.zip, mattes.zip; and
/// distance.npy, which is computed anew each time and comes whole. occluders.png is there where something is known to stand
/// before the animal (`occluders` in library.json).
#[utoipa::path(get, path = "/v1/libraries/{id}/{file}",
    params(("id" = Uuid, Path), ("file" = String, Path)), responses(
    (status = 200, description = "the file"),
    (status = 206, description = "a part of the file"),
    (status = 304, description = "the client has it already"),
    (status = "4XX", body = ProblemBody, content_type = "application/problem+json"),
))]
pub(super) async fn get_library_file(
    State(state): State<AppState>,
    caller: Caller,
    FileOf(id, name): FileOf,
    conditions: Conditions,
) -> Result<Response<Body>, Problem> {
    if name == NUMBERS {
        let library = find(&state, &caller, id).await?;
        return numbers(&state, &library, &conditions).await;
    }
    let (name, media_type) = find_file(FILES, &name)?;
    let library = find(&state, &caller, id).await?;
    let download = Download {
        folder: &library.folder,
        name,
        media_type,
        disposition: disposition("inline", name),
    };
    download.answer(&state.context.store, &conditions).await
}

/// The distances as numbers. They are made of files that never change: whoever has them keeps them.
async fn numbers(
    state: &AppState,
    library: &Library,
    conditions: &Conditions,
) -> Result<Response<Body>, Problem> {
    let etag = format!("\"{}-{NUMBERS}\"", library.id);
    let known = conditions.headers.get(header::IF_NONE_MATCH);
    let answer = Response::builder().header(header::ETAG, &etag).header(
        header::CACHE_CONTROL,
        "private, max-age=31536000, immutable",
    );
    if known.is_some_and(|known| known.as_bytes() == etag.as_bytes()) {
        return built(answer.status(StatusCode::NOT_MODIFIED).body(Body::empty()));
    }
    let file = at_once::distances(&state.context, library).await?;
    let n_bytes = file.metadata().map_err(jobs::Error::Io)?.len();
    let file = ReaderStream::new(tokio::fs::File::from_std(file));
    built(
        answer
            .header(header::CONTENT_TYPE, "application/octet-stream")
            .header(header::CONTENT_LENGTH, n_bytes)
            .header(
                header::CONTENT_DISPOSITION,
                disposition("attachment", NUMBERS),
            )
            .body(Body::from_stream(file)),
    )
}

pub(super) async fn find(state: &AppState, caller: &Caller, id: Uuid) -> Result<Library, Problem> {
    match state.context.store.library(id, &caller.reach).await? {
        Some(library) => Ok(library),
        None => Err(absent_result(state, caller, id).await?),
    }
}

impl LibraryView {
    fn of(row: Library) -> Result<LibraryView, Problem> {
        Ok(LibraryView {
            id: row.id,
            job_id: row.job_id,
            footage_id: row.footage_id,
            name: row.name,
            sample: row.sample,
            size_bytes: row.size_bytes,
            created_at: rfc3339(row.created_ms),
            params: super::stored(&row.params)?,
            summary: super::stored(&row.summary)?,
        })
    }
}
