//! Request bodies to disk: the same code receives raw bodies and the fields of forms
//! (docs/explanation/promises.md, "Size limits").
//!
//! Files go to a draft folder and are hashed and synced on the way. Every file has a size limit. The space of the owner
//! and of the disk is checked before and during the transfer.

use std::collections::BTreeMap;
use std::time::Duration;

use axum::extract::multipart::{Field, MultipartError};
use axum::extract::{DefaultBodyLimit, FromRequest, Multipart, Request};
use axum::http::{HeaderMap, header};
use bytes::Bytes;
use futures_util::{Stream, StreamExt};
use serde_json::{Map, Value};
use tokio::time::timeout;

use super::server::is_too_slow;
use super::{AppState, MAX_JSON_BYTES, Problem};
use crate::jobs::admit::ReceivedFiles;
use crate::store;
use crate::store::footage::{BACKGROUND, Footage, MASKS, VIDEO};
use crate::store::intake::Intake;
use crate::store::owners::Owner;
use crate::store::space::{Announced, Counted};
use crate::store::{BlobFile, Draft};
use flockreel_core::code::Code;

/// Longest wait for the next chunk of a body (docs/explanation/promises.md, "Slow clients"). Free choice.
pub(super) const CHUNK_TIMEOUT: Duration = Duration::from_secs(30);
/// Number of bytes after which the space is checked again. Other requests fill the disk too,
/// and a body need not declare its length. Free choice.
pub(super) const CHECK_EVERY_BYTES: u64 = 8 << 20;
/// Prefixes of the media types of bodies that are footage, or a form with footage.
const FILM_TYPES: [&str; 5] = [
    "multipart/",
    "video/",
    "application/octet-stream",
    "application/zip",
    "image/", // TIFF, and animated GIF, PNG and WebP
];
/// Largest background picture, bytes. Free choice.
const MAX_BACKGROUND_BYTES: u64 = 64 << 20;

/// JSON objects of a form, by field name. A form may hold them beside its files.
pub(super) type JsonFields = BTreeMap<&'static str, Map<String, Value>>;

/// Label and owner of received footage, and the JSON fields that its form may hold.
pub(super) struct Form {
    /// Label of the footage. If it is `None`, the file name in the form is used.
    pub name: Option<String>,
    /// Owner of the footage.
    pub owner: Owner,
    /// Names of the JSON fields.
    pub json_fields: &'static [&'static str],
    /// Stored footage whose video takes the place of one in the form.
    pub film: Option<Footage>,
}

/// Receives footage as a raw body, or as a form with `video` and optional `background` and `masks`. `name` is
/// the label of the footage; if it is `None`, the file name in the form is used.
pub(super) async fn receive(
    state: &AppState,
    request: Request,
    name: Option<String>,
    owner: Owner,
) -> Result<ReceivedFiles, Problem> {
    let form = Form {
        name,
        owner,
        json_fields: &[],
        film: None,
    };
    let (received, _no_fields) = receive_with_json(state, request, form).await?;
    Ok(received)
}

/// Like [`receive`], but a form may also hold JSON fields.
pub(super) async fn receive_with_json(
    state: &AppState,
    request: Request,
    form: Form,
) -> Result<(ReceivedFiles, JsonFields), Problem> {
    check_headers(&request, state.config.max_upload_bytes)?;
    let store = &state.context.store;
    let n_bytes = body_bytes(&request).unwrap_or(0);
    let mut announced = store.announce(&form.owner, n_bytes).await?;
    let draft_name = uuid::Uuid::now_v7().to_string();
    let draft = store.blobs().draft(&draft_name);
    let draft = draft.map_err(store::Error::Io)?;
    if is_form(&request) {
        return receive_form(state, request, draft, form, announced).await;
    }
    if form.film.is_some() {
        return Err(Code::UnsupportedMediaType.into());
    }
    let body = request.into_body().into_data_stream();
    let limit_bytes = state.config.max_upload_bytes;
    let intake = Intake::create(&draft, VIDEO, limit_bytes).await?;
    let video = receive_file(&mut announced, body, intake).await?;
    let received = ReceivedFiles {
        draft,
        video,
        background: None,
        masks: None,
        name: label(form.name.as_deref().unwrap_or_default()),
        owner: form.owner,
        counted: Counted::Body(announced),
    };
    Ok((received, JsonFields::new()))
}

