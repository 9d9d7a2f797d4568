//! Downloads of stored files, with Range, ETag, HEAD, 304 and 416
//! (docs/explanation/promises.md, "Exact ranges" and "Names are labels").
//!
//! Stored files never change, so clients may cache them forever. The ETag is the SHA-256 of the content.

pub(super) mod compression; // gzip
pub(super) mod computed; // files that are not stored
pub(super) mod if_match;
pub(super) mod names; // names of saved files
mod range;

use std::io;
use std::ops::Range;

use axum::body::{Body, Bytes};
use axum::http::{HeaderValue, Method, Response, StatusCode, header};
use axum::response::IntoResponse;
use futures_util::stream::{self, BoxStream};
use futures_util::{StreamExt, TryStreamExt};

pub(super) use self::range::matches;
use self::range::{Wanted, wanted};
use super::Problem;
use super::extract::Conditions;
use crate::store::blobs::hex;
use crate::store::{self, BlobFile, Blobs, Store};
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

/// A stored file whose bytes are a piece of what is sent.
#[derive(Clone, Debug)]
pub(super) struct Piece {
    /// Folder in the store.
    pub folder: String,
    /// The file.
    pub file: BlobFile,
}

/// Content of a response: stored files, one after the other. The last one identifies all of them.
#[derive(Clone, Debug)]
pub(super) struct Sent {
    /// The files, at least one.
    pub pieces: Vec<Piece>,
    /// Media type.
    pub media_type: &'static str,
    /// Value of Content-Disposition.
    pub disposition: String,
}

impl From<(String, BlobFile)> for Piece {
    fn from((folder, file): (String, BlobFile)) -> Piece {
        Piece { folder, file }
    }
}

impl Download<'_> {
    /// Returns the response to a GET or HEAD request. Fails with `not_found` if the file does not exist.
    pub(super) async fn answer(
        self,
        store: &Store,
        conditions: &Conditions,
    ) -> Result<Response<Body>, Problem> {
        let blob = store.blob(self.folder, self.name).await?;
        let file = blob.ok_or_else(Problem::not_found)?;
        let sent = Sent {
            pieces: vec![(self.folder.to_owned(), file).into()],
            media_type: self.media_type,
            disposition: self.disposition,
        };
        sent.answer(store, conditions).await
    }
}

impl Sent {
    /// Returns the response to a GET or HEAD request.
    pub(super) async fn answer(
        self,
        store: &Store,
        conditions: &Conditions,
    ) -> Result<Response<Body>, Problem> {
        let sizes = self.pieces.iter().map(Piece::n_bytes);
        let size_bytes = sizes.sum();
        let last = self.pieces.last().ok_or_else(Problem::not_found)?;
        let etag = format!("\"{}\"", hex(&last.file.sha256));
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
        let answer = answer
            .header(header::CONTENT_TYPE, self.media_type)
            .header(header::CONTENT_LENGTH, last - first)
            .header(header::CONTENT_DISPOSITION, &self.disposition);
        let body = if conditions.method == Method::HEAD {
            Body::empty()
        } else {
            self.bytes(store, first, last - first).await?
        };
        built(answer.body(body))
    }

    /// Returns `n_bytes` from offset `first`. The first piece is opened at once, and the others when they are needed.
    async fn bytes(self, store: &Store, first: u64, n_bytes: u64) -> Result<Body, Problem> {
        let mut parts = self.parts(first, first + n_bytes).into_iter();
        let Some((piece, within)) = parts.next() else {
            return Ok(Body::empty());
        };
        let blobs = store.blobs().clone();
        let head = piece.read(&blobs, within).await?;
        let rest = stream::iter(parts).then(move |(piece, within)| {
            let blobs = blobs.clone();
            async move { (piece.read(&blobs, within).await).map_err(io::Error::other) }
        });
        Ok(Body::from_stream(head.chain(rest.try_flatten())))
    }

    /// Returns the pieces that have bytes in a range of the whole, with the ranges of these bytes in them.
    fn parts(self, first: u64, end: u64) -> Vec<(Piece, Range<u64>)> {
        let (mut parts, mut before) = (Vec::new(), 0);
        for piece in self.pieces {
            let n_bytes = piece.n_bytes();
            let within = first.max(before) - before..end.clamp(before, before + n_bytes) - before;
            before += n_bytes;
            if within.start < within.end {
                parts.push((piece, within));
            }
        }
        parts
    }
}

impl Piece {
    fn n_bytes(&self) -> u64 {
        self.file.size_bytes.unsigned_abs()
    }

    async fn read(
        &self,
        blobs: &Blobs,
        within: Range<u64>,
    ) -> Result<BoxStream<'static, io::Result<Bytes>>, store::Error> {
        let n_bytes = within.end - within.start;
        (blobs.read(&self.folder, &self.file.name, within.start, n_bytes)).await
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
    fn range_over_pieces_has_the_bytes_of_each() {
        let piece = |n_bytes: i64| Piece {
            folder: n_bytes.to_string(),
            file: BlobFile {
                name: "x".into(),
                size_bytes: n_bytes,
                sha256: Vec::new(),
            },
        };
        let parts = |first, end| -> Vec<(String, Range<u64>)> {
            let sent = Sent {
                pieces: [3, 0, 5, 7].map(piece).to_vec(),
                media_type: "",
                disposition: String::new(),
            };
            let parts = sent.parts(first, end).into_iter();
            parts
                .map(|(piece, within)| (piece.folder, within))
                .collect()
        };
        let part = |n_bytes: i64, within| (n_bytes.to_string(), within);
        assert_eq!(parts(0, 15), [part(3, 0..3), part(5, 0..5), part(7, 0..7)]);
        assert_eq!(parts(2, 4), [part(3, 2..3), part(5, 0..1)]);
        assert_eq!(parts(3, 8), [part(5, 0..5)]);
        assert_eq!(parts(14, 15), [part(7, 6..7)]);
        assert_eq!(parts(4, 4), []);
    }

    #[test]
    fn disposition_escapes_the_label() {
        assert_eq!(
            disposition("attachment", "a\"\r\nSet-Cookie: x.mp4"),
            "attachment; filename=\"a___Set-Cookie_ x.mp4\"; \
             filename*=UTF-8''a%22%0D%0ASet-Cookie%3A%20x.mp4"
        );
    }
}
