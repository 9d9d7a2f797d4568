//! Responses with files that are not stored, but computed for each request.

use axum::body::Body;
use axum::http::response::Builder;
use axum::http::{Response, StatusCode, header};

use super::names::saved_as;
use super::{built, matches};
use crate::api::extract::Conditions;
use crate::api::problem::Problem;

/// Returns the start of a response with an ETag and a Cache-Control.
pub(in crate::api) fn tagged(etag: &str, cache_control: &str) -> Builder {
    let answer = Response::builder().header(header::ETAG, etag);
    answer.header(header::CACHE_CONTROL, cache_control)
}

/// Adds the type of a file and the name under which a browser saves it.
pub(in crate::api) fn with_type(
    answer: Builder,
    media_type: &'static str,
    saved_name: &str,
) -> Builder {
    let answer = answer.header(header::CONTENT_TYPE, media_type);
    answer.header(
        header::CONTENT_DISPOSITION,
        saved_as(media_type, saved_name),
    )
}

/// Returns whether the client has the file with this tag.
pub(in crate::api) fn is_known(conditions: &Conditions, etag: &str) -> bool {
    let known = conditions.headers.get(header::IF_NONE_MATCH);
    let known = known.and_then(|tags| tags.to_str().ok());
    known.is_some_and(|tags| matches(tags, etag))
}

/// Returns the response for a client that has the file.
pub(in crate::api) fn not_modified(answer: Builder) -> Result<Response<Body>, Problem> {
    built(answer.status(StatusCode::NOT_MODIFIED).body(Body::empty()))
}
