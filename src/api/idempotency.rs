//! `Idempotency-Key` on every POST that creates something (docs/explanation/promises.md).
//!
//! An equal key with an equal body returns the stored response. Another body gets 422, and a key whose first
//! request still runs gets 409. Keys are kept for a day, separately for each owner and route. Server errors
//! and other transient errors are not stored. A request that is repeated after a crash runs again with the
//! same ids (`jobs::id_sequence`), so it creates nothing twice.
//!
//! A JSON body is read and hashed before the request runs. Other bodies are hashed while they are received.

use std::pin::Pin;
use std::sync::{Arc, Mutex, PoisonError};
use std::task::{Context, Poll};
use std::time::Duration;

use axum::body::{Body, BodyDataStream, to_bytes};
use axum::extract::{Request, State};
use axum::http::{HeaderName, HeaderValue, Method, StatusCode, header};
use axum::middleware::Next;
use axum::response::{IntoResponse, Response};
use bytes::Bytes;
use futures_util::Stream;
use futures_util::stream::{StreamExt, poll_fn};
use sha2::{Digest, Sha256};

use super::access::Caller;
use super::problem::Transient;
use super::receive::media_type;
use super::{AppState, MAX_JSON_BYTES, Problem};
use crate::jobs::{self, IdSequence};
use crate::store::Store;
use crate::store::idempotency::{Answer, Begun, LEASE_MS, Scope};
use flockreel_core::code::Code;

/// Routes that create something and accept a key.
pub(super) const ROUTES: [&str; 6] = [
    "/v1/footage",
    "/v1/analyses",
    "/v1/flocks",
    "/v1/fish",
    "/v1/datasets",
    "/v1/uploads",
];
/// Name of the header with the key.
pub(super) const KEY: &str = "idempotency-key";
/// Interval at which a key is renewed while its request runs: a third of its lease.
const RENEW_INTERVAL: Duration = Duration::from_millis(LEASE_MS as u64 / 3);
const REPLAYED: HeaderName = HeaderName::from_static("idempotent-replayed");
/// Longest key, bytes. Free choice.
const MAX_KEY_BYTES: usize = 255;
/// Most bytes that a handler may leave unread, such as those after the end of a form. Free choice.
const MAX_EPILOGUE_BYTES: usize = 64 << 10;
/// Headers that are stored with a response. All others are set again when it is replayed.
const STORED_HEADERS: [HeaderName; 7] = [
    header::CONTENT_TYPE,
    header::LOCATION,
    header::LINK,
    header::RETRY_AFTER,
    HeaderName::from_static("upload-offset"),
    HeaderName::from_static("upload-length"),
    HeaderName::from_static("upload-expires"),
];
/// Headers that describe what to create. They are hashed with the body.
const HASHED_HEADERS: [&str; 2] = ["upload-length", "upload-metadata"];

/// Middleware: replays the stored response to a key, or runs the request and stores its response.
pub(super) async fn run_once(
    State(state): State<AppState>,
    request: Request,
    next: Next,
) -> Response {
    let accepts_key = request.method() == Method::POST && ROUTES.contains(&request.uri().path());
    let scope = match request.headers().get(KEY).filter(|_| accepts_key) {
        None => return next.run(request).await,
        Some(key) => key_scope(&request, key),
    };
    match scope {
        Ok(scope) => run_with_key(state, scope, request, next)
            .await
            .unwrap_or_else(Problem::into_response),
        Err(problem) => problem.into_response(),
    }
}

