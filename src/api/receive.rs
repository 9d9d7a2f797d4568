//! Request bodies to disk: the same code receives raw bodies and the fields of forms
//! (docs/explanation/promises.md, "Size limits").
//!
//! Files go to a draft folder and are hashed and synced on the way. Every file has a size limit. The free
//! space of the disk is checked before and during the transfer.

use std::collections::BTreeMap;
use std::time::Duration;

use axum::extract::multipart::{Field, MultipartError};
use axum::extract::{DefaultBodyLimit, FromRequest, Multipart, Request};
use axum::http::header;
use bytes::Bytes;
use futures_util::{Stream, StreamExt};
use serde_json::{Map, Value};
use tokio::time::timeout;

use super::server::is_too_slow;
use super::{AppState, MAX_JSON_BYTES, Problem};
use crate::code::Code;
use crate::jobs::admit::Arrival;
use crate::store;
use crate::store::footage::{BACKGROUND, MASKS, VIDEO};
use crate::store::intake::Intake;
use crate::store::owners::Owner;
use crate::store::{BlobFile, Draft};

/// Longest wait for the next chunk of a body. Free choice.
pub(super) const PIECE: Duration = Duration::from_secs(30);
/// Number of bytes after which the free space of the disk is checked again. Other requests fill the disk too,
/// and a body need not declare its length. Free choice.
pub(super) const CHECK_EVERY_BYTES: u64 = 8 << 20;
/// Prefixes of the media types of bodies that are footage, or a form with footage.
const FILM_TYPES: [&str; 5] = [
    "multipart/",
    "video/",
    "application/octet-stream",
    "application/zip",
    "image/tiff",
];
/// Largest background picture, bytes. Free choice.
const MAX_BACKGROUND_BYTES: u64 = 64 << 20;

/// JSON objects of a form, by field name. A form may hold them beside its files.
pub(super) type Wishes = BTreeMap<&'static str, Map<String, Value>>;

/// Receives footage as a raw body, or as a form with `video` and optional `background` and `masks`. `name` is
/// the label of the footage; if it is `None`, the file name in the form is used.
pub(super) async fn receive(
    state: &AppState,
    request: Request,
    name: Option<String>,
    owner: Owner,
) -> Result<Arrival, Problem> {
    let (arrival, _no_wishes) = receive_with(state, request, (name, owner), &[]).await?;
    Ok(arrival)
}

