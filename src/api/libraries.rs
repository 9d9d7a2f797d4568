//! Libraries: the results of analyses, with their pictures and files.

use axum::body::Body;
use axum::http::{Response, StatusCode, header};
use serde::Serialize;
use serde_json::Value;
use tokio_util::io::ReaderStream;
use utoipa::ToSchema;
use uuid::Uuid;

use super::download::names::{saved_as, stem};
use super::download::{Download, Files, built, find as find_file, matches};
use super::extract::{Access, Conditions, FileOf, Id, Json};
use super::paging::{Filtered, LibraryQuery, Page};
use super::problem::{Answer, JsonAnswer, Problem, ProblemBody};
use super::resources::{FileView, ResultChange, ResultView, View};
use super::timestamp::rfc3339;
use crate::jobs::analysis::Summary;
use crate::jobs::{self, synchronous};
use crate::store::jobs::JobState;
use crate::store::resources::Library;

const FILES: Files = &[
    ("library.json", "application/json"),
    ("poses.json", "application/json"),
    ("poses.csv", "text/csv; charset=utf-8"),
    ("background.png", "image/png"),
    ("poster.jpg", "image/jpeg"),
    ("film.mp4", "video/mp4"),
    ("atlas.json", "application/json"),
    ("atlas-0.webp", "image/webp"),
    ("atlas-1.webp", "image/webp"),
    ("atlas-2.webp", "image/webp"),
    ("atlas-3.webp", "image/webp"),
    ("atlas-small-0.webp", "image/webp"),
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

/// Name of the picture of a library in lists. To see it there is no use of the library.
const LIST_PICTURE: &str = "poster.jpg";

/// Name of the file that is not stored, but computed for each request.
const DISTANCE_ARRAY: &str = "distance.npy";

/// Summary of a library, the result of one analysis.
#[derive(Debug, Serialize, ToSchema)]
pub(super) struct LibraryView {
    id: Uuid,
    /// Job that made the library.
    job_id: Uuid,
    /// State of the job: always `done`. Before, this address answers 404 with `not_ready`, or with the reason
    /// why there is no library.
    state: &'static str,
    /// Footage that was measured.
    footage_id: Uuid,
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
    /// All parameters of the analysis, including defaults.
    #[schema(value_type = flockreel_core::analysis::Params)]
    params: Value,
    #[serde(flatten)]
    summary: Summary,
    /// Files that can be downloaded, by name. Only in the response for one library.
    #[serde(skip_serializing_if = "Option::is_none")]
    files: Option<Vec<FileView>>,
}

/// List all libraries, newest first.
#[utoipa::path(get, path = "/v1/libraries", params(LibraryQuery), responses(
    (status = 200, body = Page<LibraryView>),
    (status = "4XX", body = ProblemBody, content_type = "application/problem+json"),
))]
pub(super) async fn list_libraries(
    access: Access,
    query: Filtered<LibraryQuery>,
) -> JsonAnswer<Page<LibraryView>> {
    access.list(query.0).await
}

/// Get one library: a summary, its parameters and advice.
///
/// Fails with `not_ready` if its job has not ended, and with the code of the job if that failed or was
/// cancelled. The status is 404 in all these cases. The message names the job and its state.
#[utoipa::path(get, path = "/v1/libraries/{id}", params(("id" = Uuid, Path)), responses(
    (status = 200, body = LibraryView),
    (status = "4XX", body = ProblemBody, content_type = "application/problem+json"),
))]
pub(super) async fn get_library(access: Access, Id(id): Id) -> JsonAnswer<LibraryView> {
    access.get_result(id).await
}

/// Pin a library, or unpin it.
///
/// A pinned library stays even if nobody uses it, and so does everything that it was made from.
#[utoipa::path(patch, path = "/v1/libraries/{id}", params(("id" = Uuid, Path)), request_body = ResultChange,
    responses(
    (status = 200, body = LibraryView),
    (status = "4XX", body = ProblemBody, content_type = "application/problem+json"),
    (status = "5XX", body = ProblemBody, content_type = "application/problem+json"),
))]
pub(super) async fn change_library(
    access: Access,
    Id(id): Id,
    Json(change): Json<ResultChange>,
) -> JsonAnswer<LibraryView> {
    access.change_result(id, change).await
}

/// Delete a library and everything made from it.
///
/// Its flocks, virtual fish and jobs are deleted too. Running jobs are stopped.
#[utoipa::path(delete, path = "/v1/libraries/{id}", params(("id" = Uuid, Path)), responses(
    (status = 204, description = "deleted"),
    (status = "4XX", body = ProblemBody, content_type = "application/problem+json"),
))]
pub(super) async fn delete_library(access: Access, Id(id): Id) -> Result<StatusCode, Problem> {
    access.delete::<Library>(id).await
}