async fn run_with_key(
    state: AppState,
    scope: Scope,
    request: Request,
    next: Next,
) -> Result<Response, Problem> {
    let (mut parts, body) = request.into_parts();
    let mut hasher = Sha256::new();
    hasher.update(parts.uri.query().unwrap_or_default());
    for value in HASHED_HEADERS
        .iter()
        .filter_map(|name| parts.headers.get(*name))
    {
        hasher.update(value);
        hasher.update(b"\n");
    }
    let (body, known_sha256) = if media_type(&parts.headers).starts_with("application/json") {
        let too_large = |_| Problem::from(Code::TooLarge);
        let bytes = to_bytes(body, MAX_JSON_BYTES).await.map_err(too_large)?;
        let sha256 = hasher.clone().chain_update(&bytes).finalize().to_vec();
        (HashedBody::new(Body::from(bytes), hasher), Some(sha256))
    } else {
        (HashedBody::new(body, hasher), None)
    };
    let store = state.context.store.clone();
    let now_ms = state.context.now_ms().await?;
    let begun = store.begin_key(&scope, known_sha256.as_deref(), now_ms);
    let base_id = match begun.await? {
        Begun::Run(base_id) => base_id,
        Begun::Running => return Err(Code::RequestInProgress.into()),
        Begun::OtherBody => return Err(Code::IdempotencyKeyReused.into()),
        Begun::Done(answer) => {
            let max_bytes = state.config.max_upload_bytes + MAX_JSON_BYTES as u64;
            return replay(answer, &body, max_bytes).await;
        }
    };
    let key = KeyGuard(Some((store, scope.clone())));
    parts.extensions.insert(IdSequence::derived_from(base_id));
    let run = next.run(Request::from_parts(parts, body.to_body()));
    let answer = with_renewals(&state.context, &scope, RENEW_INTERVAL, run).await;
    store_response(key, answer, &body).await
}

/// Runs a request and renews its key at the interval `every`. Otherwise other processes that share the store
/// would assume that this one died. A process that has the store to itself renews nothing.
async fn with_renewals<Run: Future>(
    context: &jobs::Context,
    scope: &Scope,
    every: Duration,
    run: Run,
) -> Run::Output {
    let renew = async {
        while !context.store.is_alone() {
            tokio::time::sleep(every).await;
            let renewed = async {
                let now_ms = context.now_ms().await?;
                context.store.renew_key(scope, now_ms).await
            };
            if let Err(error) = renewed.await {
                tracing::warn!(%error, "an idempotency key could not be renewed");
            }
        }
        std::future::pending::<Run::Output>().await
    };
    tokio::select! {
        answer = run => answer,
        never = renew => never,
    }
}

/// Returns the stored response. Fails with `idempotency_key_reused` if the body differs from the first one.
async fn replay(answer: Answer, body: &HashedBody, max_bytes: u64) -> Result<Response, Problem> {
    let sha256 = body.read_rest(max_bytes).await.ok_or(Code::BodyCutOff)?;
    if sha256 != answer.body_sha256 {
        return Err(Code::IdempotencyKeyReused.into());
    }
    let headers: Vec<(String, String)> = super::stored(&answer.headers)?;
    let mut response = Response::new(Body::from(answer.answer));
    *response.status_mut() = StatusCode::from_u16(answer.status).unwrap_or(StatusCode::OK);
    for (name, value) in headers {
        if let (Ok(name), Ok(value)) = (HeaderName::try_from(name), HeaderValue::try_from(value)) {
            response.headers_mut().insert(name, value);
        }
    }
    let yes = HeaderValue::from_static("true");
    response.headers_mut().insert(REPLAYED, yes);
    Ok(response)
}

