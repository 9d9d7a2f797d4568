//! Authentication: every request has a [`Caller`], or is refused before its handler runs
//! (docs/explanation/promises.md, "Owners are isolated"). Only the page, its documentation, the probes and
//! signing in are open to all.
//!
//! On loopback a request without a token belongs to the local owner, unless tokens are required. The caller
//! is the only source of the data that a handler may read and of the account that it charges.

use std::net::{IpAddr, Ipv4Addr};
use std::time::Instant;

use axum::extract::{FromRequestParts, Request, State};
use axum::http::request::Parts;
use axum::http::{HeaderMap, HeaderName, Method, StatusCode, header};
use axum::middleware::Next;
use axum::response::{IntoResponse, Response};

use super::link::caller_of_link;
use super::session::cookie;
use crate::api::{AppState, Problem};
use crate::code::Code;
use crate::jobs::clock::now_ms;
use crate::store::owners::{Account, Owner, Reach};
use crate::store::tokens::secret::Presented;
use crate::store::tokens::{Scope, Token};

/// The authenticated sender of a request. Every handler that reads or writes data of an owner takes it.
#[derive(Clone, Debug)]
pub(in crate::api) struct Caller {
    /// Owners whose data this request can access.
    pub reach: Reach,
    /// Owner and quota of everything that this request creates.
    pub account: Account,
    scope: Scope,
    proof: Proof,
}

/// Credential of a caller. Long responses check it again while they run.
#[derive(Clone)]
enum Proof {
    /// None: a local request.
    Nothing,
    /// A signed link.
    Link,
    /// A token.
    Token(Presented),
    /// The session cookie of a browser.
    Cookie(String),
}

impl std::fmt::Debug for Proof {
    /// Writes only the kind of credential, because secrets must not get into logs.
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(match self {
            Proof::Nothing => "nothing",
            Proof::Link => "link",
            Proof::Token(_) => "token",
            Proof::Cookie(_) => "cookie",
        })
    }
}

impl Caller {
    /// Returns the caller of a local request without a token.
    fn local() -> Caller {
        Caller {
            reach: Reach::Of(Owner::local()),
            account: Account::local(),
            scope: Scope::Write,
            proof: Proof::Nothing,
        }
    }

    /// Returns the caller of a signed link to data of `owner`. The caller can only read. `link` has checked
    /// that the signature covers the path of the request.
    pub(super) fn of_link(owner: Owner) -> Caller {
        Caller {
            reach: Reach::Of(owner),
            account: Account {
                owner: Owner("link".to_owned()),
                quota: Some(0),
            },
            scope: Scope::Read,
            proof: Proof::Link,
        }
    }

    fn of(token: &Token, proof: Proof) -> Caller {
        Caller {
            reach: token.reach(),
            account: token.account(),
            scope: token.scope,
            proof,
        }
    }

    /// Returns whether the caller may read the metrics of the service: a local request without a token, or an
    /// administrator.
    pub(in crate::api) fn runs_the_service(&self) -> bool {
        matches!(self.proof, Proof::Nothing) || self.scope == Scope::Admin
    }

    /// Returns whether the credential is still valid: the token has not expired or been revoked, and the
    /// session has not ended. Returns false if the store cannot tell.
    pub(in crate::api) async fn is_still_good(&self, state: &AppState) -> bool {
        let store = &state.context.store;
        let token = match &self.proof {
            Proof::Nothing | Proof::Link => return true,
            Proof::Token(given) => store.token(given, now_ms()).await,
            Proof::Cookie(cookie) => store.token_of_session(cookie, now_ms()).await,
        };
        matches!(token, Ok(Some(_)))
    }
}

impl<S: Send + Sync> FromRequestParts<S> for Caller {
    type Rejection = Problem;