/// Download a file of a library.
///
/// - `library.json`, `poses.json`, `poses.csv`: the measured data
/// - `background.png`: the scene without the animal
/// - `occluders.png`: objects in front of the animal, only if any are known (`occluders` in library.json)
/// - `distance.png`, `candidates.png`: the distances between clips, and the pairs of similar clips
/// - `distance.npy`: the distances as a NumPy array, for footage of at most 8192 frames
/// - `headings.svg`, `trajectory.svg`, `confidence.svg`, `transitions.svg`: charts
/// - `overlay.mp4`: the footage with its poses drawn over it
/// - `film.mp4`, `poster.jpg`: the footage as browsers can play it, at most 960 pixels wide; and one frame
/// - `atlas.json`, `atlas-0.webp` and further pages: the sprites of playback in few pictures
/// - `sprites.zip`: the sprites, one PNG per frame
/// - `mattes.zip`: the animal cut out of every frame as filmed, one PNG per frame
///
/// Range and conditional requests are supported. Only `distance.npy` is always sent whole: it is computed for
/// each request. It fails with `too_many_frames` for longer footage, and with `busy` if another computation
/// does not end within 20 seconds.
#[utoipa::path(get, path = "/v1/libraries/{id}/{file}",
    params(("id" = Uuid, Path), ("file" = String, Path)), responses(
    (status = 200, description = "the file"),
    (status = 206, description = "the requested range of the file"),
    (status = 304, description = "not modified"),
    (status = "4XX", body = ProblemBody, content_type = "application/problem+json"),
))]
pub(super) async fn get_library_file(
    access: Access,
    FileOf(id, name): FileOf,
    conditions: Conditions,
) -> Answer {
    if name == DISTANCE_ARRAY {
        let library = access.find::<Library>(id).await?;
        access.note_use::<Library>(&library);
        return distance_array(&access, &library, &conditions).await;
    }
    let (name, media_type) = find_file(FILES, &name)?;
    let library = access.find::<Library>(id).await?;
    if name != LIST_PICTURE {
        access.note_use::<Library>(&library);
    }
    let download = Download {
        folder: &library.folder,
        name,
        media_type,
        disposition: saved_as(media_type, &saved_name(&library, name)),
    };
    download.answer(access.store(), &conditions).await
}

/// Returns the name under which a browser saves the file.
fn saved_name(library: &Library, name: &str) -> String {
    format!("{}_{name}", stem(&library.name))
}

/// Returns distance.npy. The library's files never change, so clients may cache the result forever.
async fn distance_array(access: &Access, library: &Library, conditions: &Conditions) -> Answer {
    let etag = format!("\"{}-{DISTANCE_ARRAY}\"", library.id);
    let known = conditions.headers.get(header::IF_NONE_MATCH);
    let answer = Response::builder().header(header::ETAG, &etag).header(
        header::CACHE_CONTROL,
        "private, max-age=31536000, immutable",
    );
    let known = known.and_then(|tags| tags.to_str().ok());
    if known.is_some_and(|tags| matches(tags, &etag)) {
        return built(answer.status(StatusCode::NOT_MODIFIED).body(Body::empty()));
    }
    let (context, owner) = (&access.state.context, &access.caller.account.owner);
    let file = synchronous::distance_file(context, owner, library).await?;
    let n_bytes = file.metadata().map_err(jobs::Error::Io)?.len();
    let file = ReaderStream::new(tokio::fs::File::from_std(file));
    built(
        answer
            .header(header::CONTENT_TYPE, "application/octet-stream")
            .header(header::CONTENT_LENGTH, n_bytes)
            .header(
                header::CONTENT_DISPOSITION,
                saved_as(
                    "application/octet-stream",
                    &saved_name(library, DISTANCE_ARRAY),
                ),
            )
            .body(Body::from_stream(file)),
    )
}

impl View for LibraryView {
    type Stored = Library;

    fn id(&self) -> Uuid {
        self.id
    }

    fn from_row(row: Library) -> Result<LibraryView, Problem> {
        Ok(LibraryView {
            id: row.id,
            job_id: row.job_id,
            state: JobState::Done.name(),
            footage_id: row.footage_id,
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

impl ResultView for LibraryView {
    const FILES: Files = FILES;

    fn folder(row: &Library) -> &str {
        &row.folder
    }

    fn with_files(self, files: Vec<FileView>) -> LibraryView {
        LibraryView {
            files: Some(files),
            ..self
        }
    }
}
