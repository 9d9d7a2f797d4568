//! Compression of text in responses by gzip (RFC 9110, section 8.4).
//!
//! Media are compressed already, a part of a file has the bytes of the file, and events must not wait for a
//! full block. These are sent as they are. A compressed file has other bytes than the stored one, so its ETag
//! is weak: it still matches If-None-Match, but not If-Range.

use std::sync::{Arc, LazyLock};

use axum::extract::Request;
use axum::http::{Extensions, HeaderMap, HeaderValue, Method, StatusCode, Version, header};
use axum::middleware::Next;
use axum::response::Response;
use tokio::sync::Semaphore;
use tower_http::compression::CompressionLayer;
use tower_http::compression::predicate::{And, Predicate, SizeAbove};

use crate::api::access::hold_until_sent;
use flockreel_core::formats::flock_plan;

/// Length below which a response is not compressed, bytes. Free choice: it fits into one packet.
const MIN_BYTES: u64 = 860;

/// Largest number of responses that are compressed at the same time. Each needs about 300 kB until its client has read
/// it. Further responses are sent as they are. Free choice.
const MAX_COMPRESSED: usize = 64;

static PERMITS: LazyLock<Arc<Semaphore>> =
    LazyLock::new(|| Arc::new(Semaphore::new(MAX_COMPRESSED)));

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
    let has_type: HasType = |_, _, headers, _| {
        let media_type = headers.get(header::CONTENT_TYPE);
        media_type.is_some_and(|value| value.to_str().is_ok_and(is_compressed))
    };
    CompressionLayer::new().compress_when(SizeAbove::new(MIN_BYTES).and(has_type))
}

/// Returns whether responses of a media type are compressed.
pub(in crate::api) fn is_compressed(media_type: &str) -> bool {
    let name = media_type.split(';').next().unwrap_or_default();
    TYPES.contains(&name)
}

/// Middleware around [`layer`]: decides whether the client may get a compressed response, and weakens the ETag
/// of such a response.
pub(in crate::api) async fn negotiate(mut request: Request, next: Next) -> Response {
    // A response to HEAD has the length of the stored file.
    let is_wanted = request.method() != Method::HEAD && accepts_gzip(request.headers());
    let permit = is_wanted
        .then(|| PERMITS.clone().try_acquire_owned().ok())
        .flatten();
    let tags = request.headers().get(header::IF_NONE_MATCH);
    let knows_weak = tags.is_some_and(|tags| tags.as_bytes().windows(2).any(|two| two == b"W/"));
    let is_weak_304 = is_wanted && knows_weak;
    let headers = request.headers_mut();
    match permit {
        Some(_) => headers.insert(header::ACCEPT_ENCODING, HeaderValue::from_static("gzip")),
        None => headers.remove(header::ACCEPT_ENCODING),
    };
    let mut response = next.run(request).await;
    if response.status() == StatusCode::NOT_MODIFIED {
        let vary = HeaderValue::from_static("accept-encoding");
        response.headers_mut().append(header::VARY, vary);
    }
    let is_compressed = response.headers().contains_key(header::CONTENT_ENCODING);
    let is_weak = is_compressed || (response.status() == StatusCode::NOT_MODIFIED && is_weak_304);
    if is_weak && let Some(tag) = response.headers_mut().get_mut(header::ETAG) {
        weaken(tag);
    }
    match permit {
        Some(permit) if is_compressed => hold_until_sent(response, permit),
        _ => response,
    }
}

/// Returns whether the client accepts gzip. Any response may be sent without compression, so other codings, and a refusal
/// of that, are ignored.
pub(in crate::api) fn accepts_gzip(headers: &HeaderMap) -> bool {
    let accepted = headers.get_all(header::ACCEPT_ENCODING).iter();
    let accepted = accepted.filter_map(|value| value.to_str().ok());
    let mut accepted = accepted.flat_map(|value| value.split(','));
    accepted.any(|coding| {
        let (name, weight) = coding.split_once(';').unwrap_or((coding, ""));
        let weight = weight.trim().strip_prefix("q=").map(str::parse::<f64>);
        name.trim().eq_ignore_ascii_case("gzip") && weight != Some(Ok(0.0))
    })
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
    fn gzip_is_accepted_unless_its_weight_is_zero() {
        for (accepted, is_accepted) in [
            ("gzip, deflate, br, zstd", true),
            ("GZIP;q=0.5", true),
            ("br, gzip;q=0", false),
            ("gzip; q=0.000", false),
            ("identity;q=0, *;q=0", false),
            ("br", false),
            ("", false),
        ] {
            let value = HeaderValue::from_static(accepted);
            let headers = HeaderMap::from_iter([(header::ACCEPT_ENCODING, value)]);
            assert_eq!(accepts_gzip(&headers), is_accepted, "{accepted}");
        }
    }
}
