//! Tokens at the door: every request beyond the page and the probes has a caller, or is refused before
//! its handler (RELIABILITY.md, S6). On loopback a request without a token is the local owner's, unless
//! tokens are demanded. What a handler may see and to whom it charges comes from its [`Caller`] alone.

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

/// Who asks: taken by every handler that reads or writes what somebody owns.
#[derive(Clone, Debug)]
pub(in crate::api) struct Caller {
    /// Whose things are there for this request.
    pub reach: Reach,
    /// Whose what it makes will be.
    pub account: Account,
    scope: Scope,
    proof: Proof,
}

/// With what a caller showed who asks: it is asked for again while an answer goes on.
#[derive(Clone)]
enum Proof {
    /// Nothing: on the machine itself.
    Nothing,
    /// A signed link.
    Link,
    /// A token.
    Token(Presented),
    /// A browser's cookie.
    Cookie(String),
}

impl std::fmt::Debug for Proof {
    /// Its kind alone: secrets do not get into logs.
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
    /// Whoever asks on the machine itself.
    fn local() -> Caller {
        Caller {
            reach: Reach::Of(Owner::local()),
            account: Account::local(),
            scope: Scope::Write,
            proof: Proof::Nothing,
        }
    }

    /// Whoever holds a signed link, which `link` lets no further than its path: what is there belongs to
    /// that owner, and nothing else is in reach.
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

    /// Whether the caller may see how the service does: whoever is on the machine itself without a token,
    /// and administrators.
    pub(in crate::api) fn runs_the_service(&self) -> bool {
        matches!(self.proof, Proof::Nothing) || self.scope == Scope::Admin
    }

    /// Whether the caller would be let in again: the token has neither ended nor been revoked, nobody
    /// signed out.
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
            tracing::error!("a route asks for its caller and is open to all");
            Code::Internal.into()
        })
    }
}

/// The address at the other end of the connection: a proxy's, where there is one.
#[derive(Clone, Copy, Debug)]
pub(in crate::api) struct Peer(pub IpAddr);

/// Finds the caller of every request that is not open to all. Refusals are counted for each address.
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

/// What holds nobody's data: the page, its description, the probes, and the way to sign in. Everything
/// that is not named here needs a caller.
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
            None if state.config.demands_tokens() => return Err(Code::Unauthenticated.into()),
            None => Caller::local(),
        },
    };
    if !method.is_safe() && caller.scope < Scope::Write {
        return Err(Code::ScopeTooSmall.into());
    }
    Ok(caller)
}

/// Whoever has a signed link or a cookie.
async fn of_browser(state: &AppState, parts: &Parts) -> Result<Option<Caller>, Problem> {
    match caller_of_link(state, &parts.method, &parts.uri).await? {
        None => of_session(state, &parts.method, &parts.headers).await,
        caller => Ok(caller),
    }
}

/// The good token of this text, or 401.
pub(super) async fn token(state: &AppState, text: &str) -> Result<Token, Problem> {
    presented(state, text).await.map(|(token, _)| token)
}

async fn presented(state: &AppState, text: &str) -> Result<(Token, Presented), Problem> {
    let refused = || Problem::from(Code::Unauthenticated);
    let given = Presented::parse(text).ok_or_else(refused)?;
    let token = state.context.store.token(&given, now_ms()).await?;
    Ok((token.ok_or_else(refused)?, given))
}

/// The caller that a browser's cookie stands for. A write must say that it comes from our own page: a
/// browser adds the cookie whoever asks, and says so; what does not say so is no browser's doing.
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

/// The text after `Bearer`; another scheme is a proxy's affair.
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
