//! Signing in from a browser: a token becomes a cookie that scripts cannot read and other sites cannot
//! send (RELIABILITY.md, S7). The row behind it ends with the token, or when somebody signs out.

use axum::body::Body;
use axum::extract::State;
use axum::http::{HeaderMap, Response, StatusCode, header};
use axum::response::{AppendHeaders, IntoResponse};
use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use super::auth::token;
use crate::api::AppState;
use crate::api::extract::Json;
use crate::api::problem::{Problem, ProblemBody};
use crate::api::timestamp::rfc3339;
use crate::jobs::clock::now_ms;

/// A browser asks for the token again after a week.
const SESSION_MS: i64 = 7 * 24 * 3600 * 1000;
/// The cookie's name over plain HTTP, and over HTTPS, where a browser takes it from this host alone.
const NAMES: [&str; 2] = ["flockreel_session", "__Host-flockreel_session"];

/// What signs in.
#[derive(Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub(in crate::api) struct SessionRequest {
    /// A token, `frl_...`.
    token: String,
}

/// Who signed in.
#[derive(Debug, Serialize, ToSchema)]
pub(in crate::api) struct SessionView {
    /// What the token is called.
    name: String,
    /// `read`, `write` or `admin`.
    scope: &'static str,
    /// When the browser will be asked again.
    expires_at: String,
}

/// Sign in: a token for a cookie.
#[utoipa::path(post, path = "/v1/session", request_body = SessionRequest, security(()), responses(
    (status = 201, body = SessionView, headers(("set-cookie" = String))),
    (status = "4XX", body = ProblemBody, content_type = "application/problem+json"),
))]
pub(in crate::api) async fn begin_session(
    State(state): State<AppState>,
    headers: HeaderMap,
    Json(request): Json<SessionRequest>,
) -> Result<Response<Body>, Problem> {
    let token = token(&state, request.token.trim()).await?;
    let now_ms = now_ms();
    let latest_ms = now_ms + SESSION_MS;
    let expires_ms = token
        .expires_ms
        .map_or(latest_ms, |end_ms| end_ms.min(latest_ms));
    let store = &state.context.store;
    let secret = store.begin_session(&token.id, now_ms, expires_ms).await?;
    let is_https = (headers.get("x-forwarded-proto")).is_some_and(|scheme| scheme == "https");
    let (name, secure) = match is_https {
        true => (NAMES[1], "; Secure"),
        false => (NAMES[0], ""),
    };
    let lasts_s = (expires_ms - now_ms) / 1000;
    let cookie =
        format!("{name}={secret}; Path=/; HttpOnly; SameSite=Strict; Max-Age={lasts_s}{secure}");
    let view = SessionView {
        name: token.name,
        scope: token.scope.name(),
        expires_at: rfc3339(expires_ms),
    };
    Ok((
        StatusCode::CREATED,
        [(header::SET_COOKIE, cookie)],
        axum::Json(view),
    )
        .into_response())
}

/// Sign out.
#[utoipa::path(delete, path = "/v1/session", security(()), responses(
    (status = 204, description = "signed out", headers(("set-cookie" = String))),
    (status = "4XX", body = ProblemBody, content_type = "application/problem+json"),
))]
pub(in crate::api) async fn end_session(
    State(state): State<AppState>,
    headers: HeaderMap,
) -> Result<Response<Body>, Problem> {
    if let Some(cookie) = cookie(&headers) {
        state.context.store.end_session(cookie).await?;
    }
    let gone = |name: &str, more| {
        let cookie = format!("{name}=; Path=/; HttpOnly; SameSite=Strict; Max-Age=0{more}");
        (header::SET_COOKIE, cookie)
    };
    let cookies = AppendHeaders([gone(NAMES[0], ""), gone(NAMES[1], "; Secure")]);
    Ok((StatusCode::NO_CONTENT, cookies).into_response())
}

/// The value of our cookie, if the browser sent one.
pub(super) fn cookie(headers: &HeaderMap) -> Option<&str> {
    let values = headers.get_all(header::COOKIE).into_iter();
    let pairs = values
        .filter_map(|value| value.to_str().ok())
        .flat_map(|text| text.split(';'));
    let mut named = pairs.filter_map(|pair| pair.trim().split_once('='));
    let found = named.find(|(name, _)| NAMES.contains(name));
    found.map(|(_, value)| value)
}
