//! Libraries: the results of analyses, with their pictures and files.

mod computed; // files that are not stored
mod views; // files that are made late

use axum::http::StatusCode;
use serde::{Deserialize, Serialize};
use serde_json::Value;
use utoipa::ToSchema;
use uuid::Uuid;

use super::download::names::{saved_as, stem};
use super::download::{Download, Files, find as find_file};
use super::extract::{Access, Conditions, FileOf, Id, Json, Query, given};
use super::paging::{Filtered, LibraryQuery, Page};
use super::problem::{Answer, JsonAnswer, Problem, ProblemBody};
use super::resources::{FileView, ResultView, View};
use super::timestamp::rfc3339;
use crate::jobs::analysis::Summary;
use crate::jobs::views::{FILM, OVERLAY};
use crate::store::jobs::JobState;
use crate::store::resources::{Library, Property};
use computed::{Zoned, computed, is_computed, length_px, scale_of};
use flockreel_core::code::Code;
use flockreel_core::library::{Scale, ScaleError};
use views::{ViewsState, folder_of};

const FILES: Files = &[
    ("library.json", "application/json"),
    ("poses.json", "application/json"),
    ("poses.csv", "text/csv; charset=utf-8"),
    ("background.png", "image/png"),
    ("poster.jpg", "image/jpeg"),
    (FILM, "video/mp4"),
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
    (OVERLAY, "video/mp4"),
    ("sprites.zip", "application/zip"),
    ("mattes.zip", "application/zip"),
];

/// Name of the picture of a library in lists. To see it there is no use of the library.
const LIST_PICTURE: &str = "poster.jpg";

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
    /// Size of all files, bytes. It grows when the views are done.
    size_bytes: i64,
    /// Time of creation, RFC 3339 in UTC.
    created_at: String,
    /// All parameters of the analysis, including defaults.
    #[schema(value_type = flockreel_core::analysis::Params)]
    params: Value,
    #[serde(flatten)]
    summary: Summary,
    /// Scale of `motion.csv` and the other files in centimetres, pixels per centimetre. Null until it is set.
    px_per_cm: Option<f64>,
    /// Length of the animal, centimetres: `length_px` by the scale. Null without a scale.
    length_cm: Option<f64>,
    /// State of `film.mp4` and `overlay.mp4`, which are made after the library.
    views: ViewsState,
    /// Files that can be downloaded, by name. Only in the response for one library.
    #[serde(skip_serializing_if = "Option::is_none")]
    files: Option<Vec<FileView>>,
}

/// New properties of a library. Absent ones do not change. At least one must be given.
#[derive(Clone, Copy, Debug, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
#[schema(min_properties = 1)]
pub(super) struct LibraryChange {
    /// Whether it stays even if nobody uses it.
    #[serde(default, deserialize_with = "given")]
    #[schema(value_type = bool, required = false)]
    pinned: Option<bool>,
    /// Scale, pixels per centimetre of the floor (seen from above) or of the plane in which the animal moves (seen
    /// from the side). Null takes the scale away.
    #[serde(default, deserialize_with = "given")]
    #[schema(value_type = Option<f64>, required = false, minimum = 0.001, maximum = 1000000)]
    px_per_cm: Option<Option<f64>>,
    /// Length of the animal from nose to tail tip, centimetres. It sets the scale, instead of `px_per_cm`.
    #[serde(default, deserialize_with = "given")]
    #[schema(value_type = f64, required = false, exclusive_minimum = 0)]
    length_cm: Option<f64>,
}

impl LibraryChange {
    /// Returns the new scale of an animal with this length in the picture; `None` if the scale does not change.
    fn scale(&self, length_px: Option<f64>) -> Result<Option<Option<Scale>>, ScaleError> {
        match (self.px_per_cm, self.length_cm) {
            (_, Some(length_cm)) => Ok(Some(Some(Scale::from_length(length_cm, length_px)?))),
            (Some(Some(px_per_cm)), None) => Ok(Some(Some(Scale::new(px_per_cm)?))),
            (Some(None), None) => Ok(Some(None)),
            (None, None) => Ok(None),
        }
    }