async fn receive_form(
    state: &AppState,
    mut request: Request,
    draft: Draft,
    form: Form,
    mut announced: Announced,
) -> Result<(ReceivedFiles, JsonFields), Problem> {
    // Every field has its own limit.
    DefaultBodyLimit::disable().apply(&mut request);
    let malformed = |sentence: &str| Problem::new(Code::MalformedRequest, sentence);
    let mut body = Multipart::from_request(request, state)
        .await
        .map_err(|rejection| malformed(&rejection.body_text()))?;
    let limit_bytes = state.config.max_upload_bytes;
    let (mut video, mut background, mut masks, mut file_name) = (None, None, None, None);
    let mut json_fields = JsonFields::new();
    while let Some(field) = next_field(&mut body).await? {
        match field.name() {
            Some("video" | "footage") if video.is_none() && form.film.is_none() => {
                file_name = field.file_name().map(str::to_owned);
                let intake = Intake::create(&draft, VIDEO, limit_bytes).await?;
                video = Some(receive_file(&mut announced, field, intake).await?);
            }
            Some("background") if background.is_none() => {
                let intake = Intake::create(&draft, BACKGROUND, MAX_BACKGROUND_BYTES).await?;
                background = Some(receive_file(&mut announced, field, intake).await?);
            }
            Some("masks") if masks.is_none() => {
                let intake = Intake::create(&draft, MASKS, limit_bytes).await?;
                masks = Some(receive_file(&mut announced, field, intake).await?);
            }
            name => {
                let known = form.json_fields.iter().find(|known| name == Some(known));
                let new = known.filter(|known| !json_fields.contains_key(*known));
                let new =
                    new.ok_or_else(|| malformed("the form has an unknown or repeated field"))?;
                json_fields.insert(*new, receive_json(field).await?);
            }
        }
    }
    if let Some(film) = &form.film {
        video = Some(copy_video(state, film, &draft, &mut announced).await?);
    }
    let received = ReceivedFiles {
        draft,
        video: video
            .ok_or_else(|| malformed("the form lacks a video: name its field video or footage"))?,
        background,
        masks,
        name: label(&form.name.or(file_name).unwrap_or_default()),
        owner: form.owner,
        counted: Counted::Body(announced),
    };
    Ok((received, json_fields))
}

/// Copies the video of stored footage into a draft.
async fn copy_video(
    state: &AppState,
    film: &Footage,
    draft: &Draft,
    announced: &mut Announced,
) -> Result<BlobFile, Problem> {
    let store = &state.context.store;
    let video = store.blob(&film.folder, VIDEO).await?;
    let video = video.ok_or_else(Problem::not_found)?;
    announced.receive(video.size_bytes.unsigned_abs()).await?;
    let file = tokio::fs::File::create_new(draft.path().join(VIDEO)).await;
    let mut file = file.map_err(store::Error::Io)?;
    if !store.blobs().copy(&video, &film.folder, &mut file).await? {
        let path = format!("{}/{VIDEO}", film.folder);
        return Err(store::Error::CorruptFile(path).into());
    }
    file.sync_all().await.map_err(store::Error::Io)?;
    Ok(video)
}

/// Reads a JSON field of a form, at most [`MAX_JSON_BYTES`] long.
async fn receive_json(mut field: Field<'_>) -> Result<Map<String, Value>, Problem> {
    let mut text = Vec::new();
    loop {
        let chunk = timeout(CHUNK_TIMEOUT, field.chunk())
            .await
            .map_err(|_elapsed| Code::BodyTimeout)?;
        let Some(bytes) = chunk.map_err(|error| from_multipart(&error))? else {
            break;
        };
        text.extend_from_slice(&bytes);
        if text.len() > MAX_JSON_BYTES {
            return Err(Code::TooLarge.into());
        }
    }
    serde_json::from_slice(&text)
        .map_err(|error| Problem::new(Code::InvalidParams, error.to_string()))
}

async fn next_field(form: &mut Multipart) -> Result<Option<Field<'_>>, Problem> {
    match timeout(CHUNK_TIMEOUT, form.next_field()).await {
        Ok(field) => field.map_err(|error| from_multipart(&error)),
        Err(_) => Err(Code::BodyTimeout.into()),
    }
}

/// Writes a stream to a file. Returns its size and hash. Fails if the stream exceeds the limit of the file,
/// stalls or is cut off, or if there is no space for it.
async fn receive_file<S, E>(
    announced: &mut Announced,
    mut stream: S,
    mut intake: Intake,
) -> Result<BlobFile, Problem>
where
    S: Stream<Item = Result<Bytes, E>> + Unpin,
    E: std::error::Error,
{
    match write_stream(announced, &mut stream, &mut intake).await {
        Ok(()) => Ok(intake.finish().await?),
        Err(problem) => {
            intake.give_up().await;
            Err(problem)
        }
    }
}

