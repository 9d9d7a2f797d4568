//! Data sets: their JSON, and reading and deleting them with their files. The archive is not stored as one file: its pieces
//! are sent one after the other.

mod create; // JSON -> queued job, estimate or samples

use axum::http::StatusCode;
use serde::Serialize;
use serde_json::Value;
use utoipa::ToSchema;
use utoipa_axum::router::OpenApiRouter;
use utoipa_axum::routes;
use uuid::Uuid;

use crate::api::AppState;
use crate::api::download::names::{saved_as, stem};
use crate::api::download::{Files, Piece, Sent, find as find_file};
use crate::api::extract::{Access, Conditions, FileOf, Id, Json};
use crate::api::paging::{FilmQuery, Filtered, Page};
use crate::api::problem::{Answer, JsonAnswer, Problem, ProblemBody};
use crate::api::resources::{FileView, ResultChange, ResultView, View};
use crate::api::timestamp::rfc3339;
use crate::jobs::flock::dataset::archive::PIECE;
use crate::jobs::flock::dataset::job::{SHEET, Summary};
use crate::jobs::flock::dataset::manifest::MANIFEST;
use crate::store::Store;
use crate::store::jobs::{JobState, Kind};
use crate::store::resources::{Dataset, FilmRow, ResourceKind};
use flockreel_core::dataset::Params;

/// Name of the archive, which is sent in pieces.
const ARCHIVE: &str = "dataset.zip";
const FILES: Files = &[
    (ARCHIVE, "application/zip"),
    (MANIFEST, "application/json"),
    ("README.md", "text/markdown; charset=utf-8"),
    (SHEET, "image/jpeg"),
];

/// Returns the routes of data sets.
pub(in crate::api) fn table() -> OpenApiRouter<AppState> {
    OpenApiRouter::new()
        .routes(routes!(create::create_dataset, list_datasets))
        .routes(routes!(create::estimate_dataset))
        .routes(routes!(create::preview_dataset))
        .routes(routes!(get_dataset, change_dataset, delete_dataset))
        .routes(routes!(get_dataset_file))
}

/// Summary of a data set.
#[derive(Debug, Serialize, ToSchema)]
pub(in crate::api) struct DatasetView {
    id: Uuid,
    /// Job that made the data set.
    job_id: Uuid,
    /// State of the job: always `done`. Before, this address answers 404 with `not_ready`, or with the reason
    /// why there is no data set.
    state: &'static str,
    /// Name of the footage of the first library.
    name: String,
    /// Whether its first library was made from the sample of an empty data folder.
    sample: bool,
    /// Whether it stays even if nobody uses it.
    pinned: bool,
    /// Time of the last use, exact to the hour, RFC 3339 in UTC.
    used_at: String,
    /// Size of all files, bytes.
    size_bytes: i64,
    /// Time of creation, RFC 3339 in UTC.
    created_at: String,
    /// All parameters of the data set, including defaults.
    #[schema(value_type = Params)]
    params: Value,
    #[serde(flatten)]
    summary: Summary,
    /// Files that can be downloaded, by name. Only in the response for one data set.
    #[serde(skip_serializing_if = "Option::is_none")]
    files: Option<Vec<FileView>>,
}

/// List all data sets, newest first.
///
/// `footage_id`, `library_id` and `q` find the data sets of which any library fits.
#[utoipa::path(get, path = "/v1/datasets", params(FilmQuery), responses(
    (status = 200, body = Page<DatasetView>),
    (status = "4XX", body = ProblemBody, content_type = "application/problem+json"),
))]
pub(in crate::api) async fn list_datasets(
    access: Access,
    query: Filtered<FilmQuery>,
) -> JsonAnswer<Page<DatasetView>> {
    access.list(query.0).await
}

/// Get one data set: a summary, its parameters and its files.
///
/// Fails with `not_ready` if its job has not ended, and with the code of the job if that failed or was
/// cancelled. The status is 404 in all these cases. The message names the job and its state.
#[utoipa::path(get, path = "/v1/datasets/{id}", params(("id" = Uuid, Path)), responses(
    (status = 200, body = DatasetView),
    (status = "4XX", body = ProblemBody, content_type = "application/problem+json"),
))]
pub(in crate::api) async fn get_dataset(access: Access, Id(id): Id) -> JsonAnswer<DatasetView> {
    whole(&access, access.get_result(id).await?).await
}

/// Pin a data set, or unpin it.
///
/// A pinned data set stays even if nobody uses it, and so does everything that it was made from.
#[utoipa::path(patch, path = "/v1/datasets/{id}", params(("id" = Uuid, Path)), request_body = ResultChange,
    responses(
    (status = 200, body = DatasetView),
    (status = "4XX", body = ProblemBody, content_type = "application/problem+json"),
    (status = "5XX", body = ProblemBody, content_type = "application/problem+json"),
))]
pub(in crate::api) async fn change_dataset(
    access: Access,
    Id(id): Id,
    Json(change): Json<ResultChange>,
) -> JsonAnswer<DatasetView> {
    let changed = access.change_result(id, &change.properties()).await?;
    whole(&access, changed).await
}

