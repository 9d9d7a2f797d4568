//! HTTP requests to the whole service, without a network: the router with a database and files of its own. No request may
//! cause an internal error, and refusals are problem documents.

mod stored; // the service and its data

use std::convert::Infallible;
use std::time::Duration;

use axum::body::{Body, to_bytes};
use axum::http::{HeaderMap, HeaderName, HeaderValue, Method, Request, StatusCode, header};
use serde_json::{Value, json};

use self::stored::{FILM, Reply, with_service};

/// Longest wait for the body of a response. Streams of events never end.
const BODY_TIMEOUT: Duration = Duration::from_millis(200);
/// Largest body of a response that is read, bytes.
const MAX_BODY_BYTES: usize = 8 << 20;

/// A request as text: a line with method and address, header lines, an empty line, and the body. The words FOOTAGE,
/// LIBRARY, FLOCK, FISH, JOB and UPLOAD in an address or body stand for ids of stored things.
pub(super) fn request(bytes: &[u8]) {
    let (head, body) = match bytes.windows(2).position(|two| two == b"\n\n") {
        Some(at) => (&bytes[..at], &bytes[at + 2..]),
        None => (bytes, &[][..]),
    };
    let mut lines = head.split(|&byte| byte == b'\n');
    let first = lines
        .next()
        .map(String::from_utf8_lossy)
        .unwrap_or_default();
    let Some((method, address)) = first.split_once(' ') else {
        return;
    };
    with_service(|service| {
        let address = service.with_ids(address.trim());
        let body = match std::str::from_utf8(body) {
            Ok(text) => service.with_ids(text).into_bytes(),
            Err(_) => body.to_vec(),
        };
        let mut request = Request::builder().method(method).uri(address);
        for (name, value) in lines.filter_map(header_of) {
            // A wait for a job would take up to a minute, because nothing runs jobs here.
            if name.as_str() != "prefer" {
                request = request.header(name, value);
            }
        }
        if let Ok(request) = request.body(Body::from(body)) {
            assert_sound(&service.send(request));
        }
    });
}

fn header_of(line: &[u8]) -> Option<(HeaderName, HeaderValue)> {
    let at = line.iter().position(|&byte| byte == b':')?;
    let name = HeaderName::from_bytes(&line[..at]).ok()?;
    let value = HeaderValue::from_bytes(line[at + 1..].trim_ascii()).ok()?;
    Some((name, value))
}

/// A form: a line with address and media type, and the body. It is sent at once, or in small pieces.
pub(super) fn form(bytes: &[u8]) {
    let (line, body) = match bytes.iter().position(|&byte| byte == b'\n') {
        Some(at) => (&bytes[..at], &bytes[at + 1..]),
        None => (bytes, &[][..]),
    };
    let line = String::from_utf8_lossy(line);
    let (address, media_type) = line.split_once(' ').unwrap_or(("/v1/footage", &line));
    let step = if bytes.len().is_multiple_of(2) {
        7
    } else {
        1 << 16
    };
    let pieces: Vec<Result<Vec<u8>, Infallible>> =
        body.chunks(step).map(|piece| Ok(piece.to_vec())).collect();
    let body = Body::from_stream(futures_util::stream::iter(pieces));
    let request = Request::post(address).header(header::CONTENT_TYPE, media_type);
    if let Ok(request) = request.body(body) {
        with_service(|service| assert_sound(&service.send(request)));
    }
}

/// Header lines of a download, after a line HEAD or GET. The response has exactly the bytes that it claims.
pub(super) fn range(bytes: &[u8]) {
    let mut lines = bytes.split(|&byte| byte == b'\n').peekable();
    let is_head = lines.next_if(|line| line.trim_ascii() == b"HEAD").is_some();
    let method = if is_head { Method::HEAD } else { Method::GET };
    with_service(|service| {
        let address = service.with_ids("/v1/footage/FOOTAGE/file");
        let mut request = Request::builder().method(method.clone()).uri(address);
        for (name, value) in lines.filter_map(header_of) {
            if name.as_str() != "authorization" {
                request = request.header(name, value);
            }
        }
        let Ok(request) = request.body(Body::empty()) else {
            return;
        };
        let reply = service.send(request);
        assert_sound(&reply);
        let length = reply
            .text(header::CONTENT_LENGTH)
            .and_then(|text| text.parse().ok());
        let wanted = match reply.status {
            StatusCode::OK => 0..FILM.len(),
            StatusCode::PARTIAL_CONTENT => range_of(&reply.headers),
            _ => return,
        };
        assert!(
            length == Some(wanted.len()),
            "Content-Length of {wanted:?}: {length:?}"
        );
        if method == Method::GET {
            assert!(
                reply.body == FILM[wanted.clone()],
                "other bytes than {wanted:?}"
            );
        }
    });
}

