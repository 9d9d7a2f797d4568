//! Authentication: every request has a [`Caller`], or is refused before its handler runs
//! (docs/explanation/promises.md, "Owners are isolated"). Only the page, its documentation, the probes and
//! signing in are open to all.
//!
//! On loopback a request without a token belongs to the local owner, unless tokens are required.

use std::net::{IpAddr, Ipv4Addr};
use std::time::Instant;

use axum::extract::{MatchedPath, Request, State};
use axum::http::request::Parts;
use axum::http::{HeaderMap, HeaderName, Method, StatusCode, header};
use axum::middleware::Next;
use axum::response::{IntoResponse, Response};

use super::caller::{Caller, Proof};
use super::cookie::session_cookie;
use super::held_body::hold_until_sent;
use super::link::link_caller;
use super::open_requests::Client;
use crate::api::page::PLACES;
use crate::api::{AppState, Problem};
use crate::jobs::clock::now_ms;
use crate::store::owners::Account;
use crate::store::tokens::secret::Presented;
use crate::store::tokens::{Scope, Token};
use flockreel_core::code::Code;

/// Says which of the limits was reached.
const TOO_MANY_OPEN: &str = "too many requests of this client are open at once: close event streams and downloads that are not needed";

/// Address of the other end of the connection. Behind a proxy, it is the address of the proxy.
#[derive(Clone, Copy, Debug)]
pub(in crate::api) struct Peer(pub IpAddr);

/// Middleware: finds the caller of every request, except on open routes. Requests refused with 401 are
/// counted per address; an address with too many of them gets `rate_limited`.
pub(in crate::api) async fn authenticate(
    State(state): State<AppState>,
    request: Request,
    next: Next,
) -> Response {
    let peer = request.extensions().get::<Peer>().copied();
    let Peer(peer) = peer.unwrap_or(Peer(Ipv4Addr::UNSPECIFIED.into()));
    let answer = run_authenticated(&state, peer, request, next).await;
    let is_refused = answer.status() == StatusCode::UNAUTHORIZED;
    if is_refused && !state.rates.take_refusal(peer, Instant::now()) {
        return Problem::from(Code::RateLimited).into_response();
    }
    answer
}

async fn run_authenticated(
    state: &AppState,
    peer: IpAddr,
    request: Request,
    next: Next,
) -> Response {
    if is_open(request.uri().path()) || is_place(&request) {
        let run = next.run(request);
        return run_counted(state, Client::Address(peer), run).await;
    }
    let (mut parts, body) = request.into_parts();
    match caller(state, &parts).await {
        Ok(caller) if !state.rates.take(&caller.account, Instant::now()) => {
            Problem::from(Code::RateLimited).into_response()
        }
        Ok(caller) => {
            let Account { owner, quota } = caller.account.clone();
            parts.extensions.insert(caller);
            let run = next.run(Request::from_parts(parts, body));
            // Local requests without a token have no limits.
            match quota {
                None => run.await,
                Some(_) => run_counted(state, Client::Owner(owner), run).await,
            }
        }
        Err(problem) => problem.into_response(),
    }
}

/// Runs a request that counts as open until its response is sent. Refuses it with `rate_limited` if the client has
/// too many open requests.
async fn run_counted(
    state: &AppState,
    client: Client,
    run: impl Future<Output = Response>,
) -> Response {
    match state.open_requests.open(client) {
        Some(open) => hold_until_sent(run.await, open),
        None => Problem::new(Code::RateLimited, TOO_MANY_OPEN.to_owned()).into_response(),
    }
}

/// Returns whether a request is for a place of the page, which holds no data of owners.
fn is_place(request: &Request) -> bool {
    let route = request.extensions().get::<MatchedPath>();
    route.is_some_and(|route| PLACES.contains(&route.as_str()))
}

/// Returns whether a path needs no caller: the files of the page, the documentation, the probes, and signing in. They hold
/// no data of owners. All paths not listed here need a caller.
fn is_open(path: &str) -> bool {
    let exact = [
        "/docs",
        "/healthz",
        "/readyz",
        "/openapi.json",
        "/v1/errors",
        "/v1/session",
    ];
    let below = ["/static/", "/vendor/", "/docs/"];
    exact.contains(&path) || below.iter().any(|start| path.starts_with(start))
}

