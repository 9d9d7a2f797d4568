//! Browser sessions: a token is exchanged for a cookie that scripts cannot read and other sites cannot send
//! (docs/explanation/promises.md, "No cross-site writes"). A session ends after a week, with its token, or
//! when the user signs out.

use std::time::Instant;

use axum::body::Body;
use axum::extract::State;
use axum::http::{HeaderMap, Response, StatusCode, header};
use axum::response::{AppendHeaders, IntoResponse};
use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use super::auth::valid_token;
use super::cookie::{HTTP_NAME, HTTPS_NAME, session_cookie};
use crate::api::AppState;
use crate::api::extract::Json;
use crate::api::problem::{Problem, ProblemBody};
use crate::api::timestamp::rfc3339;
use crate::jobs::clock::now_ms;
use flockreel_core::code::Code;

/// Longest session, ms: one week. Free choice.
const SESSION_MS: i64 = 7 * 24 * 3600 * 1000;

/// Token to sign in with.
#[derive(Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub(in crate::api) struct SessionRequest {
    /// Token of the form `frl_<id>_<secret>`.
    token: String,
}

/// The new session.
#[derive(Debug, Serialize, ToSchema)]
pub(in crate::api) struct SessionView {
    /// Name of the token.
    name: String,
    /// Scope of the token: `read`, `write` or `admin`.
    scope: &'static str,
    /// Time at which the session ends, RFC 3339 in UTC: in a week, or when the token expires.
    expires_at: String,
}

/// Sign in from a browser.
///
/// Exchanges a token for a session cookie. An invalid token fails with `unauthenticated`. Of one token, the latest 64
/// sessions are valid. A proxy that provides HTTPS must send `X-Forwarded-Proto: https`, so that the cookie is marked `Secure`.
#[utoipa::path(post, path = "/v1/session", request_body = SessionRequest, security(()), responses(
    (status = 201, body = SessionView, headers(("set-cookie" = String))),
    (status = "4XX", body = ProblemBody, content_type = "application/problem+json"),
))]
pub(in crate::api) async fn begin_session(
    State(state): State<AppState>,
    headers: HeaderMap,
    Json(request): Json<SessionRequest>,
) -> Result<Response<Body>, Problem> {
    let token = valid_token(&state, request.token.trim()).await?;
    if !state.rates.take_session(&token.account(), Instant::now()) {
        return Err(Code::RateLimited.into());
    }
    let now_ms = now_ms();
    let latest_ms = now_ms + SESSION_MS;
    let expires_ms = token
        .expires_ms
        .map_or(latest_ms, |end_ms| end_ms.min(latest_ms));
    let store = &state.context.store;
    let secret = store.begin_session(&token.id, now_ms, expires_ms).await?;
    let is_https = (headers.get("x-forwarded-proto")).is_some_and(|scheme| scheme == "https");
    let (name, secure) = if is_https {
        (HTTPS_NAME, "; Secure")
    } else {
        (HTTP_NAME, "")
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
///
/// Ends the session and deletes its cookie. Succeeds without a session too.
#[utoipa::path(delete, path = "/v1/session", security(()), responses(
    (status = 204, description = "signed out", headers(("set-cookie" = String))),
    (status = "4XX", body = ProblemBody, content_type = "application/problem+json"),
))]
pub(in crate::api) async fn end_session(
    State(state): State<AppState>,
    headers: HeaderMap,
) -> Result<Response<Body>, Problem> {
    if let Some(cookie) = session_cookie(&headers) {
        state.context.store.end_session(cookie).await?;
    }
    let deleted = |name: &str, more| {
        let cookie = format!("{name}=; Path=/; HttpOnly; SameSite=Strict; Max-Age=0{more}");
        (header::SET_COOKIE, cookie)
    };
    let cookies = AppendHeaders([deleted(HTTP_NAME, ""), deleted(HTTPS_NAME, "; Secure")]);
    Ok((StatusCode::NO_CONTENT, cookies).into_response())
}