/// Returns the bytes that Content-Range names.
fn range_of(headers: &HeaderMap) -> std::ops::Range<usize> {
    let text = headers[header::CONTENT_RANGE].to_str().expect("a text");
    let (range, size) = text
        .strip_prefix("bytes ")
        .and_then(|text| text.split_once('/'))
        .expect(text);
    let (first, last) = range.split_once('-').expect(text);
    let number = |text: &str| text.parse::<usize>().expect(text);
    assert!(number(size) == FILM.len(), "{text}");
    number(first)..number(last) + 1
}

/// The name of a film. It becomes a label and a part of Content-Disposition, which must parse (RFC 6266, RFC 8187).
pub(super) fn names(bytes: &[u8]) {
    let name = String::from_utf8_lossy(bytes);
    with_service(|service| {
        let address = service.with_ids("/v1/footage/FOOTAGE");
        let request = Request::patch(&address).header(header::CONTENT_TYPE, "application/json");
        let body = Body::from(json!({"name": name}).to_string());
        let reply = service.send_keeping(request.body(body).expect("a request"));
        assert_sound(&reply);
        if reply.status != StatusCode::OK {
            return;
        }
        let view: Value = serde_json::from_slice(&reply.body).expect("JSON");
        let label = view["name"].as_str().expect("a name").to_owned();
        assert!(
            label.chars().count() <= 200 && !label.contains(['/', '\\']),
            "{label:?}"
        );
        assert!(!label.chars().any(char::is_control), "{label:?}");
        for file in ["file", "poster.jpg"] {
            let request = Request::get(format!("{address}/{file}")).body(Body::empty());
            let reply = service.send(request.expect("a request"));
            assert_sound(&reply);
            if let Some(value) = reply.text(header::CONTENT_DISPOSITION) {
                assert_disposition(value, (file == "file").then_some(&*label));
            }
        }
    });
}

/// Checks the syntax of Content-Disposition, and that its encoded name is the label.
fn assert_disposition(value: &str, label: Option<&str>) {
    let parts = value.split_once("; filename=\"");
    let (kind, rest) = parts.expect(value);
    let (plain, encoded) = rest.split_once("\"; filename*=UTF-8''").expect(value);
    assert!(["inline", "attachment"].contains(&kind), "{value}");
    let is_plain = |c: char| c.is_ascii_alphanumeric() || "._- ".contains(c);
    assert!(plain.chars().all(is_plain), "{value}");
    let mut decoded = Vec::new();
    let mut bytes = encoded.bytes();
    while let Some(byte) = bytes.next() {
        match byte {
            b'%' => {
                let digits = [bytes.next(), bytes.next()].map(|digit| digit.expect(value));
                let digits = std::str::from_utf8(&digits).expect(value).to_owned();
                decoded.push(u8::from_str_radix(&digits, 16).expect(value));
            }
            byte => {
                assert!(
                    byte.is_ascii_alphanumeric() || b"._-".contains(&byte),
                    "{value}"
                );
                decoded.push(byte);
            }
        }
    }
    let decoded = String::from_utf8(decoded).expect(value);
    assert!(label.is_none_or(|label| label == decoded), "{value}");
}

/// Checks that a response is no internal error, has the security headers, and is a problem document if it is a refusal.
fn assert_sound(reply: &Reply) {
    let text = String::from_utf8_lossy(&reply.body);
    let status = reply.status;
    assert!(status != StatusCode::INTERNAL_SERVER_ERROR, "{text}");
    assert!(
        reply.headers.contains_key(header::CONTENT_SECURITY_POLICY),
        "{status}"
    );
    if status.is_client_error() || status.is_server_error() {
        let is_page = reply
            .text(header::CONTENT_TYPE)
            .is_some_and(|kind| kind.starts_with("text/html"));
        if !reply.is_head && !is_page {
            let problem: Value = serde_json::from_slice(&reply.body).expect("a problem document");
            assert!(
                problem["status"] == status.as_u16() && problem["code"].is_string(),
                "{text}"
            );
        }
    }
}

/// Reads the body of a response. Returns what came until the time is up.
async fn read(body: Body) -> Vec<u8> {
    let bytes = tokio::time::timeout(BODY_TIMEOUT, to_bytes(body, MAX_BODY_BYTES)).await;
    bytes.map_or(Vec::new(), |bytes| bytes.map_or(Vec::new(), Vec::from))
}