    /// Returns the changed properties. Fails if there are none, or if they contradict each other.
    fn properties(&self, library: &Library) -> Result<Vec<Property<'static>>, Problem> {
        let refused = |sentence: &str| Problem::new(Code::InvalidParams, sentence);
        if self.px_per_cm.is_some() && self.length_cm.is_some() {
            return Err(refused(
                "the change must have px_per_cm or length_cm, not both",
            ));
        }
        let scale = self.scale(length_px(library)?);
        let scale = scale.map_err(|error| refused(&error.to_string()))?;
        let scale = scale.map(|scale| Property::PxPerCm(scale.map(Scale::px_per_cm)));
        let pinned = self.pinned.map(Property::Pinned);
        let properties: Vec<_> = pinned.into_iter().chain(scale).collect();
        if properties.is_empty() {
            return Err(refused(
                "the change must have pinned, px_per_cm or length_cm",
            ));
        }
        Ok(properties)
    }
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

/// Set the scale of a library, or pin it.
///
/// The scale is a number of pixels per centimetre, or follows from the length of the animal. It changes
/// `motion.csv`, `motion.json`, `summary.csv` and `summary.json`. Nothing is measured again, and stored files and flocks
/// do not change. Wrong numbers fail with `invalid_params`. A pinned library stays even if nobody uses it, and so
/// does everything that it was made from.
#[utoipa::path(patch, path = "/v1/libraries/{id}", params(("id" = Uuid, Path)), request_body = LibraryChange,
    responses(
    (status = 200, body = LibraryView),
    (status = "4XX", body = ProblemBody, content_type = "application/problem+json"),
    (status = "5XX", body = ProblemBody, content_type = "application/problem+json"),
))]
pub(super) async fn change_library(
    access: Access,
    Id(id): Id,
    Json(change): Json<LibraryChange>,
) -> JsonAnswer<LibraryView> {
    let properties = change.properties(&access.find::<Library>(id).await?)?;
    access.change_result(id, &properties).await
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
/// - `motion.csv`, `motion.json`: place, speed and size in every frame, in centimetres if the library has a scale
/// - `summary.csv`, `summary.json`: distance, speeds, rest and turns in the film, and the use of `zones`
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
/// `overlay.mp4` and `film.mp4` are made after the library by a job of kind `views`, when nothing else waits. Until then
/// they fail with `making` (409, `Retry-After`), and with the code of that job (404) if it failed or was cancelled;
/// `views` of the library names the job and its state.
///
/// Range and conditional requests are supported. Motion, summary and `distance.npy` are computed for each request
/// and sent whole. They fail with `busy` if another computation does not end within 20 seconds, and
/// `distance.npy` with `too_many_frames` for longer footage. The ETag of motion and summary depends on the scale.
#[utoipa::path(get, path = "/v1/libraries/{id}/{file}",
    params(("id" = Uuid, Path), ("file" = String, Path), Zoned), responses(
    (status = 200, description = "the file"),
    (status = 206, description = "the requested range of the file"),
    (status = 304, description = "not modified"),
    (status = "4XX", body = ProblemBody, content_type = "application/problem+json"),
))]
pub(super) async fn get_library_file(
    access: Access,
    FileOf(id, name): FileOf,
    Query(zoned): Query<Zoned>,
    conditions: Conditions,
) -> Answer {
    if is_computed(&name) {
        let library = access.find::<Library>(id).await?;
        access.note_use::<Library>(&library);
        return computed(&access, &library, &name, zoned, &conditions).await;
    }
    let (name, media_type) = find_file(FILES, &name)?;
    let library = access.find::<Library>(id).await?;
    if name != LIST_PICTURE {
        access.note_use::<Library>(&library);
    }
    let download = Download {
        folder: folder_of(&access, &library, name).await?,
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

impl View for LibraryView {
    type Stored = Library;

    fn id(&self) -> Uuid {
        self.id
    }

    fn from_row(row: Library) -> Result<LibraryView, Problem> {
        let summary: Summary = super::stored(&row.summary)?;
        let views = ViewsState::of(&row)?;
        let length_cm = scale_of(&row).zip(summary.length_px);
        Ok(LibraryView {
            px_per_cm: row.px_per_cm,
            length_cm: length_cm.map(|(scale, length_px)| scale.cm(length_px)),
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
            summary,
            views,
            files: None,
        })
    }
}

impl ResultView for LibraryView {
    const FILES: Files = FILES;

    fn folders(row: &Library) -> Vec<&str> {
        let views = row.views_folder.as_deref();
        [row.folder.as_str()].into_iter().chain(views).collect()
    }

    fn with_files(self, files: Vec<FileView>) -> LibraryView {
        LibraryView {
            files: Some(files),
            ..self
        }
    }
}
