//! Resumable uploads: tus 1.0.0 with creation, creation-with-upload, termination, checksum and expiration
//! (docs/explanation/promises.md, "No upload is lost"). A complete upload becomes footage. If the video is
//! refused, the upload is deleted, and the response to the last bytes gives the reason.

use axum::body::{Body, BodyDataStream};
use axum::extract::{Request, State};
use axum::http::{HeaderMap, HeaderName, HeaderValue, Response, StatusCode, header};
use axum::middleware::Next;
use axum::response::IntoResponse;
use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use futures_util::StreamExt;
use sha1::Sha1;
use sha2::Sha256;
use sha2::digest::DynDigest;
use tokio::time::timeout;
use tracing::Instrument;
use uuid::Uuid;

use super::AppState;
use super::extract::{Access, Id};
use super::problem::{Answer, Problem, ProblemBody};
use super::receive::{CHECK_EVERY_BYTES, CHUNK_TIMEOUT, code_of_broken_body, label};
use crate::jobs::admit::ReceivedFiles;
use crate::jobs::clock::now_ms;
use crate::jobs::{Error, IdSequence};
use crate::store::footage::Added;
use crate::store::owners::OwnerFilter;
use crate::store::space::Counted;
use crate::store::uploads::{LIFETIME_MS, Upload, UploadLock};
use flockreel_core::code::Code;

const VERSION: HeaderValue = HeaderValue::from_static("1.0.0");
const RESUMABLE: HeaderName = HeaderName::from_static("tus-resumable");
const OFFSET: HeaderName = HeaderName::from_static("upload-offset");
const LENGTH: HeaderName = HeaderName::from_static("upload-length");
const CHUNK_MEDIA_TYPE: &str = "application/offset+octet-stream";
/// Number of bytes after which the free disk is checked again.
const CHECK_BYTES: i64 = CHECK_EVERY_BYTES as i64;

/// Middleware: adds the tus version to responses below /v1/uploads, and refuses requests of other versions.
pub(super) async fn tus_version(request: Request, next: Next) -> Response<Body> {
    let path = request.uri().path();
    if path != "/v1/uploads" && !path.starts_with("/v1/uploads/") {
        return next.run(request).await;
    }
    let version = request.headers().get(RESUMABLE);
    let is_known = request.method() == "OPTIONS" || version == Some(&VERSION);
    let mut answer = if is_known {
        next.run(request).await
    } else {
        Problem::from(Code::TusVersionNotSupported).into_response()
    };
    let headers = answer.headers_mut();
    headers.insert(RESUMABLE, VERSION);
    headers.insert(HeaderName::from_static("tus-version"), VERSION);
    answer
}

/// Describe the upload protocol in the headers `Tus-*`: extensions, checksums, and largest upload in bytes.
#[utoipa::path(options, path = "/v1/uploads", responses((status = 204, description = "see the Tus-* headers")))]
pub(super) async fn describe_uploads(State(state): State<AppState>) -> Response<Body> {
    let headers = [
        ("tus-max-size", state.config.max_upload_bytes.to_string()),
        (
            "tus-extension",
            "creation,creation-with-upload,termination,checksum,expiration".to_owned(),
        ),
        ("tus-checksum-algorithm", "sha1,sha256".to_owned()),
    ];
    (StatusCode::NO_CONTENT, headers).into_response()
}

