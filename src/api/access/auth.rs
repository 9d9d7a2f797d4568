//! Tokens at the door: every request beyond the page and the probes has a caller, or is refused before
//! its handler (RELIABILITY.md, S6). On loopback a request without a token is the local owner's, unless
//! tokens are demanded. What a handler may see and to whom it charges comes from its [`Caller`] alone.

use std::time::Instant;

use axum::extract::{FromRequestParts, Request, State};
use axum::http::request::Parts;
use axum::http::{HeaderMap, HeaderName, Method, header};
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
}

impl Caller {
    /// Whoever asks on the machine itself.
    fn local() -> Caller {
        Caller {
            reach: Reach::Of(Owner::local()),
            account: Account::local(),
            scope: Scope::Write,
        }
    }

    /// Whoever holds a signed link: `link` lets it no further than its path.
    pub(super) fn of_link() -> Caller {
        Caller {
            reach: Reach::All,
            account: Account {
                owner: Owner("link".to_owned()),
                quota: Some(0),
            },
            scope: Scope::Read,
        }
    }

    fn of(token: &Token) -> Caller {
        Caller {
            reach: token.reach(),
            account: token.account(),
            scope: token.scope,
        }
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

/// Finds the caller of every request that is not open to all.
pub(in crate::api) async fn authenticate(
    State(state): State<AppState>,
    request: Request,
    next: Next,
) -> Response {
    if is_open(request.uri().path()) {
        return next.run(request).await;
    }
    let (mut parts, body) = request.into_parts();
    match caller(&state, &parts).await {
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
    let exact = ["/", "/healthz", "/readyz", "/openapi.json", "/v1/session"];
    let below = ["/static/", "/vendor/", "/docs/"];
    exact.contains(&path) || below.iter().any(|start| path.starts_with(start))
}

async fn caller(state: &AppState, parts: &Parts) -> Result<Caller, Problem> {
    let (method, headers) = (&parts.method, &parts.headers);
    let caller = match bearer(headers) {
        Some(text) => Caller::of(&token(state, text).await?),
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
    let refused = || Problem::from(Code::Unauthenticated);
    let given = Presented::parse(text).ok_or_else(refused)?;
    let token = state.context.store.token(&given, now_ms()).await?;
    token.ok_or_else(refused)
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
    Ok(Some(Caller::of(&token)))
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