/// Delete a data set and its job.
///
/// A data set that is not finished is deleted too, with the flocks that its job has kept. A running job is stopped.
#[utoipa::path(delete, path = "/v1/datasets/{id}", params(("id" = Uuid, Path)), responses(
    (status = 204, description = "deleted"),
    (status = "4XX", body = ProblemBody, content_type = "application/problem+json"),
))]
pub(in crate::api) async fn delete_dataset(
    access: Access,
    Id(id): Id,
) -> Result<StatusCode, Problem> {
    let job = access.store().job_of_result(id, &access.caller.owners);
    if !job.await?.is_some_and(|job| job.kind == Kind::Dataset) {
        return Err(Problem::not_found());
    }
    access.store().delete(ResourceKind::Dataset, id).await?;
    Ok(StatusCode::NO_CONTENT)
}

/// Download a file of a data set.
///
/// - `dataset.zip`: pictures, labels, manifest and README, for training
/// - `manifest.json`: what the data set was made from, what each flock shows, and the SHA-256 of every file
/// - `README.md`: data card, which says what the data set shows and what the labels mean
/// - `sheet.jpg`: nine samples with the labels drawn over them
///
/// Range and conditional requests are supported, so an interrupted download can go on.
#[utoipa::path(get, path = "/v1/datasets/{id}/{file}",
    params(("id" = Uuid, Path), ("file" = String, Path)), responses(
    (status = 200, description = "the file"),
    (status = 206, description = "the requested range of the file"),
    (status = 304, description = "not modified"),
    (status = "4XX", body = ProblemBody, content_type = "application/problem+json"),
))]
pub(in crate::api) async fn get_dataset_file(
    access: Access,
    FileOf(id, name): FileOf,
    conditions: Conditions,
) -> Answer {
    let (name, media_type) = find_file(FILES, &name)?;
    let row = access.find::<Dataset>(id).await?;
    access.note_use::<Dataset>(&row);
    let label = format!("{}_{name}", stem(&row.name));
    let sent = Sent {
        pieces: pieces(access.store(), &row, name).await?,
        media_type,
        disposition: saved_as(media_type, &label),
    };
    sent.answer(access.store(), &conditions).await
}

/// Returns the stored files whose bytes are those of a file, in order. The last one of the archive has the checksums of all
/// others, so that its hash tells archives apart.
async fn pieces(store: &Store, row: &FilmRow, name: &str) -> Result<Vec<Piece>, Problem> {
    let (mut pieces, mut last) = (Vec::new(), name);
    if name == ARCHIVE {
        let parts = store.files_of_parts(row.job_id, PIECE).await?;
        pieces.extend(parts.into_iter().map(Piece::from));
        last = PIECE;
    }
    let last = store.blob(&row.folder, last).await?;
    let last = last.ok_or_else(Problem::not_found)?;
    pieces.push(Piece::from((row.folder.clone(), last)));
    Ok(pieces)
}

/// Adds the archive to the files of a data set.
async fn whole(
    access: &Access,
    axum::Json(mut view): axum::Json<DatasetView>,
) -> JsonAnswer<DatasetView> {
    let row = access.find::<Dataset>(view.id).await?;
    let pieces = pieces(access.store(), &row, ARCHIVE).await?;
    let n_bytes = pieces.iter().map(|piece| piece.file.size_bytes).sum();
    let archive = FileView::new(FILES[0], n_bytes);
    view.files.get_or_insert_default().insert(0, archive);
    Ok(axum::Json(view))
}

impl View for DatasetView {
    type Stored = Dataset;

    fn id(&self) -> Uuid {
        self.id
    }

    fn from_row(row: FilmRow) -> Result<DatasetView, Problem> {
        Ok(DatasetView {
            id: row.id,
            job_id: row.job_id,
            state: JobState::Done.name(),
            name: row.name,
            sample: row.sample,
            pinned: row.pinned,
            used_at: rfc3339(row.used_ms),
            size_bytes: row.size_bytes,
            created_at: rfc3339(row.created_ms),
            params: crate::api::stored(&row.params)?,
            summary: crate::api::stored(&row.summary)?,
            files: None,
        })
    }
}

impl ResultView for DatasetView {
    const FILES: Files = FILES;

    fn folders(row: &FilmRow) -> Vec<&str> {
        vec![&row.folder]
    }

    fn with_files(self, files: Vec<FileView>) -> DatasetView {
        DatasetView {
            files: Some(files),
            ..self
        }
    }
}
