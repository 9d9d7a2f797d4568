//! Extractors: the parts of a request that handlers take. Every failure is a problem with a code.

use std::convert::Infallible;

use axum::extract::rejection::JsonRejection;
use axum::extract::{self, FromRequest, FromRequestParts, Path, Request};
use axum::http::request::Parts;
use axum::http::{HeaderMap, Method};
use serde::de::DeserializeOwned;
use serde::{Deserialize, Deserializer};
use uuid::Uuid;

use super::access::Caller;
use super::{AppState, Problem};
use crate::jobs::{IdSequence, JobInput};
use crate::store::Store;
use flockreel_core::code::Code;
use flockreel_core::ids::JobId;

/// The service, and the caller on whose behalf a handler uses it.
pub(super) struct Access {
    /// State of the service.
    pub state: AppState,
    /// Sender of the request.
    pub caller: Caller,
}

impl Access {
    /// Returns the store.
    pub(super) fn store(&self) -> &Store {
        &self.state.context.store
    }

    /// Queues a job for the caller. Returns the id of the job and the id that its result will have. Fails with
    /// `owner_storage_full` if the caller has no space for any result.
    pub(super) async fn enqueue<Input: JobInput>(
        &self,
        input: &Input,
        after_job: Option<JobId>,
        ids: &mut IdSequence,
    ) -> Result<(JobId, Input::ResultId), Problem> {
        let account = &self.caller.account;
        self.store().require_space_left(&account.owner).await?;
        let queued = self.state.context.enqueue(input, after_job, account, ids);
        Ok(queued.await?)
    }
}

impl FromRequestParts<AppState> for Access {
    type Rejection = Problem;

    async fn from_request_parts(parts: &mut Parts, state: &AppState) -> Result<Access, Problem> {
        Ok(Access {
            state: state.clone(),
            caller: Caller::from_request_parts(parts, state).await?,
        })
    }
}

/// Id in the path. A malformed id fails with `not_found`.
#[derive(Clone, Copy, Debug)]
pub(super) struct Id(pub Uuid);

impl<S: Send + Sync> FromRequestParts<S> for Id {
    type Rejection = Problem;

    async fn from_request_parts(parts: &mut Parts, state: &S) -> Result<Id, Problem> {
        let path = Path::<Uuid>::from_request_parts(parts, state).await;
        path.map(|Path(id)| Id(id))
            .map_err(|_rejection| Problem::not_found())
    }
}

/// Id and file name in the path.
#[derive(Clone, Debug)]
pub(super) struct FileOf(pub Uuid, pub String);

impl<S: Send + Sync> FromRequestParts<S> for FileOf {
    type Rejection = Problem;

    async fn from_request_parts(parts: &mut Parts, state: &S) -> Result<FileOf, Problem> {
        let path = Path::<(Uuid, String)>::from_request_parts(parts, state).await;
        let path = path.map_err(|_rejection| Problem::not_found());
        path.map(|Path((id, name))| FileOf(id, name))
    }
}

/// File name, or path of a file, in the path of the request. A malformed one fails with `not_found`.
#[derive(Clone, Debug)]
pub(super) struct FileName(pub String);

impl<S: Send + Sync> FromRequestParts<S> for FileName {
    type Rejection = Problem;

    async fn from_request_parts(parts: &mut Parts, state: &S) -> Result<FileName, Problem> {
        let path = Path::<String>::from_request_parts(parts, state).await;
        path.map(|Path(name)| FileName(name))
            .map_err(|_rejection| Problem::not_found())
    }
}

/// Query parameters. Malformed or repeated ones fail with `invalid_params`.
#[derive(Clone, Copy, Debug)]
pub(super) struct Query<T>(pub T);

impl<S: Send + Sync, T: DeserializeOwned> FromRequestParts<S> for Query<T> {
    type Rejection = Problem;

    async fn from_request_parts(parts: &mut Parts, state: &S) -> Result<Query<T>, Problem> {
        let query = extract::Query::<T>::from_request_parts(parts, state).await;
        query
            .map(|extract::Query(parameters)| Query(parameters))
            .map_err(|error| Problem::new(Code::InvalidParams, error.body_text()))
    }
}

/// JSON body. Fails with `malformed_request`, `invalid_params`, `unsupported_media_type` or `too_large`.
#[derive(Clone, Debug)]
pub(super) struct Json<T>(pub T);

impl<S: Send + Sync, T: DeserializeOwned> FromRequest<S> for Json<T> {
    type Rejection = Problem;

    async fn from_request(request: Request, state: &S) -> Result<Json<T>, Problem> {
        match axum::Json::from_request(request, state).await {
            Ok(axum::Json(body)) => Ok(Json(body)),
            Err(rejection) => Err(Problem::new(code_of(&rejection), rejection.body_text())),
        }
    }
}

/// Ids for the things that the request creates. Those of a request with an Idempotency-Key are set by
/// `idempotency`.
impl<S: Send + Sync> FromRequestParts<S> for IdSequence {
    type Rejection = Infallible;

    async fn from_request_parts(parts: &mut Parts, _: &S) -> Result<IdSequence, Infallible> {
        Ok(parts.extensions.remove().unwrap_or_default())
    }
}

/// Method and headers of a conditional or range request.
#[derive(Clone, Debug)]
pub(super) struct Conditions {
    /// GET or HEAD.
    pub method: Method,
    /// All headers.
    pub headers: HeaderMap,
}

impl<S: Send + Sync> FromRequestParts<S> for Conditions {
    type Rejection = Infallible;

    async fn from_request_parts(parts: &mut Parts, _: &S) -> Result<Conditions, Infallible> {
        Ok(Conditions {
            method: parts.method.clone(),
            headers: parts.headers.clone(),
        })
    }
}

/// Reads a property that is given, so that it differs from an absent one. Fails for null if `T` does.
pub(super) fn given<'de, T: Deserialize<'de>, D: Deserializer<'de>>(
    json: D,
) -> Result<Option<T>, D::Error> {
    T::deserialize(json).map(Some)
}

fn code_of(rejection: &JsonRejection) -> Code {
    match rejection {
        JsonRejection::JsonDataError(_) => Code::InvalidParams,
        JsonRejection::MissingJsonContentType(_) => Code::UnsupportedMediaType,
        JsonRejection::BytesRejection(error) if error.status() == 413 => Code::TooLarge,
        _ => Code::MalformedRequest,
    }
}
