//! Compression of text in responses: gzip or zstd, whichever the client prefers (RFC 9110, section 8.4).
//!
//! Media are compressed already, a part of a file has the bytes of the file, and events must not wait for a
//! full block. These are sent as they are. A compressed file has other bytes than the stored one, so its ETag
//! is weak: it still matches If-None-Match, but not If-Range.

use axum::extract::Request;
use axum::http::{Extensions, HeaderMap, HeaderValue, Method, StatusCode, Version, header};
use axum::middleware::Next;
use axum::response::Response;
use tower_http::compression::CompressionLayer;
use tower_http::compression::predicate::{And, Predicate, SizeAbove};

use flockreel_core::formats::flock_plan;

/// Length below which a response is not compressed, bytes. Free choice: it fits into one packet.
const MIN_BYTES: u64 = 860;

/// Media types that are compressed. All but the last are text.
const TYPES: [&str; 8] = [
    "application/json",
    "application/problem+json",
    "image/svg+xml",
    "text/css",
    "text/csv",
    "text/html",
    "text/javascript",
    flock_plan::MEDIA_TYPE,
];

type HasType = fn(StatusCode, Version, &HeaderMap, &Extensions) -> bool;

/// Returns the layer that compresses responses.
pub(in crate::api) fn layer() -> CompressionLayer<And<SizeAbove, HasType>> {
    let has_type: HasType = |_, _, headers, _| is_compressed(headers);
    CompressionLayer::new().compress_when(SizeAbove::new(MIN_BYTES).and(has_type))
}

/// Returns whether responses with these headers are compressed.
fn is_compressed(headers: &HeaderMap) -> bool {
    let media_type = headers.get(header::CONTENT_TYPE);
    let media_type = media_type.and_then(|value| value.to_str().ok());
    let media_type = media_type.and_then(|value| value.split(';').next());
    media_type.is_some_and(|media_type| TYPES.contains(&media_type))
}

/// Middleware around [`layer`]: decides whether the client may get a compressed response, and weakens the ETag
/// of such a response.
pub(in crate::api) async fn negotiate(mut request: Request, next: Next) -> Response {
    // A response to HEAD has the length of the stored file.
    let codings = codings(request.headers()).filter(|_| request.method() != Method::HEAD);
    let tags = request.headers().get(header::IF_NONE_MATCH);
    let knows_weak = tags.is_some_and(|tags| tags.as_bytes().windows(2).any(|two| two == b"W/"));
    let is_weak_304 = codings.is_some() && knows_weak;
    let headers = request.headers_mut();
    match codings {
        Some(codings) => headers.insert(header::ACCEPT_ENCODING, codings),
        None => headers.remove(header::ACCEPT_ENCODING),
    };
    let mut response = next.run(request).await;
    if response.status() == StatusCode::NOT_MODIFIED {
        let vary = HeaderValue::from_static("accept-encoding");
        response.headers_mut().append(header::VARY, vary);
    }
    let is_weak = response.headers().contains_key(header::CONTENT_ENCODING)
        || (response.status() == StatusCode::NOT_MODIFIED && is_weak_304);
    if is_weak && let Some(tag) = response.headers_mut().get_mut(header::ETAG) {
        weaken(tag);
    }
    response
}

/// Returns the accepted ones of gzip and zstd, as a value of Accept-Encoding. Any response may be sent without
/// compression, so other codings, and a refusal of that, are ignored.
fn codings(headers: &HeaderMap) -> Option<HeaderValue> {
    let accepted = headers.get_all(header::ACCEPT_ENCODING).iter();
    let accepted = accepted.filter_map(|value| value.to_str().ok());
    let accepted = accepted.flat_map(|value| value.split(','));
    let known = accepted.filter(|coding| {
        let name = coding.split(';').next().unwrap_or_default().trim();
        ["gzip", "zstd"]
            .iter()
            .any(|known| name.eq_ignore_ascii_case(known))
    });
    let known: Vec<&str> = known.collect();
    let known = HeaderValue::from_str(&known.join(",")).ok();
    known.filter(|known| !known.is_empty())
}

fn weaken(tag: &mut HeaderValue) {
    let strong = tag.to_str().ok().filter(|tag| !tag.starts_with("W/"));
    let weak = strong.map(|strong| HeaderValue::from_str(&format!("W/{strong}")));
    if let Some(Ok(weak)) = weak {
        *tag = weak;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_known_codings_are_negotiated() {
        for (accepted, known) in [
            ("gzip, deflate, br, zstd", Some("gzip, zstd")),
            ("GZIP;q=0.5", Some("GZIP;q=0.5")),
            ("identity;q=0, *;q=0", None),
            ("br", None),
            ("", None),
        ] {
            let value = HeaderValue::from_static(accepted);
            let headers = HeaderMap::from_iter([(header::ACCEPT_ENCODING, value)]);
            let found = codings(&headers);
            assert_eq!(
                found.as_ref().map(|v| v.to_str().unwrap()),
                known,
                "{accepted}"
            );
        }
    }
}
