//! Footage: uploaded videos (docs/explanation/promises.md, "Names are labels" and "Bad input").
//!
//! A refused upload leaves no files. The original video is sent only as an attachment, so a browser never
//! interprets it (docs/explanation/promises.md, "Nothing served runs as a page").

use axum::extract::Request;
use axum::http::{StatusCode, header};
use axum::response::IntoResponse;
use serde::{Deserialize, Serialize};
use utoipa::{IntoParams, ToSchema};
use uuid::Uuid;

use super::AppState;
use super::download::names::{saved_as, stem};
use super::download::{Download, disposition};
use super::extract::{Access, Conditions, Id, Json, Query, given};
use super::paging::{Filtered, FootageQuery, Page};
use super::problem::{Answer, JsonAnswer, Problem, ProblemBody};
use super::receive::{Form, label, receive, receive_with_json};
use super::resources::View;
use super::timestamp::rfc3339;
use crate::jobs::admit::ReceivedFiles;
use crate::jobs::{Error, admit};
use crate::store::blobs::hex;
use crate::store::footage::{Added, Footage, POSTER, VIDEO};
use crate::store::resources::Property;
use flockreel_core::code::Code;

/// An uploaded video.
#[derive(Clone, Debug, Serialize, ToSchema)]
pub(super) struct FootageView {
    id: Uuid,
    /// Name given by the sender; may be empty.
    name: String,
    /// SHA-256 of the video file, hexadecimal.
    sha256: String,
    /// Size of the video, the background, the masks and the poster together, bytes.
    size_bytes: i64,
    /// Width and height of the picture, square pixels.
    image_size_px: [i64; 2],
    /// Frame rate, frames per second.
    fps: f64,
    /// Estimated number of frames. An analysis counts them exactly.
    n_frames_hint: i64,
    /// Whether a picture of the scene without the animal was uploaded with it.
    has_background: bool,
    /// Whether masks of the animal were uploaded with it.
    has_masks: bool,
    /// Whether the program itself made this footage, as the sample of an empty data folder.
    sample: bool,
    /// Whether it stays even if nobody uses it.
    pinned: bool,
    /// Time of the last use, exact to the hour, RFC 3339 in UTC.
    used_at: String,
    /// Time of the upload, RFC 3339 in UTC.
    created_at: String,
}

/// New properties of footage. Those that are left out stay as they are.
#[derive(Debug, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
#[schema(min_properties = 1)]
pub(super) struct FootageChange {
    /// Name for people; may be empty.
    #[serde(default, deserialize_with = "given")]
    #[schema(value_type = String, required = false)]
    name: Option<String>,
    /// Whether it stays even if nobody uses it.
    #[serde(default, deserialize_with = "given")]
    #[schema(value_type = bool, required = false)]
    pinned: Option<bool>,
}

/// Query parameters of an upload.
#[derive(Debug, Deserialize, IntoParams)]
#[into_params(parameter_in = Query)]
pub(super) struct Naming {
    /// Name of the footage, for people. Default: the file name in the form; empty for a raw body.
    pub(super) name: Option<String>,
}

/// The form of a multipart upload.
#[derive(ToSchema)]
#[expect(
    dead_code,
    reason = "it only describes the form in the OpenAPI document"
)]
pub(super) struct FootageForm {
    /// Video, zip of numbered pictures, or TIFF of several pages. The field may also be called `footage`.
    #[schema(value_type = String, format = Binary)]
    video: Vec<u8>,
    /// Picture of the scene without the animal, of the same width and height as the video.
    #[schema(value_type = Option<String>, format = Binary)]
    background: Option<Vec<u8>>,
    /// One mask per frame, as a gray video, a zip of pictures or a TIFF. White is the animal, black the rest.
    /// Gray is the share of the pixel that the animal covers.
    #[schema(value_type = Option<String>, format = Binary)]
    masks: Option<Vec<u8>>,
}

