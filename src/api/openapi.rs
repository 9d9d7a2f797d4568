//! The description of the API, generated from the code (OpenAPI 3.1).

use axum::Router;
use axum::http::header;
use axum::routing::get;
use utoipa::Modify;
use utoipa::openapi::OpenApi;
use utoipa::openapi::security::{ApiKey, ApiKeyValue, HttpAuthScheme, HttpBuilder, SecurityScheme};

use super::AppState;

/// The frame of the document; the routes add themselves.
#[derive(utoipa::OpenApi)]
#[openapi(
    info(
        title = "flockreel",
        description = "One filmed animal in, a flock of it out.",
    ),
    modifiers(&Schemes),
    security((), ("token" = []), ("session" = [])),
)]
pub(super) struct Document;

/// How a caller shows who asks. On loopback, unless the service demands tokens, nobody has to.
struct Schemes;

impl Modify for Schemes {
    fn modify(&self, document: &mut OpenApi) {
        let token = HttpBuilder::new()
            .scheme(HttpAuthScheme::Bearer)
            .bearer_format("frl_<id>_<secret>")
            .description(Some("made by `flockreel token create`"))
            .build();
        let cookie = ApiKeyValue::with_description("flockreel_session", "set by POST /v1/session");
        let components = document.components.get_or_insert_default();
        components.add_security_scheme("token", SecurityScheme::Http(token));
        components.add_security_scheme("session", SecurityScheme::ApiKey(ApiKey::Cookie(cookie)));
    }
}

/// /openapi.json.
pub(super) fn route(document: &utoipa::openapi::OpenApi) -> Router<AppState> {
    let text = document.to_json().unwrap_or_default();
    let answer = move || async move { ([(header::CONTENT_TYPE, "application/json")], text) };
    Router::new().route("/openapi.json", get(answer))
}
