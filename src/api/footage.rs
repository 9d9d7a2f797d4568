//! Footage: uploaded videos (RELIABILITY.md, store rules: upload; S4, S5). What is refused leaves
//! nothing behind; the original is given back only as a file to keep.

use axum::body::Body;
use axum::extract::{Query, Request, State};
use axum::http::{Response, StatusCode, header};
use axum::response::IntoResponse;
use serde::{Deserialize, Serialize};
use utoipa::{IntoParams, ToSchema};
use uuid::Uuid;

use super::AppState;
use super::access::Caller;
use super::download::{Download, disposition};
use super::extract::{Conditions, Id};
use super::jobs::absent_result;
use super::paging::{Page, Paging};
use super::problem::{Problem, ProblemBody, gone};
use super::receive::receive;
use super::timestamp::rfc3339;
use crate::jobs::admit::Arrival;
use crate::jobs::{Error, admit};
use crate::store::blobs::hex;
use crate::store::footage::{Added, Footage, VIDEO};

/// An uploaded video.
#[derive(Clone, Debug, Serialize, ToSchema)]
pub(super) struct FootageView {
    id: Uuid,
    /// What the sender called it.
    name: String,
    /// SHA-256 of the video, hexadecimal.
    sha256: String,
    size_bytes: i64,
    /// Width and height, square pixels.
    image_size_px: [i64; 2],
    /// Frames a second.
    fps: f64,
    /// How many frames there seem to be.
    n_frames_hint: i64,
    /// Whether a picture of the empty scene came with it.
    has_background: bool,
    /// Whether masks came with it that say which of it is the animal.
    has_masks: bool,
    /// Made by the program itself.
    sample: bool,
    created_at: String,
}

/// What is said of a raw upload.
#[derive(Debug, Deserialize, IntoParams)]
#[into_params(parameter_in = Query)]
pub(super) struct Naming {
    /// What to call it: a label for people.
    pub(super) name: Option<String>,
}

/// The form of a multipart upload.
#[derive(ToSchema)]
#[expect(
    dead_code,
    reason = "it only describes the form in the OpenAPI document"
)]
pub(super) struct FootageForm {
    #[schema(value_type = String, format = Binary)]
    video: Vec<u8>,
    #[schema(value_type = Option<String>, format = Binary)]
    background: Option<Vec<u8>>,
    /// A mask for each frame: a gray video, a zip of pictures or a TIFF, white where the animal is; soft values count in
    /// part.
    #[schema(value_type = Option<String>, format = Binary)]
    masks: Option<Vec<u8>>,
}

/// Upload a video, a zip of numbered pictures or a TIFF of several pages: as the raw body, or as a form with `video`
/// and, if there are such, `background` and `masks`. The alpha channel of a footage is taken for its masks.
#[utoipa::path(post, path = "/v1/footage", params(Naming),
    request_body(content(([u8] = "application/octet-stream"), (FootageForm = "multipart/form-data"))),
    responses(
        (status = 201, body = FootageView, headers(("location" = String))),
        (status = 200, body = FootageView, description = "the same bytes were there already"),
        (status = "4XX", body = ProblemBody, content_type = "application/problem+json"),
        (status = "5XX", body = ProblemBody, content_type = "application/problem+json"),
    ))]
pub(super) async fn create_footage(
    State(state): State<AppState>,
    caller: Caller,
    Query(naming): Query<Naming>,
    request: Request,
) -> Result<Response<Body>, Problem> {
    let arrival = receive(&state, request, naming.name, caller.account.owner).await?;
    let (status, footage) = match admit(&state, arrival).await? {
        Added::New(footage) => (StatusCode::CREATED, footage),
        Added::Known(footage) => (StatusCode::OK, footage),
    };
    let location = [(header::LOCATION, format!("/v1/footage/{}", footage.id))];
    Ok((status, location, axum::Json(FootageView::of(footage))).into_response())
}