async fn write_stream<S, E>(
    announced: &mut Announced,
    stream: &mut S,
    intake: &mut Intake,
) -> Result<(), Problem>
where
    S: Stream<Item = Result<Bytes, E>> + Unpin,
    E: std::error::Error,
{
    let mut n_unchecked = 0;
    loop {
        match timeout(CHUNK_TIMEOUT, stream.next()).await {
            Ok(Some(Ok(bytes))) => {
                n_unchecked += bytes.len() as u64;
                if n_unchecked >= CHECK_EVERY_BYTES {
                    announced.receive(n_unchecked).await?;
                    n_unchecked = 0;
                }
                intake.take(bytes).await?;
            }
            Ok(Some(Err(error))) => {
                tracing::debug!(%error, "a body was cut off");
                return Err(code_of_broken_body(&error).into());
            }
            Ok(None) => return Ok(announced.receive(n_unchecked).await?),
            Err(_) => return Err(Code::BodyTimeout.into()),
        }
    }
}

/// Refuses a body whose declared length exceeds the limit, before it is read.
fn check_headers(request: &Request, limit_bytes: u64) -> Result<(), Problem> {
    let max_bytes = if is_form(request) {
        // A form may also hold masks, a background, JSON fields, and the boundaries between them.
        limit_bytes
            .saturating_mul(2)
            .saturating_add(MAX_BACKGROUND_BYTES + (4 << 20))
    } else {
        limit_bytes
    };
    if body_bytes(request).is_some_and(|bytes| bytes > max_bytes) {
        return Err(store::Error::TooLarge { limit_bytes }.into());
    }
    Ok(())
}

/// Returns the declared length of the body, bytes; `None` if there is none.
fn body_bytes(request: &Request) -> Option<u64> {
    let length = request.headers().get(header::CONTENT_LENGTH)?;
    length.to_str().ok()?.parse().ok()
}

/// Returns whether the media type of the body is that of footage or of a form, not of JSON.
pub(super) fn is_film(request: &Request) -> bool {
    let media_type = media_type(request.headers());
    FILM_TYPES.iter().any(|film| media_type.starts_with(film))
}

fn is_form(request: &Request) -> bool {
    media_type(request.headers()).starts_with("multipart/")
}

/// Returns the media type of the body, in lower case; empty if there is none.
pub(super) fn media_type(headers: &HeaderMap) -> String {
    let media_type = headers.get(header::CONTENT_TYPE);
    let media_type = media_type.and_then(|value| value.to_str().ok());
    media_type.unwrap_or_default().to_ascii_lowercase()
}

/// Returns the code for a body that ended early: `body_timeout` or `body_cut_off`.
pub(super) fn code_of_broken_body(error: &dyn std::error::Error) -> Code {
    if is_too_slow(error) {
        Code::BodyTimeout
    } else {
        Code::BodyCutOff
    }
}

fn from_multipart(error: &MultipartError) -> Problem {
    if is_too_slow(error) {
        return Code::BodyTimeout.into();
    }
    Problem::new(Code::MalformedRequest, error.body_text())
}

/// Returns a file name as a label: its last path component, without control characters and without characters
/// that change the direction of text, at most 200 characters
/// (docs/explanation/promises.md, "Names are labels").
pub(super) fn label(name: &str) -> String {
    let last = name.rsplit(['/', '\\']).next().unwrap_or_default();
    let changes_direction = |c: char| matches!(c, '\u{200e}'..='\u{200f}' | '\u{202a}'..='\u{202e}' | '\u{2066}'..='\u{2069}');
    let kept = last
        .chars()
        .filter(|c| !c.is_control() && !changes_direction(*c));
    kept.take(200).collect::<String>().trim().to_owned()
}

#[cfg(test)]
mod tests {
    use super::label;
    use crate::api::table;

    #[test]
    fn forms_with_footage_declare_every_file_that_is_accepted() {
        let (_, document) = table().split_for_parts();
        let document = serde_json::to_value(document).unwrap();
        for form in ["FootageForm", "AnalysisForm", "FlockForm"] {
            let fields = &document["components"]["schemas"][form]["properties"];
            for name in ["background", "masks"] {
                assert!(fields[name].is_object(), "{form} lacks {name}");
            }
        }
    }

    #[test]
    fn label_has_no_folders_and_no_control_characters() {
        assert_eq!(label("../../etc/passwd"), "passwd");
        assert_eq!(label("C:\\films\\fish.mp4"), "fish.mp4");
        assert_eq!(label("a\r\nb\0\u{202e}4pm.exe"), "ab4pm.exe");
        assert_eq!(label(&"x".repeat(300)).len(), 200);
        assert_eq!(label("<b>-i</b>"), "b>");
    }
}