async fn caller(state: &AppState, parts: &Parts) -> Result<Caller, Problem> {
    let (method, headers) = (&parts.method, &parts.headers);
    let caller = match bearer(headers) {
        Some(text) => {
            let (token, given) = presented_token(state, text).await?;
            Caller::with_token(&token, Proof::Token(given))
        }
        None => match browser_caller(state, parts).await? {
            Some(caller) => caller,
            None if state.config.requires_tokens() => return Err(Code::Unauthenticated.into()),
            None => Caller::local(),
        },
    };
    if !method.is_safe() && caller.scope < Scope::Write {
        return Err(Code::ScopeTooSmall.into());
    }
    Ok(caller)
}

/// Returns the caller of a signed link or a session cookie, if there is one.
async fn browser_caller(state: &AppState, parts: &Parts) -> Result<Option<Caller>, Problem> {
    match link_caller(state, &parts.method, &parts.uri).await? {
        None => session_caller(state, &parts.method, &parts.headers).await,
        caller => Ok(caller),
    }
}

/// Returns the valid token that `text` represents. Fails with `unauthenticated`.
pub(super) async fn valid_token(state: &AppState, text: &str) -> Result<Token, Problem> {
    presented_token(state, text).await.map(|(token, _)| token)
}

async fn presented_token(state: &AppState, text: &str) -> Result<(Token, Presented), Problem> {
    let refused = || Problem::from(Code::Unauthenticated);
    let given = Presented::parse(text).ok_or_else(refused)?;
    let token = state.context.store.token(&given, now_ms()).await?;
    Ok((token.ok_or_else(refused)?, given))
}

/// Returns the caller of a session cookie, if there is one. A browser also adds the cookie to requests of
/// other sites, but then names the site. A write therefore fails with `cross_site` unless it names its
/// origin, which `guard` has checked.
async fn session_caller(
    state: &AppState,
    method: &Method,
    headers: &HeaderMap,
) -> Result<Option<Caller>, Problem> {
    let Some(cookie) = session_cookie(headers) else {
        return Ok(None);
    };
    let token = state.context.store.token_of_session(cookie, now_ms());
    let Some(token) = token.await? else {
        return Ok(None);
    };
    let names_origin = headers.contains_key(header::ORIGIN)
        || headers.contains_key(HeaderName::from_static("sec-fetch-site"));
    if !method.is_safe() && !names_origin {
        return Err(Code::CrossSite.into());
    }
    Ok(Some(Caller::with_token(
        &token,
        Proof::Cookie(cookie.to_owned()),
    )))
}

/// Returns the text after `Bearer`. Other schemes are ignored, because they may be meant for a proxy.
fn bearer(headers: &HeaderMap) -> Option<&str> {
    let value = headers.get(header::AUTHORIZATION)?.to_str().ok()?;
    let (scheme, text) = value.split_once(' ')?;
    scheme.eq_ignore_ascii_case("bearer").then_some(text.trim())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn paths_not_listed_need_a_caller() {
        for path in [
            "/static/js/main.js",
            "/vendor/x.js",
            "/v1/session",
            "/healthz",
        ] {
            assert!(is_open(path), "{path}");
        }
        for path in [
            "/v1/jobs",
            "/v1/session/x",
            "/static",
            "/metrics",
            "//",
            "/Static/x",
        ] {
            assert!(!is_open(path), "{path}");
        }
    }

    #[test]
    fn other_schemes_than_bearer_are_ignored() {
        let of = |value: &'static str| {
            let value = axum::http::HeaderValue::from_static(value);
            let headers = HeaderMap::from_iter([(header::AUTHORIZATION, value)]);
            bearer(&headers).map(str::to_owned)
        };
        assert_eq!(of("Bearer x"), Some("x".to_owned()));
        assert_eq!(of("bEARER  x "), Some("x".to_owned()));
        assert_eq!(of("Basic eDp5"), None);
        assert_eq!(of("Bearer"), None);
    }
}
