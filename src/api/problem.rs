//! Errors as `application/problem+json` (RFC 9457). Only this module maps codes to HTTP statuses.

use axum::http::{HeaderValue, StatusCode, header};
use axum::response::{IntoResponse, Response};
use serde::Serialize;
use utoipa::ToSchema;

use crate::jobs::refusal::mend::Mend;
use crate::{jobs, store};
use flockreel_core::code::Code;
use flockreel_core::formats::params;
use flockreel_core::ids::JobId;

/// Result of a handler.
pub(super) type Answer = Result<Response, Problem>;

/// Result of a handler that responds with JSON.
pub(super) type JsonAnswer<T> = Result<axum::Json<T>, Problem>;

/// Value of `Retry-After`, seconds. Free choice.
const RETRY_AFTER_S: u64 = 5;

/// An error response.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Problem {
    /// Stable code of the reason.
    pub code: Code,
    /// Description of this occurrence, for people.
    pub detail: String,
    /// Job that did not make the requested result, with `code` as its reason. The status is then 404.
    lost_job: Option<JobId>,
}

/// Marks a response with a transient error: retrying may succeed. It is an extension of the response that
/// `idempotency` reads.
#[derive(Clone, Copy, Debug)]
pub(super) struct Transient;

/// Body of every error response (RFC 9457).
#[derive(Serialize, ToSchema)]
pub(super) struct ProblemBody {
    /// Address of the explanation of the code.
    #[serde(rename = "type")]
    type_url: String,
    /// Meaning of the code.
    title: &'static str,
    /// HTTP status.
    status: u16,
    /// Description of this occurrence.
    detail: String,
    /// Stable error code.
    code: &'static str,
    /// Advice on what to do.
    advice: &'static str,
    /// Changes of the request that may mend it, the most promising first. Absent if none does.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    #[schema(required = false)]
    mends: Vec<Mend>,
}

impl ProblemBody {
    /// Returns the body for a problem that `mends` may mend.
    pub(super) fn new(problem: &Problem, mends: Vec<Mend>) -> ProblemBody {
        let code = problem.code;
        ProblemBody {
            type_url: format!("/docs/errors#{code}"),
            title: code.meaning(),
            status: problem.status().as_u16(),
            detail: problem.detail.clone(),
            code: code.name(),
            advice: code.advice(),
            mends,
        }
    }
}

impl Problem {
    /// Returns a problem with a description of its own.
    pub fn new(code: Code, detail: impl Into<String>) -> Problem {
        Problem {
            code,
            detail: detail.into(),
            lost_job: None,
        }
    }

    /// Returns the problem of a request for a result that will never exist, because its job failed or was
    /// cancelled with this code.
    pub(super) fn lost_result(code: Code, detail: impl Into<String>, job: JobId) -> Problem {
        Problem {
            lost_job: Some(job),
            ..Problem::new(code, detail)
        }
    }

    fn status(&self) -> StatusCode {
        match self.lost_job {
            Some(_) => StatusCode::NOT_FOUND,
            None => status_of(self.code),
        }
    }

    /// Returns whether retrying the same request may succeed: after a server error, or if a media tool hit
    /// its limits, which may be due to a busy machine.
    pub(super) fn is_transient(&self) -> bool {
        let is_tool_limit = matches!(
            self.code,
            Code::TimeLimit | Code::MemoryLimit | Code::DecoderCrashed
        );
        self.lost_job.is_none() && (is_tool_limit || !self.status().is_client_error())
    }

    /// Returns `not_found`. An id of another owner gets the same response as an unknown id.
    pub fn not_found() -> Problem {
        Code::NotFound.into()
    }
}

impl From<Code> for Problem {
    fn from(code: Code) -> Problem {
        Problem::new(code, code.meaning())
    }
}

impl From<store::Error> for Problem {
    fn from(error: store::Error) -> Problem {
        if error.is_unreachable() {
            tracing::warn!(%error, "request refused: the database does not answer");
            return Problem::new(Code::Busy, "the database of the service does not answer");
        }
        from_error(error.code(), &error)
    }
}

impl From<jobs::Error> for Problem {
    fn from(error: jobs::Error) -> Problem {
        match error {
            jobs::Error::Store(error) => error.into(),
            error => from_error(error.code(), &error),
        }
    }
}

impl From<params::Error> for Problem {
    fn from(error: params::Error) -> Problem {
        Problem::new(Code::InvalidParams, error.to_string())
    }
}

/// Converts an error. The cause of an internal error or of a full disk is logged and not sent to the client.
fn from_error(code: Code, error: &dyn std::error::Error) -> Problem {
    match code {
        Code::Internal | Code::DecoderCrashed => {
            tracing::error!(%error, "request failed with an internal error");
            code.into()
        }
        Code::StorageFull => {
            tracing::warn!(%error, "request refused: the disk is full");
            code.into()
        }
        _ => Problem::new(code, error.to_string()),
    }
}