/// Stores the response, unless it is transient or the body was not read to its end. Returns the response.
/// Fails if storing it fails.
async fn store_response(
    mut key: KeyGuard,
    answer: Response,
    body: &HashedBody,
) -> Result<Response, Problem> {
    if !is_storable(answer.status()) || answer.extensions().get::<Transient>().is_some() {
        return Ok(answer);
    }
    let Some(body_sha256) = body.read_rest(MAX_EPILOGUE_BYTES as u64).await else {
        return Ok(answer);
    };
    let (parts, bytes) = answer.into_parts();
    let bytes = to_bytes(bytes, MAX_JSON_BYTES).await.map_err(|error| {
        tracing::error!(%error, "the response of an Idempotency-Key could not be stored");
        Code::Internal
    })?;
    let text_of = |name: &HeaderName| {
        let value = parts.headers.get(name)?.to_str().ok()?;
        Some((name.as_str().to_owned(), value.to_owned()))
    };
    let headers: Vec<_> = STORED_HEADERS.iter().filter_map(text_of).collect();
    let stored = Answer {
        body_sha256,
        status: parts.status.as_u16(),
        headers: serde_json::json!(headers).to_string(),
        answer: bytes.to_vec(),
    };
    // The guard keeps the key until the response is stored. If the client disconnects or the database fails
    // before that, dropping the guard releases the key.
    if let Some((store, scope)) = &key.0 {
        store.finish_key(scope, &stored).await?;
    }
    key.0 = None;
    Ok(Response::from_parts(parts, Body::from(bytes)))
}

/// Returns whether a response with this status is stored: successes and permanent client errors.
fn is_storable(status: StatusCode) -> bool {
    let transient = [
        StatusCode::REQUEST_TIMEOUT,
        StatusCode::CONFLICT,
        StatusCode::TOO_MANY_REQUESTS,
    ];
    status.as_u16() < 500 && !transient.contains(&status)
}

/// Key of a running request. Dropping it releases the key if no response was stored, for example because the
/// client disconnected.
struct KeyGuard(Option<(Store, Scope)>);

impl Drop for KeyGuard {
    fn drop(&mut self) {
        let Some((store, scope)) = self.0.take() else {
            return;
        };
        tokio::spawn(async move {
            if let Err(error) = store.interrupt_key(&scope).await {
                tracing::warn!(%error, "an Idempotency-Key could not be released");
            }
        });
    }
}

/// A body that is hashed while it is read. Clones share the same stream.
#[derive(Clone)]
struct HashedBody(Arc<Mutex<Reading>>);

struct Reading {
    stream: BodyDataStream,
    hasher: Sha256,
    ended: bool,
}

impl HashedBody {
    fn new(body: Body, hasher: Sha256) -> HashedBody {
        HashedBody(Arc::new(Mutex::new(Reading {
            stream: body.into_data_stream(),
            hasher,
            ended: false,
        })))
    }

    fn to_body(&self) -> Body {
        let this = self.clone();
        Body::from_stream(poll_fn(move |context| this.poll(context)))
    }

    fn poll(&self, context: &mut Context<'_>) -> Poll<Option<Result<Bytes, axum::Error>>> {
        let mut reading = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        if reading.ended {
            return Poll::Ready(None);
        }
        let polled = Pin::new(&mut reading.stream).poll_next(context);
        match &polled {
            Poll::Ready(Some(Ok(bytes))) => reading.hasher.update(bytes),
            Poll::Ready(None) => reading.ended = true,
            Poll::Ready(Some(Err(_))) | Poll::Pending => {}
        }
        polled
    }

    /// Reads the rest of the body, at most `max_bytes`. Returns the hash of the whole request, or `None` if
    /// the body is longer or cut off.
    async fn read_rest(&self, max_bytes: u64) -> Option<Vec<u8>> {
        let mut left = max_bytes;
        let mut stream = std::pin::pin!(poll_fn(|context| self.poll(context)));
        while let Some(piece) = stream.next().await {
            left = left.checked_sub(piece.ok()?.len() as u64)?;
        }
        let reading = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        Some(reading.hasher.clone().finalize().to_vec())
    }
}

