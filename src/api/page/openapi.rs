//! The OpenAPI 3.1 document, generated from the handlers and their types.

use std::sync::Arc;

use axum::Router;
use axum::http::HeaderMap;
use axum::routing::get;
use serde_json::Value;
use utoipa::Modify;
use utoipa::openapi::path::{Operation, ParameterBuilder, ParameterIn};
use utoipa::openapi::schema::{
    AdditionalProperties, Object, ObjectBuilder, Schema, SchemaType, Type,
};
use utoipa::openapi::security::{ApiKey, ApiKeyValue, HttpAuthScheme, HttpBuilder, SecurityScheme};
use utoipa::openapi::{OpenApi, RefOr, Required};

use super::asset::Asset;
use crate::api::{AppState, idempotency};
use flockreel_core::parameters::Parameters;
use flockreel_core::{analysis, dataset, fish, flock};

/// Title and security schemes of the document. The routes add their own entries.
#[derive(utoipa::OpenApi)]
#[openapi(
    info(
        title = "flockreel",
        description = "Measures one filmed animal and makes flocks of it.",
    ),
    modifiers(&Schemes),
    security((), ("token" = []), ("session" = [])),
)]
pub(in crate::api) struct Document;

/// Adds the request headers that middleware handles: `Idempotency-Key` and `Prefer`.
pub(in crate::api) fn add_headers(document: &mut OpenApi) {
    for (path, item) in &mut document.paths.paths {
        if let Some(post) = item
            .post
            .as_mut()
            .filter(|_| idempotency::ROUTES.contains(&path.as_str()))
        {
            let meaning = "For a day, the same key and body get the same response, with Idempotent-Replayed: true. \
                           Another body gets 422. While the first request runs, a repetition gets 409.";
            add_header(post, "Idempotency-Key", meaning);
        }
        let waits = item
            .post
            .as_mut()
            .filter(|post| post.responses.responses.contains_key("202"));
        let get = item.get.as_mut().filter(|_| path == "/v1/jobs/{id}");
        for operation in waits.into_iter().chain(get) {
            let meaning = "wait=N delays the response until the job ends, for at most N seconds. N is at most 60. If \
                           the job is done by then, a POST answers 201 with the address of the result in Location.";
            add_header(operation, "Prefer", meaning);
        }
    }
}

/// Replaces the schemas of requests that flatten parameters by one object each. The generated `allOf`
/// combines closed schemas, each of which refuses the fields of the others, so that no request would be
/// valid.
pub(in crate::api) fn join_flattened(document: &mut OpenApi) {
    let Some(components) = &mut document.components else {
        return;
    };
    for (name, presets) in [
        ("AnalysisOverrides", analysis::Params::PRESETS),
        ("FlockOverrides", flock::Params::PRESETS),
        ("FlockRequest", flock::Params::PRESETS),
        ("FishRequest", fish::Params::PRESETS),
        ("DatasetRequest", dataset::Params::PRESETS),
    ] {
        let Some(RefOr::T(Schema::AllOf(all))) = components.schemas.get(name) else {
            continue;
        };
        let mut joined = ObjectBuilder::new()
            .additional_properties(Some(AdditionalProperties::FreeForm(false)))
            .build();
        joined.description.clone_from(&all.description);
        for part in &all.items {
            let part = match part {
                RefOr::Ref(to) => to.ref_location.rsplit('/').next(),
                RefOr::T(_) => None,
            }
            .map_or(Some(part), |name| components.schemas.get(name));
            if let Some(RefOr::T(Schema::Object(part))) = part {
                joined.properties.extend(part.properties.clone());
                joined.required.extend(part.required.clone());
            }
        }
        if !presets.is_empty() {
            let preset = RefOr::T(Schema::Object(preset_schema(presets)));
            joined.properties.insert("preset".to_owned(), preset);
        }
        let joined = RefOr::T(Schema::Object(joined));
        components.schemas.insert(name.to_owned(), joined);
    }
}

/// Returns the schema of the name of a preset.
fn preset_schema(presets: &[&str]) -> Object {
    let names = presets.iter().copied().map(Value::from);
    ObjectBuilder::new()
        .schema_type(SchemaType::from_iter([Type::String, Type::Null]))
        .enum_values(Some(names.chain([Value::Null])))
        .default(Some(Value::Null))
        .description(Some(
            "Preset to start from. Other parameters override its values. null = the defaults.",
        ))
        .build()
}

fn add_header(operation: &mut Operation, name: &str, meaning: &str) {
    let header = ParameterBuilder::new()
        .name(name)
        .parameter_in(ParameterIn::Header)
        .required(Required::False)
        .description(Some(meaning))
        .schema(Some(ObjectBuilder::new().schema_type(Type::String).build()))
        .build();
    operation
        .parameters
        .get_or_insert_default()
        .push(RefOr::T(header));
}

/// Authentication: a token or a session cookie. On loopback neither is needed, unless the service requires
/// tokens.
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

/// Returns the route `/openapi.json`.
pub(in crate::api) fn route(document: &utoipa::openapi::OpenApi) -> Router<AppState> {
    let text = document.to_json().unwrap_or_default().into_bytes();
    let asset = Arc::new(Asset::fixed("openapi.json", text.into()));
    let answer = move |headers: HeaderMap| async move { asset.answer(&headers) };
    Router::new().route("/openapi.json", get(answer))
}
