//! The session cookie of a browser: its names, and how it is read from a request.

use axum::http::{HeaderMap, header};

/// Name of the cookie over HTTP.
pub(super) const HTTP_NAME: &str = "flockreel_session";
/// Name of the cookie over HTTPS. Browsers accept a `__Host-` cookie only over HTTPS and only for the exact
/// host.
pub(super) const HTTPS_NAME: &str = "__Host-flockreel_session";

/// Returns the value of the session cookie, if the request has one.
pub(super) fn session_cookie(headers: &HeaderMap) -> Option<&str> {
    let values = headers.get_all(header::COOKIE).into_iter();
    let pairs = values
        .filter_map(|value| value.to_str().ok())
        .flat_map(|text| text.split(';'));
    let mut named = pairs.filter_map(|pair| pair.trim().split_once('='));
    let found = named.find(|(name, _)| [HTTP_NAME, HTTPS_NAME].contains(name));
    found.map(|(_, value)| value)
}
