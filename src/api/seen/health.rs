//! Whether the process lives, and whether it can work.

use axum::extract::State;
use axum::http::StatusCode;
use serde::Serialize;
use utoipa::ToSchema;

use crate::api::AppState;

/// What the service needs, and whether it has it.
#[derive(Debug, Serialize, ToSchema)]
pub(in crate::api) struct Readiness {
    /// Whether all below is well.
    ready: bool,
    /// Whether the database can be written.
    database: bool,
    /// The version of the media tool; null when it is missing.
    media_tool: Option<String>,
}

/// The process lives.
#[utoipa::path(get, path = "/healthz", security(()), responses((status = 200, body = str)))]
pub(in crate::api) async fn healthz() -> &'static str {
    "ok\n"
}

/// The service can take work.
#[utoipa::path(get, path = "/readyz", security(()), responses(
    (status = 200, body = Readiness),
    (status = 503, body = Readiness),
))]
pub(in crate::api) async fn readyz(
    State(state): State<AppState>,
) -> (StatusCode, axum::Json<Readiness>) {
    let database = state.context.store.is_writable().await;
    let media_tool = state.media_tool.as_ref().clone().ok();
    let stops = state.context.draining.is_cancelled();
    let ready = database && media_tool.is_some() && !stops;
    let status = match ready {
        true => StatusCode::OK,
        false => StatusCode::SERVICE_UNAVAILABLE,
    };
    let body = Readiness {
        ready,
        database,
        media_tool,
    };
    (status, axum::Json(body))
}