/// Like [`receive`], but a form may also hold the JSON fields named in `wishes`.
pub(super) async fn receive_with(
    state: &AppState,
    request: Request,
    (name, owner): (Option<String>, Owner),
    wishes: &[&'static str],
) -> Result<(Arrival, Wishes), Problem> {
    check_headers(&request, state.config.max_upload_bytes)?;
    check_room(state, body_bytes(&request).unwrap_or(0))?;
    let draft_name = uuid::Uuid::now_v7().to_string();
    let draft = state.context.store.blobs().draft(&draft_name);
    let draft = draft.map_err(store::Error::Io)?;
    if is_form(&request) {
        return receive_form(state, request, draft, (name, owner), wishes).await;
    }
    let body = request.into_body().into_data_stream();
    let limit_bytes = state.config.max_upload_bytes;
    let into = (&draft, VIDEO, limit_bytes);
    let video = receive_file(state, body, into).await?;
    let arrival = Arrival {
        draft,
        video,
        background: None,
        masks: None,
        name: label(name.as_deref().unwrap_or_default()),
        owner,
    };
    Ok((arrival, Wishes::new()))
}

async fn receive_form(
    state: &AppState,
    mut request: Request,
    draft: Draft,
    (name, owner): (Option<String>, Owner),
    wishes: &[&'static str],
) -> Result<(Arrival, Wishes), Problem> {
    // Every field has its own limit.
    DefaultBodyLimit::disable().apply(&mut request);
    let malformed = |sentence: &str| Problem::new(Code::MalformedRequest, sentence);
    let mut form = Multipart::from_request(request, state)
        .await
        .map_err(|rejection| malformed(&rejection.body_text()))?;
    let (mut video, mut background, mut masks, mut file_name) = (None, None, None, None);
    let mut wished = Wishes::new();
    while let Some(field) = next_field(&mut form).await? {
        match field.name() {
            Some("video" | "footage") if video.is_none() => {
                file_name = field.file_name().map(str::to_owned);
                let limit_bytes = state.config.max_upload_bytes;
                let into = (&draft, VIDEO, limit_bytes);
                video = Some(receive_file(state, field, into).await?);
            }
            Some("background") if background.is_none() => {
                let into = (&draft, BACKGROUND, MAX_BACKGROUND_BYTES);
                background = Some(receive_file(state, field, into).await?);
            }
            Some("masks") if masks.is_none() => {
                let into = (&draft, MASKS, state.config.max_upload_bytes);
                masks = Some(receive_file(state, field, into).await?);
            }
            name => {
                let wish = wishes.iter().find(|wish| name == Some(wish));
                let wish = wish.filter(|wish| !wished.contains_key(*wish));
                let wish =
                    wish.ok_or_else(|| malformed("the form has an unknown or repeated field"))?;
                wished.insert(wish, receive_wish(field).await?);
            }
        }
    }
    let arrival = Arrival {
        draft,
        video: video.ok_or_else(|| malformed("the form lacks the field: footage"))?,
        background,
        masks,
        name: label(&name.or(file_name).unwrap_or_default()),
        owner,
    };
    Ok((arrival, wished))
}

/// Reads a JSON field of a form, at most [`MAX_JSON_BYTES`] long.
async fn receive_wish(mut field: Field<'_>) -> Result<Map<String, Value>, Problem> {
    let mut text = Vec::new();
    loop {
        let piece = timeout(PIECE, field.chunk())
            .await
            .map_err(|_elapsed| Code::BodyTimeout)?;
        let Some(bytes) = piece.map_err(|error| from_multipart(&error))? else {
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
    match timeout(PIECE, form.next_field()).await {
        Ok(field) => field.map_err(|error| from_multipart(&error)),
        Err(_) => Err(Code::BodyTimeout.into()),
    }
}

/// Writes a stream to a file of the draft. Returns its size and hash. Fails if the stream exceeds
/// `limit_bytes`, stalls or is cut off, or if the disk is full.
async fn receive_file<S, E>(
    state: &AppState,
    mut stream: S,
    (draft, name, limit_bytes): (&Draft, &'static str, u64),
) -> Result<BlobFile, Problem>
where
    S: Stream<Item = Result<Bytes, E>> + Unpin,
    E: std::error::Error,
{
    let mut intake = Intake::create(draft, name, limit_bytes).await?;
    match take_all(state, &mut stream, &mut intake).await {
        Ok(()) => Ok(intake.finish().await?),
        Err(problem) => {
            intake.give_up().await;
            Err(problem)
        }
    }
}

async fn take_all<S, E>(
    state: &AppState,
    stream: &mut S,
    intake: &mut Intake,
) -> Result<(), Problem>
where
    S: Stream<Item = Result<Bytes, E>> + Unpin,
    E: std::error::Error,
{
    let mut n_unchecked = 0;
    loop {
        match timeout(PIECE, stream.next()).await {
            Ok(Some(Ok(bytes))) => {
                n_unchecked += bytes.len() as u64;
                if n_unchecked >= CHECK_EVERY_BYTES {
                    check_room(state, 0)?;
                    n_unchecked = 0;
                }
                intake.take(bytes).await?;
            }
            Ok(Some(Err(error))) => {
                tracing::debug!(%error, "a body was cut off");
                return Err(of_broken_body(&error).into());
            }
            Ok(None) => return Ok(()),
            Err(_) => return Err(Code::BodyTimeout.into()),
        }
    }
}

/// Refuses a body whose declared length exceeds the limit, before it is read.
fn check_headers(request: &Request, limit_bytes: u64) -> Result<(), Problem> {
    let most = match is_form(request) {
        // A form may also hold masks, a background, JSON fields, and the boundaries between them.
        true => limit_bytes
            .saturating_mul(2)
            .saturating_add(MAX_BACKGROUND_BYTES + (4 << 20)),
        false => limit_bytes,
    };
    match body_bytes(request).is_some_and(|bytes| bytes > most) {
        true => Err(store::Error::TooLarge { limit_bytes }.into()),
        false => Ok(()),
    }
}

/// Returns the declared length of the body, bytes; `None` if there is none.
fn body_bytes(request: &Request) -> Option<u64> {
    let length = request.headers().get(header::CONTENT_LENGTH)?;
    length.to_str().ok()?.parse().ok()
}

/// Fails with `storage_full` if `n_bytes` more would use the reserve of the disk
/// (docs/explanation/promises.md, "Full disk").
pub(super) fn check_room(state: &AppState, n_bytes: u64) -> Result<(), Problem> {
    let room = state.context.store.blobs().room_bytes();
    let room = room.map_err(store::Error::Io)?;
    match n_bytes.saturating_add(state.config.disk_reserve_bytes) > room {
        true => Err(Code::StorageFull.into()),
        false => Ok(()),
    }
}

/// Returns whether the media type of the body is that of footage or of a form, not of JSON.
pub(super) fn is_film(request: &Request) -> bool {
    let media_type = request.headers().get(header::CONTENT_TYPE);
    let media_type = media_type.and_then(|value| value.to_str().ok());
    let media_type = media_type.unwrap_or_default().to_ascii_lowercase();
    FILM_TYPES.iter().any(|film| media_type.starts_with(film))
}

fn is_form(request: &Request) -> bool {
    let media_type = request.headers().get(header::CONTENT_TYPE);
    let media_type = media_type.and_then(|value| value.to_str().ok());
    media_type.is_some_and(|text| text.to_ascii_lowercase().starts_with("multipart/"))
}

/// Returns the code for a body that ended early: `body_timeout` or `body_cut_off`.
pub(super) fn of_broken_body(error: &dyn std::error::Error) -> Code {
    match is_too_slow(error) {
        true => Code::BodyTimeout,
        false => Code::BodyCutOff,
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
    let turns_text = |c: char| matches!(c, '\u{200e}'..='\u{200f}' | '\u{202a}'..='\u{202e}' | '\u{2066}'..='\u{2069}');
    let kept = last.chars().filter(|c| !c.is_control() && !turns_text(*c));
    kept.take(200).collect::<String>().trim().to_owned()
}

#[cfg(test)]
mod tests {
    use super::label;

    #[test]
    fn a_name_becomes_a_plain_label() {
        assert_eq!(label("../../etc/passwd"), "passwd");
        assert_eq!(label("C:\\films\\fish.mp4"), "fish.mp4");
        assert_eq!(label("a\r\nb\0\u{202e}4pm.exe"), "ab4pm.exe");
        assert_eq!(label(&"x".repeat(300)).len(), 200);
        assert_eq!(label("<b>-i</b>"), "b>");
    }
}
