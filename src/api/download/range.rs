//! Range and conditional requests: which bytes of a file to send (RFC 9110, sections 13 and 14;
//! docs/explanation/promises.md, "Exact ranges").
//!
//! The decision depends only on the headers. A request for several ranges gets the whole file, as the RFC
//! permits.

use axum::http::{HeaderMap, Method, header};

/// The part of a file to send.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) enum Wanted {
    /// The whole file.
    Whole,
    /// Bytes `first..=last`, all within the file.
    Part {
        /// First byte.
        first: u64,
        /// Last byte.
        last: u64,
    },
    /// Nothing: the client already has this version.
    NotModified,
    /// Nothing: the range starts past the end of the file, or is empty.
    Unsatisfiable,
}

/// Returns which part of a file a request asks for. `etag` is the strong entity tag of the file, with quotes,
/// and `size_bytes` its size.
pub(super) fn wanted(method: &Method, headers: &HeaderMap, etag: &str, size_bytes: u64) -> Wanted {
    if header_of(headers, header::IF_NONE_MATCH).is_some_and(|tags| matches(tags, etag)) {
        return Wanted::NotModified;
    }
    // Ranges apply only to GET. With an outdated If-Range the client gets the whole new file.
    let if_range = header_of(headers, header::IF_RANGE);
    match header_of(headers, header::RANGE) {
        Some(range) if method == Method::GET && if_range.is_none_or(|tag| tag == etag) => {
            parse(range, size_bytes)
        }
        _ => Wanted::Whole,
    }
}

fn header_of(headers: &HeaderMap, name: header::HeaderName) -> Option<&str> {
    headers.get(name)?.to_str().ok()
}

/// Returns whether a list of tags contains `etag`, by the weak comparison that If-None-Match uses.
pub(in crate::api) fn matches(tags: &str, etag: &str) -> bool {
    tags.split(',')
        .map(str::trim)
        .any(|tag| tag == "*" || tag.strip_prefix("W/").unwrap_or(tag) == etag)
}

/// Parses a Range header. A malformed one is ignored, as the RFC permits.
fn parse(range: &str, size_bytes: u64) -> Wanted {
    let Some((first, last)) = range
        .trim()
        .strip_prefix("bytes=")
        .filter(|set| !set.contains(','))
        .and_then(|set| set.trim().split_once('-'))
    else {
        return Wanted::Whole;
    };
    let number = |text: &str| -> Option<u64> {
        let digits = !text.is_empty() && text.bytes().all(|byte| byte.is_ascii_digit());
        // A number of more than 64 bits lies past the end of any file.
        digits.then(|| text.parse().unwrap_or(u64::MAX))
    };
    let (first, last) = match (number(first), number(last)) {
        (Some(first), Some(last)) if first > last => return Wanted::Whole,
        (Some(first), Some(last)) => (first, last),
        (Some(first), None) if last.is_empty() => (first, u64::MAX),
        (None, Some(0)) if first.is_empty() => return Wanted::Unsatisfiable,
        (None, Some(suffix)) if first.is_empty() => (size_bytes.saturating_sub(suffix), u64::MAX),
        _ => return Wanted::Whole,
    };
    if first >= size_bytes {
        return Wanted::Unsatisfiable;
    }
    Wanted::Part {
        first,
        last: last.min(size_bytes - 1),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ranges_are_parsed_as_rfc_9110_says() {
        let part = |first, last| Wanted::Part { first, last };
        for (range, expected) in [
            ("bytes=0-0", part(0, 0)),
            ("bytes=2-5", part(2, 5)),
            ("bytes=2-", part(2, 9)),
            ("bytes=2-99", part(2, 9)),
            ("bytes=-3", part(7, 9)),
            ("bytes=-99", part(0, 9)),
            ("bytes=9-18446744073709551616", part(9, 9)),
            ("bytes=10-", Wanted::Unsatisfiable),
            ("bytes=-0", Wanted::Unsatisfiable),
            ("bytes=5-2", Wanted::Whole),
            ("bytes=0-1,4-5", Wanted::Whole),
            ("bytes=+1-2", Wanted::Whole),
            ("bytes=-", Wanted::Whole),
            ("lines=0-1", Wanted::Whole),
        ] {
            assert_eq!(parse(range, 10), expected, "{range}");
        }
    }

    #[test]
    fn ranges_of_an_empty_file_are_unsatisfiable() {
        assert_eq!(parse("bytes=0-", 0), Wanted::Unsatisfiable);
        assert_eq!(parse("bytes=-5", 0), Wanted::Unsatisfiable);
    }
}
