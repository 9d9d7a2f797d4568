//! Error codes for programs: `GET /v1/errors`. The page `/docs/errors` shows the same table to people.

use axum::Json;
use serde::Serialize;
use utoipa::ToSchema;

use crate::api::problem::status_of;
use flockreel_core::code::Code;

/// An error code. It is never renamed.
#[derive(Debug, Serialize, ToSchema)]
pub(in crate::api) struct ErrorView {
    /// Stable code.
    code: &'static str,
    /// HTTP status of a response with this code. A request for the result of a job that failed with the code
    /// has the status 404.
    status: u16,
    /// Meaning.
    title: &'static str,
    /// Advice on what to do.
    advice: &'static str,
}

/// List all error codes.
///
/// The list needs no token.
#[utoipa::path(get, path = "/v1/errors", responses((status = 200, body = Vec<ErrorView>)))]
pub(in crate::api) async fn list_errors() -> Json<Vec<ErrorView>> {
    let all = Code::ALL.iter().map(|&code| ErrorView {
        code: code.name(),
        status: status_of(code).as_u16(),
        title: code.meaning(),
        advice: code.advice(),
    });
    Json(all.collect())
}