/// Upload footage.
///
/// The body is the file itself, or a form with `video` and optional `background` and `masks`. The file is a
/// video, a zip of numbered pictures, or a TIFF of several pages. Without masks, its alpha channel serves as
/// masks.
///
/// If the same files are stored already, the response is 200 with the existing footage. A file that cannot be
/// used is refused with a code such as `not_a_video`, `too_long` or `masks_differ`. Large files on slow
/// networks are better sent with `/v1/uploads`.
#[utoipa::path(post, path = "/v1/footage", params(Naming),
    request_body(content(([u8] = "application/octet-stream"), (FootageForm = "multipart/form-data"))),
    responses(
        (status = 201, body = FootageView, headers(("location" = String))),
        (status = 200, body = FootageView, description = "the owner has already stored the same file"),
        (status = "4XX", body = ProblemBody, content_type = "application/problem+json"),
        (status = "5XX", body = ProblemBody, content_type = "application/problem+json"),
    ))]
pub(super) async fn create_footage(
    access: Access,
    Query(naming): Query<Naming>,
    request: Request,
) -> Answer {
    let received = receive(
        &access.state,
        request,
        naming.name,
        access.caller.account.owner,
    )
    .await?;
    stored(&access.state, received).await
}

/// The form of a variant.
#[derive(ToSchema)]
#[expect(
    dead_code,
    reason = "it only describes the form in the OpenAPI document"
)]
pub(super) struct VariantForm {
    /// Picture of the scene without the animal, of the same width and height as the video.
    #[schema(value_type = Option<String>, format = Binary)]
    background: Option<Vec<u8>>,
    /// One mask per frame, as for an upload.
    #[schema(value_type = Option<String>, format = Binary)]
    masks: Option<Vec<u8>>,
}

/// Add a background or masks to stored footage.
///
/// The result is new footage with the same video and the files of the form, and no others. It counts as a copy. If
/// such footage is stored already, the response is 200 with it. Files that do not fit the video are refused with
/// `background_size_differs` or `masks_differ`.
#[utoipa::path(post, path = "/v1/footage/{id}/variants", params(("id" = Uuid, Path)),
    request_body(content((VariantForm = "multipart/form-data"))),
    responses(
        (status = 201, body = FootageView, headers(("location" = String))),
        (status = 200, body = FootageView, description = "the owner has already stored the same files"),
        (status = "4XX", body = ProblemBody, content_type = "application/problem+json"),
        (status = "5XX", body = ProblemBody, content_type = "application/problem+json"),
    ))]
pub(super) async fn create_variant(access: Access, Id(id): Id, request: Request) -> Answer {
    let film = access.find::<Footage>(id).await?;
    let form = Form {
        name: Some(film.name.clone()),
        owner: access.caller.account.owner.clone(),
        json_fields: &[],
        film: Some(film),
    };
    let (received, _no_fields) = receive_with_json(&access.state, request, form).await?;
    stored(&access.state, received).await
}

/// Stores an upload. The response is the new footage, or the existing one with the same files.
async fn stored(state: &AppState, received: ReceivedFiles) -> Answer {
    let (status, footage) = match admit(state, received).await? {
        Added::New(footage) => (StatusCode::CREATED, footage),
        Added::Known(footage) => (StatusCode::OK, footage),
    };
    let location = [(header::LOCATION, format!("/v1/footage/{}", footage.id))];
    let view = FootageView::from_row(footage)?;
    Ok((status, location, axum::Json(view)).into_response())
}

/// Checks an upload and stores it as footage. It runs in its own task, so a client that disconnects cannot
/// interrupt it halfway.
pub(super) async fn admit(state: &AppState, received: ReceivedFiles) -> Result<Added, Problem> {
    let context = state.context.clone();
    let admitted = tokio::spawn(async move { admit::admit(&context, received).await });
    Ok(admitted.await.unwrap_or(Err(Error::Panicked))?)
}

/// List all footage, newest first.
#[utoipa::path(get, path = "/v1/footage", params(FootageQuery), responses(
    (status = 200, body = Page<FootageView>),
    (status = "4XX", body = ProblemBody, content_type = "application/problem+json"),
))]
pub(super) async fn list_footage(
    access: Access,
    query: Filtered<FootageQuery>,
) -> JsonAnswer<Page<FootageView>> {
    access.list(query.0).await
}