/// Start a resumable upload.
///
/// `Upload-Length` is the size in bytes, `filename` in `Upload-Metadata` the name. The body may hold the
/// first bytes. PATCH sends the others to `Location`. An upload without new bytes expires after 24 hours. An open upload
/// counts with its whole size: the call fails with `owner_storage_full` if the owner, and with `storage_full` if the disk
/// has no space for it.
#[utoipa::path(post, path = "/v1/uploads", request_body(content = [u8], content_type = "application/offset+octet-stream"),
    responses(
    (status = 201, headers(("location" = String), ("upload-offset" = i64), ("upload-expires" = String))),
    (status = "4XX", body = ProblemBody, content_type = "application/problem+json"),
    (status = "5XX", body = ProblemBody, content_type = "application/problem+json"),
))]
pub(super) async fn create_upload(access: Access, mut ids: IdSequence, request: Request) -> Answer {
    let headers = request.headers();
    let size_bytes = number(headers, &LENGTH)?;
    let limit_bytes = access.state.config.max_upload_bytes;
    if size_bytes.unsigned_abs() > limit_bytes {
        return Err(crate::store::Error::TooLarge { limit_bytes }.into());
    }
    let upload = Upload {
        id: ids.next_id(),
        owner: access.caller.account.owner.clone(),
        name: label(&file_name(headers)?),
        size_bytes,
        offset_bytes: 0,
        footage_id: None,
        expires_ms: now_ms() + LIFETIME_MS,
    };
    let store = access.store();
    store.sweep_uploads(now_ms()).await?;
    let location = [(header::LOCATION, format!("/v1/uploads/{}", upload.id))];
    let lock = store.lock_upload(upload.id).await;
    // A request repeated after a crash gets the same id from its Idempotency-Key, and finds its upload.
    let owners = OwnerFilter::One(upload.owner.clone());
    if let Some(upload) = store.upload(upload.id, &owners, now_ms()).await? {
        return Ok((StatusCode::CREATED, location, status_headers(&upload)).into_response());
    }
    store.create_upload(&upload).await?;
    let upload = if is_chunk(headers) {
        in_task(receive_chunk(access.state, lock, upload, request)).await?
    } else {
        upload
    };
    Ok((StatusCode::CREATED, location, status_headers(&upload)).into_response())
}

/// Get the state of an upload. Send the next bytes from `Upload-Offset` on.
#[utoipa::path(head, path = "/v1/uploads/{id}", params(("id" = Uuid, Path)), responses(
    (status = 200, headers(("upload-offset" = i64), ("upload-length" = i64), ("upload-expires" = String))),
    (status = "4XX", description = "an error; a response to HEAD has no body"),
))]
pub(super) async fn head_upload(access: Access, Id(id): Id) -> Answer {
    find(&access, id).await?;
    let lock = access.store().lock_upload(id).await;
    let upload = find(&access, id).await?;
    // The process may have ended after the last byte, before the upload became footage.
    let upload = in_task(finish_if_complete(access.state, lock, upload)).await?;
    Ok((StatusCode::OK, status_headers(&upload)).into_response())
}

/// Send the next bytes of an upload.
///
/// `Upload-Offset` must equal the stored offset, else the call fails with `offset_differs`. If the connection
/// breaks, the bytes received are kept. With `Upload-Checksum` only a complete and matching body is kept. The
/// last bytes make the footage, which `Link` names. If the video is refused, the response says why.
#[utoipa::path(patch, path = "/v1/uploads/{id}", params(("id" = Uuid, Path)),
    request_body(content = [u8], content_type = "application/offset+octet-stream"), responses(
    (status = 204, headers(("upload-offset" = i64), ("upload-expires" = String), ("link" = String)),
        description = "after the last part, Link holds the address of the footage"),
    (status = "4XX", body = ProblemBody, content_type = "application/problem+json"),
    (status = "5XX", body = ProblemBody, content_type = "application/problem+json"),
))]
pub(super) async fn patch_upload(access: Access, Id(id): Id, request: Request) -> Answer {
    if !is_chunk(request.headers()) {
        let sentence = format!("the Content-Type of an upload part must be {CHUNK_MEDIA_TYPE}");
        return Err(Problem::new(Code::UnsupportedMediaType, sentence));
    }
    let offset_bytes = number(request.headers(), &OFFSET)?;
    find(&access, id).await?;
    let lock = access.store().lock_upload(id).await;
    let upload = find(&access, id).await?;
    if offset_bytes != upload.offset_bytes {
        let sentence = format!("the stored offset is {} bytes", upload.offset_bytes);
        return Err(Problem::new(Code::OffsetDiffers, sentence));
    }
    let upload = in_task(receive_chunk(access.state, lock, upload, request)).await?;
    Ok((StatusCode::NO_CONTENT, status_headers(&upload)).into_response())
}