impl IntoResponse for Problem {
    fn into_response(self) -> Response {
        let status = self.status();
        let is_transient = self.is_transient();
        let body = ProblemBody::new(&self, Mend::all_for(self.code));
        let mut response = (status, axum::Json(body)).into_response();
        let headers = response.headers_mut();
        let media_type = HeaderValue::from_static("application/problem+json");
        headers.insert(header::CONTENT_TYPE, media_type);
        if let Some(job) = self.lost_job
            && let Ok(link) = HeaderValue::from_str(&format!("</v1/jobs/{job}>; rel=\"related\""))
        {
            headers.insert(header::LINK, link);
        } else if matches!(
            self.code,
            Code::Stopping
                | Code::NotReady
                | Code::Making
                | Code::StorageFull
                | Code::RequestInProgress
                | Code::QuotaExceeded
                | Code::QueueFull
                | Code::Busy
                | Code::RateLimited
        ) {
            headers.insert(header::RETRY_AFTER, HeaderValue::from(RETRY_AFTER_S));
        }
        if self.code == Code::Unauthenticated {
            let challenge = HeaderValue::from_static("Bearer realm=\"flockreel\"");
            headers.insert(header::WWW_AUTHENTICATE, challenge);
        }
        if is_transient {
            response.extensions_mut().insert(Transient);
        }
        response
    }
}

/// Returns the HTTP status of a code.
pub(super) fn status_of(code: Code) -> StatusCode {
    match code {
        Code::NotAVideo
        | Code::ContainerNotAllowed
        | Code::CodecNotAllowed
        | Code::TooManyPixels
        | Code::TooFewPixels
        | Code::TooManyFrames
        | Code::TooManyStreams
        | Code::TooLong
        | Code::TooFast
        | Code::Truncated
        | Code::Encrypted
        | Code::NoVideoStream
        | Code::TooFewFrames
        | Code::TimeLimit
        | Code::MemoryLimit
        | Code::DecoderCrashed
        | Code::MasksDiffer
        | Code::MasksEmpty
        | Code::NothingMoves
        | Code::NothingAtPoint
        | Code::BackgroundNotStatic
        | Code::CameraMoved
        | Code::LightChanges
        | Code::SceneChanges
        | Code::AnimalTooLarge
        | Code::SeveralAnimals
        | Code::AnimalTooSmall
        | Code::BackgroundSizeDiffers
        | Code::NoTransitions
        | Code::StaysInPlace
        | Code::InputFailed
        | Code::IdempotencyKeyReused
        | Code::InvalidParams => StatusCode::UNPROCESSABLE_ENTITY,
        Code::StorageFull | Code::OwnerStorageFull => StatusCode::INSUFFICIENT_STORAGE,
        // A cancelled job has no result. Only requests for the result get its code.
        Code::NotFound | Code::NotReady | Code::Cancelled => StatusCode::NOT_FOUND,
        Code::MethodNotAllowed => StatusCode::METHOD_NOT_ALLOWED,
        Code::MalformedRequest | Code::BodyCutOff => StatusCode::BAD_REQUEST,
        Code::UnsupportedMediaType => StatusCode::UNSUPPORTED_MEDIA_TYPE,
        Code::TooLarge => StatusCode::PAYLOAD_TOO_LARGE,
        Code::HeadTooLarge => StatusCode::REQUEST_HEADER_FIELDS_TOO_LARGE,
        Code::AddressTooLong => StatusCode::URI_TOO_LONG,
        Code::BodyTimeout => StatusCode::REQUEST_TIMEOUT,
        Code::RangeNotSatisfiable => StatusCode::RANGE_NOT_SATISFIABLE,
        // Status 460 comes from the tus protocol and has no name in HTTP.
        Code::ChecksumMismatch => StatusCode::from_u16(460).unwrap_or(StatusCode::BAD_REQUEST),
        Code::TusVersionNotSupported | Code::PreconditionFailed => StatusCode::PRECONDITION_FAILED,
        Code::AlreadyFinished
        | Code::AlreadyStored
        | Code::RetryRefused
        | Code::Making
        | Code::RequestInProgress
        | Code::OffsetDiffers => StatusCode::CONFLICT,
        Code::Unauthenticated => StatusCode::UNAUTHORIZED,
        Code::QuotaExceeded | Code::RateLimited => StatusCode::TOO_MANY_REQUESTS,
        Code::ScopeTooSmall | Code::CrossSite => StatusCode::FORBIDDEN,
        Code::Stopping | Code::QueueFull | Code::Busy => StatusCode::SERVICE_UNAVAILABLE,
        Code::CrashedWorker | Code::Internal => StatusCode::INTERNAL_SERVER_ERROR,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_lost_database_is_no_internal_error() {
        let lost = || store::Error::Sql(sqlx::Error::PoolTimedOut);
        for problem in [Problem::from(lost()), jobs::Error::Store(lost()).into()] {
            assert_eq!(problem.status(), StatusCode::SERVICE_UNAVAILABLE);
        }
        let broken = store::Error::Sql(sqlx::Error::RowNotFound);
        assert_eq!(
            Problem::from(broken).status(),
            StatusCode::INTERNAL_SERVER_ERROR
        );
    }
}