/// Get one footage.
#[utoipa::path(get, path = "/v1/footage/{id}", params(("id" = Uuid, Path)), responses(
    (status = 200, body = FootageView),
    (status = "4XX", body = ProblemBody, content_type = "application/problem+json"),
))]
pub(super) async fn get_footage(access: Access, Id(id): Id) -> JsonAnswer<FootageView> {
    access.get(id).await
}

/// Rename or pin footage.
///
/// Pinned footage stays even if nobody uses it. The libraries, flocks and virtual fish made from it show the new name too. Like the name of an upload, it is
/// cut to 200 characters and loses folders and control characters.
#[utoipa::path(patch, path = "/v1/footage/{id}", params(("id" = Uuid, Path)), request_body = FootageChange,
    responses(
    (status = 200, body = FootageView),
    (status = "4XX", body = ProblemBody, content_type = "application/problem+json"),
    (status = "5XX", body = ProblemBody, content_type = "application/problem+json"),
))]
pub(super) async fn change_footage(
    access: Access,
    Id(id): Id,
    Json(change): Json<FootageChange>,
) -> JsonAnswer<FootageView> {
    let name = change.name.as_deref().map(label);
    let name = name.as_deref().map(Property::Name);
    let pinned = change.pinned.map(Property::Pinned);
    let properties: Vec<_> = name.into_iter().chain(pinned).collect();
    if properties.is_empty() {
        let sentence = "the change must have a name or pinned";
        return Err(Problem::new(Code::InvalidParams, sentence));
    }
    access.change::<Footage>(id, &properties).await?;
    access.get(id).await
}

/// Delete footage and everything made from it.
///
/// Its libraries, flocks, virtual fish and jobs are deleted too. Running jobs are stopped.
#[utoipa::path(delete, path = "/v1/footage/{id}", params(("id" = Uuid, Path)), responses(
    (status = 204, description = "deleted"),
    (status = "4XX", body = ProblemBody, content_type = "application/problem+json"),
))]
pub(super) async fn delete_footage(access: Access, Id(id): Id) -> Result<StatusCode, Problem> {
    access.delete::<Footage>(id).await
}

/// Download the uploaded video.
///
/// It is always sent as an attachment. Range and conditional requests are supported.
#[utoipa::path(get, path = "/v1/footage/{id}/file", params(("id" = Uuid, Path)), responses(
    (status = 200, content_type = "application/octet-stream"),
    (status = 206, content_type = "application/octet-stream"),
    (status = 304, description = "not modified"),
    (status = "4XX", body = ProblemBody, content_type = "application/problem+json"),
))]
pub(super) async fn get_footage_file(access: Access, Id(id): Id, conditions: Conditions) -> Answer {
    let footage = access.find::<Footage>(id).await?;
    access.note_use::<Footage>(&footage);
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
    download.answer(access.store(), &conditions).await
}

/// Get a frame of the video as a picture.
///
/// It is a JPEG; no side is longer than 640 pixels. Fails with `not_found` for footage that was uploaded to a
/// version without posters.
#[utoipa::path(get, path = "/v1/footage/{id}/poster.jpg", params(("id" = Uuid, Path)), responses(
    (status = 200, content_type = "image/jpeg"),
    (status = 206, content_type = "image/jpeg"),
    (status = 304, description = "not modified"),
    (status = "4XX", body = ProblemBody, content_type = "application/problem+json"),
))]
pub(super) async fn get_footage_poster(
    access: Access,
    Id(id): Id,
    conditions: Conditions,
) -> Answer {
    let footage = access.find::<Footage>(id).await?;
    let download = Download {
        folder: &footage.folder,
        name: POSTER,
        media_type: "image/jpeg",
        disposition: saved_as("image/jpeg", &format!("{}_{POSTER}", stem(&footage.name))),
    };
    download.answer(access.store(), &conditions).await
}

impl View for FootageView {
    type Stored = Footage;

    fn id(&self) -> Uuid {
        self.id
    }

    fn from_row(footage: Footage) -> Result<FootageView, Problem> {
        Ok(FootageView {
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
            pinned: footage.pinned,
            used_at: rfc3339(footage.used_ms),
            created_at: rfc3339(footage.created_ms),
        })
    }
}