fn key_scope(request: &Request, key: &HeaderValue) -> Result<Scope, Problem> {
    let key = key.to_str().unwrap_or_default();
    if key.is_empty() || key.len() > MAX_KEY_BYTES {
        let sentence = "an Idempotency-Key must have 1 to 255 visible characters";
        return Err(Problem::new(Code::MalformedRequest, sentence));
    }
    let caller = request.extensions().get::<Caller>();
    Ok(Scope {
        caller: caller.map_or_else(String::new, |caller| caller.account.owner.0.clone()),
        route: request.uri().path().to_owned(),
        key: key.to_owned(),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[tokio::test]
    async fn a_disconnect_while_the_response_is_stored_releases_the_key() {
        let data = tempfile::tempdir().unwrap();
        let store = Store::open(data.path()).await.unwrap();
        let scope = Scope {
            caller: String::new(),
            route: "/v1/fish".into(),
            key: "k".into(),
        };
        store.begin_key(&scope, None, 0).await.unwrap();
        // The only writer connection is busy.
        let mut busy = Box::pin(store.is_writable());
        assert!(futures_util::poll!(&mut busy).is_pending());
        let key = KeyGuard(Some((store.clone(), scope.clone())));
        let body = HashedBody::new(Body::empty(), Sha256::new());
        let mut storing = Box::pin(store_response(
            key,
            StatusCode::ACCEPTED.into_response(),
            &body,
        ));
        assert!(futures_util::poll!(&mut storing).is_pending());
        drop(storing);
        busy.await;
        tokio::time::sleep(std::time::Duration::from_millis(100)).await;
        let met = store.begin_key(&scope, None, 1).await.unwrap();
        assert!(matches!(met, Begun::Run(_)), "{met:?}");
    }

    #[tokio::test]
    async fn exceeded_limits_of_media_tools_are_not_stored() {
        let data = tempfile::tempdir().unwrap();
        let store = Store::open(data.path()).await.unwrap();
        let scope = |key: Code| Scope {
            caller: String::new(),
            route: "/v1/footage".into(),
            key: key.to_string(),
        };
        let is_storable = async |code: Code| {
            store.begin_key(&scope(code), None, 0).await.unwrap();
            let key = KeyGuard(Some((store.clone(), scope(code))));
            let body = HashedBody::new(Body::empty(), Sha256::new());
            let answer = Problem::from(code).into_response();
            assert_eq!(answer.status(), StatusCode::UNPROCESSABLE_ENTITY);
            store_response(key, answer, &body).await.unwrap();
            tokio::time::sleep(std::time::Duration::from_millis(50)).await;
            matches!(
                store.begin_key(&scope(code), None, 1).await.unwrap(),
                Begun::Done(_)
            )
        };
        assert!(is_storable(Code::NotAVideo).await);
        for code in [Code::TimeLimit, Code::MemoryLimit, Code::DecoderCrashed] {
            assert!(!is_storable(code).await, "{code}");
        }
    }

    #[test]
    fn only_successes_and_permanent_client_errors_are_stored() {
        for status in [200, 201, 202, 400, 413, 422] {
            assert!(
                is_storable(StatusCode::from_u16(status).unwrap()),
                "{status}"
            );
        }
        for status in [408, 409, 429, 500, 503, 507] {
            assert!(
                !is_storable(StatusCode::from_u16(status).unwrap()),
                "{status}"
            );
        }
    }

    #[tokio::test]
    async fn a_request_longer_than_a_lease_keeps_its_key() {
        let data = tempfile::tempdir().unwrap();
        let _first = Store::open(data.path()).await.unwrap();
        let store = Store::open_beside(data.path()).await.unwrap();
        let context = jobs::Context::new(store.clone(), 1);
        let scope = Scope {
            caller: String::new(),
            route: "/v1/fish".into(),
            key: "k".into(),
        };
        let begun_ms = context.now_ms().await.unwrap() - LEASE_MS + 1000;
        store.begin_key(&scope, None, begun_ms).await.unwrap();
        let slow = tokio::time::sleep(Duration::from_millis(300));
        with_renewals(&context, &scope, Duration::from_millis(10), slow).await;
        let later_ms = context.now_ms().await.unwrap() + LEASE_MS - 5000;
        let met = store.begin_key(&scope, None, later_ms).await;
        assert_eq!(met.unwrap(), Begun::Running);
    }
}