/// In a task of its own, so that a sender who hangs up now leaves no half of it behind.
pub(super) async fn admit(state: &AppState, arrival: Arrival) -> Result<Added, Problem> {
    let context = state.context.clone();
    let admitted = tokio::spawn(async move { admit::admit(&context, arrival).await });
    Ok(admitted.await.unwrap_or(Err(Error::Panicked))?)
}

/// Every footage, newest first.
#[utoipa::path(get, path = "/v1/footage", params(Paging), responses(
    (status = 200, body = Page<FootageView>),
    (status = "4XX", body = ProblemBody, content_type = "application/problem+json"),
))]
pub(super) async fn list_footage(
    State(state): State<AppState>,
    caller: Caller,
    paging: Paging,
) -> Result<axum::Json<Page<FootageView>>, Problem> {
    let store = &state.context.store;
    let rows = store
        .list_footage(paging.limit + 1, paging.cursor, &caller.reach)
        .await?;
    Page::of(rows, paging, |row| row.id, |row| Ok(FootageView::of(row)))
}

/// One footage.
#[utoipa::path(get, path = "/v1/footage/{id}", params(("id" = Uuid, Path)), responses(
    (status = 200, body = FootageView),
    (status = "4XX", body = ProblemBody, content_type = "application/problem+json"),
))]
pub(super) async fn get_footage(
    State(state): State<AppState>,
    caller: Caller,
    Id(id): Id,
) -> Result<axum::Json<FootageView>, Problem> {
    Ok(axum::Json(FootageView::of(
        find(&state, &caller, id).await?,
    )))
}

/// Delete a footage with all that came of it: libraries, flocks, virtual fish and jobs.
#[utoipa::path(delete, path = "/v1/footage/{id}", params(("id" = Uuid, Path)), responses(
    (status = 204, description = "it is gone"),
    (status = "4XX", body = ProblemBody, content_type = "application/problem+json"),
))]
pub(super) async fn delete_footage(
    State(state): State<AppState>,
    caller: Caller,
    Id(id): Id,
) -> Result<StatusCode, Problem> {
    find(&state, &caller, id).await?;
    gone(state.context.store.delete_footage(id).await?)
}

/// The video as it was uploaded, to keep: never shown in place.
#[utoipa::path(get, path = "/v1/footage/{id}/file", params(("id" = Uuid, Path)), responses(
    (status = 200, content_type = "application/octet-stream"),
    (status = 206, content_type = "application/octet-stream"),
    (status = 304, description = "the client has it already"),
    (status = "4XX", body = ProblemBody, content_type = "application/problem+json"),
))]
pub(super) async fn get_footage_file(
    State(state): State<AppState>,
    caller: Caller,
    Id(id): Id,
    conditions: Conditions,
) -> Result<Response<Body>, Problem> {
    let footage = find(&state, &caller, id).await?;
    let label = match footage.name.as_str() {
        "" => "footage",
        name => name,
    };
    let download = Download {
        folder: &footage.folder,
        name: VIDEO,
        media_type: "application/octet-stream",
        disposition: disposition("attachment", label),
    };
    download.answer(&state.context.store, &conditions).await
}

pub(super) async fn find(state: &AppState, caller: &Caller, id: Uuid) -> Result<Footage, Problem> {
    match state.context.store.footage(id, &caller.reach).await? {
        Some(footage) => Ok(footage),
        None => Err(absent_result(state, caller, id).await?),
    }
}

impl FootageView {
    fn of(footage: Footage) -> FootageView {
        FootageView {
            id: footage.id,
            sha256: hex(&footage.sha256),
            name: footage.name,
            size_bytes: footage.size_bytes,
            image_size_px: [footage.width, footage.height],
            fps: footage.fps,
            n_frames_hint: footage.n_frames_hint,
            has_background: !footage.background_sha256.is_empty(),
            has_masks: !footage.masks_sha256.is_empty(),
            sample: footage.sample,
            created_at: rfc3339(footage.created_ms),
        }
    }
}