    async fn from_request_parts(parts: &mut Parts, _: &S) -> Result<Caller, Problem> {
        let caller = parts.extensions.get::<Caller>().cloned();
        caller.ok_or_else(|| {
            tracing::error!("an open route requires a caller: the route table is wrong");
            Code::Internal.into()
        })
    }
}

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
    let answer = let_in(&state, request, next).await;
    let Peer(peer) = peer.unwrap_or(Peer(Ipv4Addr::UNSPECIFIED.into()));
    let is_refused = answer.status() == StatusCode::UNAUTHORIZED;
    match is_refused && !state.rates.take_refusal(peer, Instant::now()) {
        true => Problem::from(Code::RateLimited).into_response(),
        false => answer,
    }
}

async fn let_in(state: &AppState, request: Request, next: Next) -> Response {
    if is_open(request.uri().path()) {
        return next.run(request).await;
    }
    let (mut parts, body) = request.into_parts();
    match caller(state, &parts).await {
        Ok(caller) if !state.rates.take(&caller.account, Instant::now()) => {
            Problem::from(Code::RateLimited).into_response()
        }
        Ok(caller) => {
            parts.extensions.insert(caller);
            next.run(Request::from_parts(parts, body)).await
        }
        Err(problem) => problem.into_response(),
    }
}

/// Returns whether a path needs no caller: the page, the documentation, the probes, and signing in. They hold
/// no data of owners. All paths not listed here need a caller.
fn is_open(path: &str) -> bool {
    let exact = [
        "/",
        "/docs",
        "/healthz",
        "/readyz",
        "/openapi.json",
        "/v1/session",
    ];
    let below = ["/static/", "/vendor/", "/docs/"];
    exact.contains(&path) || below.iter().any(|start| path.starts_with(start))
}

async fn caller(state: &AppState, parts: &Parts) -> Result<Caller, Problem> {
    let (method, headers) = (&parts.method, &parts.headers);
    let caller = match bearer(headers) {
        Some(text) => {
            let (token, given) = presented(state, text).await?;
            Caller::of(&token, Proof::Token(given))
        }
        None => match of_browser(state, parts).await? {
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
async fn of_browser(state: &AppState, parts: &Parts) -> Result<Option<Caller>, Problem> {
    match caller_of_link(state, &parts.method, &parts.uri).await? {
        None => of_session(state, &parts.method, &parts.headers).await,
        caller => Ok(caller),
    }
}

/// Returns the valid token that `text` represents. Fails with `unauthenticated`.
pub(super) async fn token(state: &AppState, text: &str) -> Result<Token, Problem> {
    presented(state, text).await.map(|(token, _)| token)
}

async fn presented(state: &AppState, text: &str) -> Result<(Token, Presented), Problem> {
    let refused = || Problem::from(Code::Unauthenticated);
    let given = Presented::parse(text).ok_or_else(refused)?;
    let token = state.context.store.token(&given, now_ms()).await?;
    Ok((token.ok_or_else(refused)?, given))
}

/// Returns the caller of a session cookie, if there is one. A browser also adds the cookie to requests of
/// other sites, but then names the site. A write therefore fails with `cross_site` unless it names its
/// origin, which `guard` has checked.
async fn of_session(
    state: &AppState,
    method: &Method,
    headers: &HeaderMap,
) -> Result<Option<Caller>, Problem> {
    let Some(cookie) = cookie(headers) else {
        return Ok(None);
    };
    let token = state.context.store.token_of_session(cookie, now_ms());
    let Some(token) = token.await? else {
        return Ok(None);
    };
    let says_from_where = headers.contains_key(header::ORIGIN)
        || headers.contains_key(HeaderName::from_static("sec-fetch-site"));
    if !method.is_safe() && !says_from_where {
        return Err(Code::CrossSite.into());
    }
    Ok(Some(Caller::of(&token, Proof::Cookie(cookie.to_owned()))))
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
    fn what_is_not_named_is_closed() {
        for path in [
            "/",
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
    fn only_the_bearer_scheme_is_ours() {
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
