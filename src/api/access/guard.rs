//! Checks of every request, and security headers of every response
//! (docs/explanation/promises.md, "No cross-site writes", "Size limits" and "Nothing served runs as a page").

use axum::extract::{Request, State};
use axum::http::{HeaderMap, HeaderName, HeaderValue, Method, Uri, header};
use axum::middleware::Next;
use axum::response::{IntoResponse, Response};

use crate::api::Problem;
use flockreel_core::code::Code;

/// Content security policy: only resources of this service, nothing inline, and no embedding in frames.
/// `blob:` lets the page show videos that it holds in memory.
const POLICY: &str = "default-src 'none'; script-src 'self'; style-src 'self'; \
    img-src 'self' blob: data:; media-src 'self' blob:; connect-src 'self'; font-src 'self'; \
    manifest-src 'self'; base-uri 'none'; form-action 'self'; frame-ancestors 'none'";

const HEADERS: [(HeaderName, HeaderValue); 6] = [
    (
        header::CONTENT_SECURITY_POLICY,
        HeaderValue::from_static(POLICY),
    ),
    (
        header::X_CONTENT_TYPE_OPTIONS,
        HeaderValue::from_static("nosniff"),
    ),
    (header::X_FRAME_OPTIONS, HeaderValue::from_static("DENY")),
    (
        header::REFERRER_POLICY,
        HeaderValue::from_static("no-referrer"),
    ),
    (
        HeaderName::from_static("cross-origin-resource-policy"),
        HeaderValue::from_static("same-origin"),
    ),
    (
        HeaderName::from_static("cross-origin-opener-policy"),
        HeaderValue::from_static("same-origin"),
    ),
];

/// Longest path and query of a request, bytes. The addresses of this service have about a tenth of it.
const MAX_ADDRESS_BYTES: usize = 8 << 10;

/// Largest total size of all header fields, bytes. The server itself only limits its read buffer. Free
/// choice.
const MAX_FIELDS_BYTES: usize = 32 << 10;

/// Host names that requests may use.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(in crate::api) enum HostNames {
    /// Only loopback names. Local requests need no token, so a foreign host name that resolves to this
    /// machine (DNS rebinding) must be refused.
    Loopback,
    /// Any name. A page under a foreign name has neither token nor cookie.
    Any,
}

/// Middleware: refuses cross-site and oversized requests, and sets the security headers of the response.
pub(in crate::api) async fn guard(
    State(names): State<HostNames>,
    request: Request,
    next: Next,
) -> Response {
    let (method, uri, headers) = (request.method(), request.uri(), request.headers());
    let mut response = match check(names, method, uri, headers) {
        Ok(()) => next.run(request).await,
        Err(problem) => problem.into_response(),
    };
    let headers = response.headers_mut();
    for (name, value) in HEADERS {
        headers.insert(name, value);
    }
    headers
        .entry(header::CACHE_CONTROL)
        .or_insert(HeaderValue::from_static("no-store"));
    response
}

/// Checks sizes, encoding, host name and origin of a request. A write must come from this service's own page,
/// or from a client that is no web page.
fn check(names: HostNames, method: &Method, uri: &Uri, headers: &HeaderMap) -> Result<(), Problem> {
    let address = uri.path_and_query().map_or("", |address| address.as_str());
    if address.len() > MAX_ADDRESS_BYTES {
        return Err(Code::AddressTooLong.into());
    }
    let fields = headers.iter();
    let n_bytes: usize = fields
        .map(|(name, value)| name.as_str().len() + value.len())
        .sum();
    if n_bytes > MAX_FIELDS_BYTES {
        return Err(Code::HeadTooLarge.into());
    }
    // A small compressed body can expand to a huge one, and no body of this API gains from compression.
    if headers.contains_key(header::CONTENT_ENCODING) {
        let sentence = "the body must be sent without Content-Encoding";
        return Err(Problem::new(Code::UnsupportedMediaType, sentence));
    }
    let text = |name: HeaderName| headers.get(name).and_then(|value| value.to_str().ok());
    let host = text(header::HOST).or(uri.authority().map(|authority| authority.as_str()));
    if names == HostNames::Loopback && !host.is_some_and(is_loopback) {
        let sentence = "the host name of the request is not a loopback name: use localhost or 127.0.0.1, or start the \
                        service with `--auth required`";
        return Err(Problem::new(Code::CrossSite, sentence));
    }
    if method.is_safe() {
        return Ok(());
    }
    let site = text(HeaderName::from_static("sec-fetch-site"));
    let origin = text(header::ORIGIN).and_then(|origin| origin.split_once("://"));
    let is_same_site = site.is_none_or(|site| site == "same-origin" || site == "none")
        && (!headers.contains_key(header::ORIGIN)
            || origin.map(|(_, authority)| authority) == host);
    is_same_site
        .then_some(())
        .ok_or_else(|| Code::CrossSite.into())
}

fn is_loopback(host: &str) -> bool {
    let name = match host.rsplit_once(':') {
        Some((name, port)) if port.bytes().all(|byte| byte.is_ascii_digit()) => name,
        _ => host,
    };
    let address = name.trim_start_matches('[').trim_end_matches(']');
    name.eq_ignore_ascii_case("localhost")
        || address
            .parse::<std::net::IpAddr>()
            .is_ok_and(|address| address.is_loopback())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn is_accepted(method: Method, headers: &[(HeaderName, &'static str)]) -> bool {
        let headers = headers
            .iter()
            .map(|(name, value)| (name.clone(), HeaderValue::from_static(value)))
            .collect();
        check(
            HostNames::Loopback,
            &method,
            &Uri::from_static("/"),
            &headers,
        )
        .is_ok()
    }

    #[test]
    fn only_loopback_names_are_accepted() {
        for host in [
            "localhost",
            "LOCALHOST:8080",
            "127.0.0.1:1",
            "[::1]:8080",
            "[::1]",
        ] {
            assert!(is_accepted(Method::GET, &[(header::HOST, host)]), "{host}");
        }
        for host in ["evil.example", "localhost.evil.example:80", "10.0.0.1", ""] {
            assert!(!is_accepted(Method::GET, &[(header::HOST, host)]), "{host}");
        }
        assert!(!is_accepted(Method::GET, &[]));
    }

    #[test]
    fn cross_site_write_is_refused() {
        let host = (header::HOST, "localhost:8080");
        let site = HeaderName::from_static("sec-fetch-site");
        let with = |name: &HeaderName, value| {
            is_accepted(Method::POST, &[host.clone(), (name.clone(), value)])
        };
        assert!(is_accepted(Method::POST, std::slice::from_ref(&host)));
        assert!(with(&header::ORIGIN, "http://localhost:8080"));
        assert!(with(&site, "same-origin"));
        assert!(!with(&header::ORIGIN, "http://localhost:9090"));
        assert!(!with(&header::ORIGIN, "null"));
        assert!(!with(&site, "cross-site"));
        assert!(!with(&site, "same-site"));
    }
}
