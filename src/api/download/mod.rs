//! Downloads of stored files, with Range, ETag, HEAD, 304 and 416
//! (docs/explanation/promises.md, "Exact ranges" and "Names are labels").
//!
//! Stored files never change, so clients may cache them forever. The ETag is the SHA-256 of the content.

pub(super) mod compression; // gzip
pub(super) mod computed; // files that are not stored
pub(super) mod if_match;
pub(super) mod names; // names of saved files
mod range;

use axum::body::Body;
use axum::http::{HeaderValue, Method, Response, StatusCode, header};
use axum::response::IntoResponse;

pub(super) use self::range::matches;
use self::range::{Wanted, wanted};
use super::Problem;
use super::extract::Conditions;
use crate::store::Store;
use crate::store::blobs::hex;
use flockreel_core::code::Code;

/// A stored file to send.
#[derive(Clone, Debug)]
pub(super) struct Download<'a> {
    /// Folder in the store.
    pub folder: &'a str,
    /// File name in the folder.
    pub name: &'a str,
    /// Media type.
    pub media_type: &'static str,
    /// Value of Content-Disposition.
    pub disposition: String,
}

/// Files that can be downloaded: name and media type.
pub(super) type Files = &'static [(&'static str, &'static str)];

/// Returns the entry of a file name. Fails with `not_found`.
pub(super) fn find(files: Files, name: &str) -> Result<(&'static str, &'static str), Problem> {
    let found = files.iter().find(|(known, _)| *known == name);
    found.copied().ok_or_else(Problem::not_found)
}

impl Download<'_> {
    /// Returns the response to a GET or HEAD request. Fails with `not_found` if the file does not exist.
    pub(super) async fn answer(
        self,
        store: &Store,
        conditions: &Conditions,
    ) -> Result<Response<Body>, Problem> {
        let blob = store.blob(self.folder, self.name).await?;
        let blob = blob.ok_or_else(Problem::not_found)?;
        let size_bytes = blob.size_bytes.unsigned_abs();
        let etag = format!("\"{}\"", hex(&blob.sha256));
        let wanted = wanted(&conditions.method, &conditions.headers, &etag, size_bytes);
        let (first, last, status) = match wanted {
            Wanted::Whole => (0, size_bytes, StatusCode::OK),
            Wanted::Part { first, last } => (first, last + 1, StatusCode::PARTIAL_CONTENT),
            Wanted::NotModified => (0, 0, StatusCode::NOT_MODIFIED),
            Wanted::Unsatisfiable => return Ok(unsatisfiable(size_bytes)),
        };
        let mut answer = Response::builder()
            .status(status)
            .header(header::ETAG, etag)
            .header(header::ACCEPT_RANGES, "bytes")
            .header(
                header::CACHE_CONTROL,
                "private, max-age=31536000, immutable",
            );
        if status == StatusCode::NOT_MODIFIED {
            return built(answer.body(Body::empty()));
        }
        if status == StatusCode::PARTIAL_CONTENT {
            let range = format!("bytes {first}-{}/{size_bytes}", last - 1);
            answer = answer.header(header::CONTENT_RANGE, range);
        }
        let body = if conditions.method == Method::HEAD {
            Body::empty()
        } else {
            self.bytes(store, first, last - first).await?
        };
        built(
            answer
                .header(header::CONTENT_TYPE, self.media_type)
                .header(header::CONTENT_LENGTH, last - first)
                .header(header::CONTENT_DISPOSITION, self.disposition)
                .body(body),
        )
    }

    async fn bytes(&self, store: &Store, first: u64, n_bytes: u64) -> Result<Body, Problem> {
        let part = store.blobs().read(self.folder, self.name, first, n_bytes);
        Ok(Body::from_stream(part.await?))
    }
}

/// Returns the value of Content-Disposition: `kind` is `attachment` or `inline`, and `label` is the file
/// name, which may contain any characters (RFC 6266, RFC 8187).
pub(super) fn disposition(kind: &str, label: &str) -> String {
    let plain: String = label
        .chars()
        .map(|c| {
            if c.is_ascii_alphanumeric() || "._- ".contains(c) {
                c
            } else {
                '_'
            }
        })
        .collect();
    let mut encoded = String::new();
    for byte in label.bytes() {
        match byte {
            b'a'..=b'z' | b'A'..=b'Z' | b'0'..=b'9' | b'.' | b'_' | b'-' => {
                encoded.push(char::from(byte));
            }
            _ => encoded.push_str(&format!("%{byte:02X}")),
        }
    }
    format!("{kind}; filename=\"{plain}\"; filename*=UTF-8''{encoded}")
}

fn unsatisfiable(size_bytes: u64) -> Response<Body> {
    let mut answer = Problem::from(Code::RangeNotSatisfiable).into_response();
    if let Ok(range) = HeaderValue::from_str(&format!("bytes */{size_bytes}")) {
        answer.headers_mut().insert(header::CONTENT_RANGE, range);
    }
    answer
}

/// Returns a built response. Fails with `internal` and logs the cause if a header is invalid.
pub(super) fn built(
    answer: Result<Response<Body>, axum::http::Error>,
) -> Result<Response<Body>, Problem> {
    answer.map_err(|error| {
        tracing::error!(%error, "a response could not be built");
        Code::Internal.into()
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn disposition_escapes_the_label() {
        assert_eq!(
            disposition("attachment", "a\"\r\nSet-Cookie: x.mp4"),
            "attachment; filename=\"a___Set-Cookie_ x.mp4\"; \
             filename*=UTF-8''a%22%0D%0ASet-Cookie%3A%20x.mp4"
        );
    }
}
