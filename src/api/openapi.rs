//! The description of the API, generated from the code (OpenAPI 3.1).

use axum::Router;
use axum::http::header;
use axum::routing::get;

use super::AppState;

/// The frame of the document; the routes add themselves.
#[derive(utoipa::OpenApi)]
#[openapi(info(
    title = "flockreel",
    description = "One filmed animal in, a flock of it out.",
))]
pub(super) struct Document;

/// /openapi.json.
pub(super) fn route(document: &utoipa::openapi::OpenApi) -> Router<AppState> {
    let text = document.to_json().unwrap_or_default();
    let answer = move || async move { ([(header::CONTENT_TYPE, "application/json")], text) };
    Router::new().route("/openapi.json", get(answer))
}
