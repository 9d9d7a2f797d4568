//! What holds on every route: who may ask from a browser, and the headers of every answer
//! (RELIABILITY.md, S5, S7 and H2).

use axum::extract::{Request, State};
use axum::http::{HeaderMap, HeaderName, HeaderValue, Method, Uri, header};
use axum::middleware::Next;
use axum::response::{IntoResponse, Response};

use crate::api::Problem;
use crate::code::Code;

/// Nothing from elsewhere, nothing inline, in nobody's frame. Videos of our own may be shown from
/// memory (`blob:`).
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

/// The longest address that is read, bytes: ours are a tenth of that.
const MAX_ADDRESS_BYTES: usize = 8 << 10;

/// The largest sum of all header fields, bytes. The server's own bound is on what it reads at once.
const MAX_FIELDS_BYTES: usize = 32 << 10;

/// The names under which the service may be asked for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(in crate::api) enum Names {
    /// This machine's own: whoever reaches it needs no token, so another site's name that was made to
    /// point here must not.
    Loopback,
    /// Any: a page under another name has neither token nor cookie.
    Any,
}

/// Refuses what another site makes a browser ask for, and sets the headers.
pub(in crate::api) async fn guard(
    State(names): State<Names>,
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

/// The name must be one of ours. A write must come from our own page or from no page at all.
fn check(names: Names, method: &Method, uri: &Uri, headers: &HeaderMap) -> Result<(), Problem> {
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
    // What is packed small may unfold large, and nothing that is sent here is worth packing.
    if headers.contains_key(header::CONTENT_ENCODING) {
        let sentence = "a body is sent as it is, without Content-Encoding";
        return Err(Problem::new(Code::UnsupportedMediaType, sentence));
    }
    let text = |name: HeaderName| headers.get(name).and_then(|value| value.to_str().ok());
    let host = text(header::HOST).or(uri.authority().map(|authority| authority.as_str()));
    if names == Names::Loopback && !host.is_some_and(is_loopback) {
        let sentence = "the service is asked for under a name that is not this machine's own";
        return Err(Problem::new(Code::CrossSite, sentence));
    }
    if method.is_safe() {
        return Ok(());
    }
    let site = text(HeaderName::from_static("sec-fetch-site"));
    let origin = text(header::ORIGIN).and_then(|origin| origin.split_once("://"));
    let is_ours = site.is_none_or(|site| site == "same-origin" || site == "none")
        && match (headers.contains_key(header::ORIGIN), origin) {
            (false, _) => true,
            (true, origin) => origin.map(|(_, authority)| authority) == host,
        };
    is_ours.then_some(()).ok_or_else(|| Code::CrossSite.into())
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

    fn asks(method: Method, headers: &[(HeaderName, &'static str)]) -> bool {
        let headers = headers
            .iter()
            .map(|(name, value)| (name.clone(), HeaderValue::from_static(value)))
            .collect();
        check(Names::Loopback, &method, &Uri::from_static("/"), &headers).is_ok()
    }

    #[test]
    fn only_names_of_this_machine_are_answered() {
        for host in [
            "localhost",
            "LOCALHOST:8080",
            "127.0.0.1:1",
            "[::1]:8080",
            "[::1]",
        ] {
            assert!(asks(Method::GET, &[(header::HOST, host)]), "{host}");
        }
        for host in ["evil.example", "localhost.evil.example:80", "10.0.0.1", ""] {
            assert!(!asks(Method::GET, &[(header::HOST, host)]), "{host}");
        }
        assert!(!asks(Method::GET, &[]));
    }

    #[test]
    fn a_write_from_another_site_is_refused() {
        let host = (header::HOST, "localhost:8080");
        let site = HeaderName::from_static("sec-fetch-site");
        let with =
            |name: &HeaderName, value| asks(Method::POST, &[host.clone(), (name.clone(), value)]);
        assert!(asks(Method::POST, std::slice::from_ref(&host)));
        assert!(with(&header::ORIGIN, "http://localhost:8080"));
        assert!(with(&site, "same-origin"));
        assert!(!with(&header::ORIGIN, "http://localhost:9090"));
        assert!(!with(&header::ORIGIN, "null"));
        assert!(!with(&site, "cross-site"));
        assert!(!with(&site, "same-site"));
    }
}