/// Cancel an upload and delete its bytes. Footage that it has become is kept.
#[utoipa::path(delete, path = "/v1/uploads/{id}", params(("id" = Uuid, Path)), responses(
    (status = 204, description = "deleted"),
    (status = "4XX", body = ProblemBody, content_type = "application/problem+json"),
))]
pub(super) async fn delete_upload(access: Access, Id(id): Id) -> Result<StatusCode, Problem> {
    find(&access, id).await?;
    let _lock = access.store().lock_upload(id).await;
    find(&access, id).await?;
    access.store().delete_upload(id).await?;
    Ok(StatusCode::NO_CONTENT)
}

async fn find(access: &Access, id: Uuid) -> Result<Upload, Problem> {
    let owners = &access.caller.owners;
    let upload = access.store().upload(id, owners, now_ms()).await?;
    upload.ok_or_else(Problem::not_found)
}

/// Runs work in its own task, so that a client that disconnects cannot interrupt it halfway.
async fn in_task(
    work: impl Future<Output = Result<Upload, Problem>> + Send + 'static,
) -> Result<Upload, Problem> {
    let done = tokio::spawn(work.in_current_span()).await;
    done.unwrap_or_else(|_panic| Err(Error::Panicked.into()))
}

/// Appends the body of a request to an upload, and turns a complete upload into footage. If the body is cut
/// off, the bytes received so far are kept, unless the request has a checksum.
async fn receive_chunk(
    state: AppState,
    lock: UploadLock,
    mut upload: Upload,
    request: Request,
) -> Result<Upload, Problem> {
    let store = &state.context.store;
    let mut checksum = Checksum::from_headers(request.headers())?;
    let mut body = request.into_body().into_data_stream();
    if upload.footage_id.is_some() {
        return Ok(upload);
    }
    let mut writer = store.open_upload(&upload).await?;
    let ended = loop {
        let bytes = match next_bytes(&mut body, &lock).await {
            Ok(Some(bytes)) => bytes,
            Ok(None) => break Ok(()),
            Err(problem) => break Err(problem),
        };
        let before = upload.offset_bytes + writer.n_bytes();
        let after = before + bytes.len() as i64;
        if after > upload.size_bytes {
            break Err(Code::TooLarge.into());
        }
        // Other requests fill the disk too, so the free space is checked again from time to time.
        if before / CHECK_BYTES != after / CHECK_BYTES
            && let Err(error) = store.check_disk(0)
        {
            break Err(error.into());
        }
        if let Some(checksum) = &mut checksum {
            checksum.hasher.update(&bytes);
        }
        writer.append(&upload, bytes).await?;
        // A body with a checksum is confirmed only as a whole.
        if checksum.is_none() && writer.is_due() {
            writer.confirm(&mut upload, now_ms()).await?;
        }
    };
    if let Some(checksum) = checksum {
        ended.clone()?;
        checksum.verify()?;
    }
    writer.confirm(&mut upload, now_ms()).await?;
    ended?;
    finish_if_complete(state, lock, upload).await
}

async fn next_bytes(
    body: &mut BodyDataStream,
    lock: &UploadLock,
) -> Result<Option<bytes::Bytes>, Problem> {
    let next = tokio::select! {
        next = timeout(CHUNK_TIMEOUT, body.next()) => next,
        () = lock.requested.cancelled() => return Err(Code::OffsetDiffers.into()),
    };
    match next {
        Ok(bytes) => bytes.transpose().map_err(|error| {
            tracing::debug!(%error, "an upload was cut off");
            code_of_broken_body(&error).into()
        }),
        Err(_) => Err(Code::BodyTimeout.into()),
    }
}

/// Turns a complete upload into footage. An incomplete one is returned unchanged. If the video is refused,
/// the upload is deleted; after a transient error it is kept.
async fn finish_if_complete(
    state: AppState,
    _lock: UploadLock,
    mut upload: Upload,
) -> Result<Upload, Problem> {
    if upload.offset_bytes < upload.size_bytes || upload.footage_id.is_some() {
        return Ok(upload);
    }
    let store = &state.context.store;
    let (draft, video) = match store.draft_of_upload(&upload).await {
        Ok(complete) => complete,
        Err(error) => {
            // Another instance of the service may have finished the upload, and removed its bytes.
            let owners = OwnerFilter::One(upload.owner);
            let upload = store.upload(upload.id, &owners, now_ms()).await?;
            let finished = upload.filter(|upload| upload.footage_id.is_some());
            return finished.ok_or(error.into());
        }
    };
    let received = ReceivedFiles {
        draft,
        video,
        background: None,
        masks: None,
        name: upload.name.clone(),
        owner: upload.owner.clone(),
        counted: Counted::Upload(upload.id),
    };
    match super::footage::admit(&state, received).await {
        Ok(Added::New(footage) | Added::Known(footage)) => {
            store.finish_upload(&upload, footage.id).await?;
            upload.footage_id = Some(footage.id);
            Ok(upload)
        }
        Err(problem) if !problem.is_transient() => {
            store.delete_upload(upload.id).await?;
            Err(problem)
        }
        Err(problem) => Err(problem),
    }
}

