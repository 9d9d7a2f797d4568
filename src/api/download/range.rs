//! Which bytes of a file are asked for (RFC 9110, 14; RELIABILITY.md, H4). Pure: headers in, a
//! decision out. Several ranges at once are answered with the whole file, as the RFC allows.

use axum::http::{HeaderMap, Method, header};

/// What to send.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) enum Wanted {
    /// All of it.
    Whole,
    /// `first..=last`, within the file.
    Part {
        /// The first byte.
        first: u64,
        /// The last byte.
        last: u64,
    },
    /// Nothing: the client has it already.
    NotModified,
    /// Nothing: the file is shorter than that.
    Unsatisfiable,
}

/// What a request wants of a file of `size_bytes` with the strong entity tag `etag` (with quotes).
pub(super) fn wanted(method: &Method, headers: &HeaderMap, etag: &str, size_bytes: u64) -> Wanted {
    if header_of(headers, header::IF_NONE_MATCH).is_some_and(|tags| matches(tags, etag)) {
        return Wanted::NotModified;
    }
    // Ranges are defined for GET alone; a stale If-Range asks for the whole new file.
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

/// Weak comparison, as If-None-Match wants it.
fn matches(tags: &str, etag: &str) -> bool {
    tags.split(',')
        .map(str::trim)
        .any(|tag| tag == "*" || tag.strip_prefix("W/").unwrap_or(tag) == etag)
}

/// What cannot be read is ignored, as the RFC says.
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
        // Beyond 64 bits is beyond any file.
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
    fn a_range_is_read_as_the_rfc_reads_it() {
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
    fn no_byte_of_an_empty_file_can_be_asked_for() {
        assert_eq!(parse("bytes=0-", 0), Wanted::Unsatisfiable);
        assert_eq!(parse("bytes=-5", 0), Wanted::Unsatisfiable);
    }
}
