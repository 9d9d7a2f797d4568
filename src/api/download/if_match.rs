//! The condition If-Match (RFC 9110, section 13.1.1): a request runs only if its client has the current version.

use axum::extract::Request;
use axum::http::{HeaderMap, HeaderValue, header};
use axum::middleware::Next;
use axum::response::{IntoResponse, Response};

use crate::api::Problem;
use flockreel_core::code::Code;

/// Middleware: refuses a request with `precondition_failed` if no tag of its If-Match is that of the resource.
/// Resources that can be changed have no tag, so a write runs only with `If-Match: *`.
pub(in crate::api) async fn check_if_match(request: Request, next: Next) -> Response {
    let Some(wanted) = request.headers().get(header::IF_MATCH).cloned() else {
        return next.run(request).await;
    };
    let refused = || Problem::from(Code::PreconditionFailed).into_response();
    if !request.method().is_safe() && wanted != "*" {
        return refused();
    }
    let answer = next.run(request).await;
    if answer.status().is_success() && !holds(&wanted, answer.headers()) {
        return refused();
    }
    answer
}

/// Returns whether the response is for one of the wanted versions. Weak tags never match.
fn holds(wanted: &HeaderValue, headers: &HeaderMap) -> bool {
    let Ok(wanted) = wanted.to_str() else {
        return false;
    };
    let tag = headers.get(header::ETAG).and_then(|tag| tag.to_str().ok());
    let is_strong = |tag: &&str| !tag.starts_with("W/");
    wanted == "*"
        || (wanted.split(',').map(str::trim)).any(|one| tag.filter(is_strong) == Some(one))
}