/// Returns the state of an upload as headers: offset, length, expiry, and the footage in `Link`.
fn status_headers(upload: &Upload) -> HeaderMap {
    let expires = super::timestamp::http_date(upload.expires_ms);
    let link = upload
        .footage_id
        .map(|id| format!("</v1/footage/{id}>; rel=\"related\""));
    let lines = [
        (OFFSET, Some(upload.offset_bytes.to_string())),
        (LENGTH, Some(upload.size_bytes.to_string())),
        (HeaderName::from_static("upload-expires"), Some(expires)),
        (header::LINK, link),
    ];
    let lines = lines.into_iter().filter_map(|(name, value)| {
        let value = HeaderValue::from_str(&value?).ok()?;
        Some((name, value))
    });
    lines.collect()
}

fn number(headers: &HeaderMap, name: &HeaderName) -> Result<i64, Problem> {
    let value = headers.get(name).and_then(|value| value.to_str().ok());
    let number = value.and_then(|text| text.parse().ok()).filter(|n| *n >= 0);
    let malformed = || format!("{name} must be a number of bytes");
    number.ok_or_else(|| Problem::new(Code::MalformedRequest, malformed()))
}

/// Returns `filename` or `name` of Upload-Metadata, or an empty string. Fails if it cannot be parsed.
fn file_name(headers: &HeaderMap) -> Result<String, Problem> {
    let sentence = "Upload-Metadata must be pairs of a key and a base64 value";
    let malformed = || Problem::new(Code::MalformedRequest, sentence);
    let Some(pairs) = headers.get("upload-metadata") else {
        return Ok(String::new());
    };
    let pairs = pairs.to_str().map_err(|_not_text| malformed())?;
    for pair in pairs.split(',') {
        let (key, value) = pair.trim().split_once(' ').unwrap_or((pair.trim(), ""));
        let value = STANDARD
            .decode(value.trim())
            .map_err(|_not_base64| malformed())?;
        if key == "filename" || key == "name" {
            return Ok(String::from_utf8_lossy(&value).into_owned());
        }
    }
    Ok(String::new())
}

fn is_chunk(headers: &HeaderMap) -> bool {
    let media_type = headers.get(header::CONTENT_TYPE);
    media_type.is_some_and(|value| value.as_bytes() == CHUNK_MEDIA_TYPE.as_bytes())
}

/// Expected hash of the body of one request.
struct Checksum {
    hasher: Box<dyn DynDigest + Send>,
    expected: Vec<u8>,
}

impl Checksum {
    fn from_headers(headers: &HeaderMap) -> Result<Option<Checksum>, Problem> {
        let Some(line) = headers.get("upload-checksum") else {
            return Ok(None);
        };
        let sentence = "Upload-Checksum must be sha1 or sha256, a space, and the hash in base64";
        let malformed = || Problem::new(Code::MalformedRequest, sentence);
        let (name, value) = (line.to_str().ok())
            .and_then(|line| line.split_once(' '))
            .ok_or_else(malformed)?;
        let hasher: Box<dyn DynDigest + Send> = match name {
            "sha1" => Box::new(Sha1::default()),
            "sha256" => Box::new(Sha256::default()),
            _ => return Err(malformed()),
        };
        let expected = STANDARD
            .decode(value.trim())
            .map_err(|_not_base64| malformed())?;
        Ok(Some(Checksum { hasher, expected }))
    }

    fn verify(self) -> Result<(), Problem> {
        if *self.hasher.finalize() == *self.expected {
            Ok(())
        } else {
            Err(Code::ChecksumMismatch.into())
        }
    }
}
