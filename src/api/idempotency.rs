//! `Idempotency-Key` on every POST that creates something (docs/explanation/promises.md).
//!
//! An equal key with an equal body returns the stored response. Another body gets 422, and a key whose first
//! request still runs gets 409. Keys are kept for a day, separately for each owner and route. Server errors
//! and other transient errors are not stored. A request that is repeated after a crash runs again with the
//! same ids (`jobs::allotted`), so it creates nothing twice.
//!
//! A JSON body is read and hashed before the request runs. Other bodies are hashed while they are received.

use std::pin::Pin;
use std::sync::{Arc, Mutex, PoisonError};
use std::task::{Context, Poll};
use std::time::Duration;

use axum::body::{Body, BodyDataStream, to_bytes};
use axum::extract::{Request, State};
use axum::http::{HeaderMap, HeaderName, HeaderValue, Method, StatusCode, header};
use axum::middleware::Next;
use axum::response::{IntoResponse, Response};
use bytes::Bytes;
use futures_util::Stream;
use futures_util::stream::{StreamExt, poll_fn};
use sha2::{Digest, Sha256};

use super::access::Caller;
use super::problem::MayPass;
use super::{AppState, MAX_JSON_BYTES, Problem};
use crate::code::Code;
use crate::jobs::{self, allotted};
use crate::store::Store;
use crate::store::idempotency::{Answer, Begun, LEASE_MS, Scope};

/// Routes that create something and accept a key.
pub(super) const ROUTES: [&str; 5] = [
    "/v1/footage",
    "/v1/analyses",
    "/v1/flocks",
    "/v1/fish",
    "/v1/uploads",
];
/// Name of the header with the key.
pub(super) const KEY: &str = "idempotency-key";
/// Interval at which a key is renewed while its request runs: a third of its lease.
const RENEWED: Duration = Duration::from_millis(LEASE_MS as u64 / 3);
const REPLAYED: HeaderName = HeaderName::from_static("idempotent-replayed");
/// Longest key, bytes. Free choice.
const MAX_KEY_BYTES: usize = 255;
/// Most bytes that a handler may leave unread, such as those after the end of a form. Free choice.
const MAX_EPILOGUE_BYTES: usize = 64 << 10;
/// Headers that are stored with a response. All others are set again when it is replayed.
const KEPT: [HeaderName; 7] = [
    header::CONTENT_TYPE,
    header::LOCATION,
    header::LINK,
    header::RETRY_AFTER,
    HeaderName::from_static("upload-offset"),
    HeaderName::from_static("upload-length"),
    HeaderName::from_static("upload-expires"),
];
/// Headers that describe what to create. They are hashed with the body.
const ASKED: [&str; 2] = ["upload-length", "upload-metadata"];

/// Middleware: replays the stored response to a key, or runs the request and stores its response.
pub(super) async fn run_once(
    State(state): State<AppState>,
    request: Request,
    next: Next,
) -> Response {
    let makes = request.method() == Method::POST && ROUTES.contains(&request.uri().path());
    match request.headers().get(KEY).filter(|_| makes) {
        None => next.run(request).await,
        Some(key) => match scope_of(&request, key) {
            Ok(scope) => run_keyed(state, scope, request, next)
                .await
                .unwrap_or_else(Problem::into_response),
            Err(problem) => problem.into_response(),
        },
    }
}

async fn run_keyed(
    state: AppState,
    scope: Scope,
    request: Request,
    next: Next,
) -> Result<Response, Problem> {
    let (parts, body) = request.into_parts();
    let mut hasher = Sha256::new();
    hasher.update(parts.uri.query().unwrap_or_default());
    for value in ASKED.iter().filter_map(|name| parts.headers.get(*name)) {
        hasher.update(value);
        hasher.update(b"\n");
    }
    let (tally, known) = if is_json(&parts.headers) {
        let too_large = |_| Problem::from(Code::TooLarge);
        let bytes = to_bytes(body, MAX_JSON_BYTES).await.map_err(too_large)?;
        let known = hasher.clone().chain_update(&bytes).finalize().to_vec();
        (Tally::of(Body::from(bytes), hasher), Some(known))
    } else {
        (Tally::of(body, hasher), None)
    };
    let store = state.context.store.clone();
    let now_ms = state.context.now_ms().await?;
    let family = match store.begin_key(&scope, known.as_deref(), now_ms).await? {
        Begun::Run(family) => family,
        Begun::Running => return Err(Code::RequestInProgress.into()),
        Begun::OtherBody => return Err(Code::IdempotencyKeyReused.into()),
        Begun::Done(answer) => {
            let max_bytes = state.config.max_upload_bytes + MAX_JSON_BYTES as u64;
            return replay(answer, &tally, max_bytes).await;
        }
    };
    let held = Held(Some((store, scope.clone())));
    let request = Request::from_parts(parts, tally.body());
    let run = allotted::under(family, next.run(request));
    let answer = renewing(&state.context, &scope, RENEWED, run).await;
    keep(held, answer, &tally).await
}

/// Runs a request and renews its key at the interval `every`. Otherwise other processes that share the store
/// would assume that this one died. A process that has the store to itself renews nothing.
async fn renewing<Run: Future>(
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
async fn replay(answer: Answer, tally: &Tally, max_bytes: u64) -> Result<Response, Problem> {
    let sha256 = tally.rest(max_bytes).await.ok_or(Code::BodyCutOff)?;
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
async fn keep(mut held: Held, answer: Response, tally: &Tally) -> Result<Response, Problem> {
    if !is_kept(answer.status()) || answer.extensions().get::<MayPass>().is_some() {
        return Ok(answer);
    }
    let Some(body_sha256) = tally.rest(MAX_EPILOGUE_BYTES as u64).await else {
        return Ok(answer);
    };
    let (parts, body) = answer.into_parts();
    let body = to_bytes(body, MAX_JSON_BYTES).await.map_err(|error| {
        tracing::error!(%error, "the response of an Idempotency-Key could not be stored");
        Code::Internal
    })?;
    let text_of = |name: &HeaderName| {
        let value = parts.headers.get(name)?.to_str().ok()?;
        Some((name.as_str().to_owned(), value.to_owned()))
    };
    let headers: Vec<_> = KEPT.iter().filter_map(text_of).collect();
    let kept = Answer {
        body_sha256,
        status: parts.status.as_u16(),
        headers: serde_json::json!(headers).to_string(),
        answer: body.to_vec(),
    };
    // The key stays held until the response is stored. If the client disconnects or the database fails
    // before, dropping `held` releases the key.
    if let Some((store, scope)) = &held.0 {
        store.finish_key(scope, &kept).await?;
    }
    held.0 = None;
    Ok(Response::from_parts(parts, Body::from(body)))
}

/// Returns whether a response with this status is stored: successes and permanent client errors.
fn is_kept(status: StatusCode) -> bool {
    let passes = [
        StatusCode::REQUEST_TIMEOUT,
        StatusCode::CONFLICT,
        StatusCode::TOO_MANY_REQUESTS,
    ];
    status.as_u16() < 500 && !passes.contains(&status)
}

/// Key of a running request. Dropping it releases the key if no response was stored, for example because the
/// client disconnected.
struct Held(Option<(Store, Scope)>);

impl Drop for Held {
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
struct Tally(Arc<Mutex<Reading>>);

struct Reading {
    stream: BodyDataStream,
    hasher: Sha256,
    ended: bool,
}

impl Tally {
    fn of(body: Body, hasher: Sha256) -> Tally {
        let stream = body.into_data_stream();
        let ended = false;
        Tally(Arc::new(Mutex::new(Reading {
            stream,
            hasher,
            ended,
        })))
    }

    fn body(&self) -> Body {
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
    async fn rest(&self, max_bytes: u64) -> Option<Vec<u8>> {
        let mut left = max_bytes;
        let mut stream = std::pin::pin!(poll_fn(|context| self.poll(context)));
        while let Some(piece) = stream.next().await {
            left = left.checked_sub(piece.ok()?.len() as u64)?;
        }
        let reading = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        Some(reading.hasher.clone().finalize().to_vec())
    }
}

fn scope_of(request: &Request, key: &HeaderValue) -> Result<Scope, Problem> {
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

fn is_json(headers: &HeaderMap) -> bool {
    let media_type = headers.get(header::CONTENT_TYPE);
    let media_type = media_type.and_then(|value| value.to_str().ok());
    media_type.is_some_and(|text| text.to_ascii_lowercase().starts_with("application/json"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[tokio::test]
    async fn a_sender_who_hangs_up_while_the_answer_is_noted_gives_the_key_back() {
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
        let held = Held(Some((store.clone(), scope.clone())));
        let tally = Tally::of(Body::empty(), Sha256::new());
        let mut noted = Box::pin(keep(held, StatusCode::ACCEPTED.into_response(), &tally));
        assert!(futures_util::poll!(&mut noted).is_pending());
        drop(noted);
        busy.await;
        tokio::time::sleep(std::time::Duration::from_millis(100)).await;
        let met = store.begin_key(&scope, None, 1).await.unwrap();
        assert!(matches!(met, Begun::Run(_)), "{met:?}");
    }

    #[tokio::test]
    async fn what_failed_on_a_busy_machine_is_not_kept_although_it_is_told_as_the_films_fault() {
        let data = tempfile::tempdir().unwrap();
        let store = Store::open(data.path()).await.unwrap();
        let scope = |key: Code| Scope {
            caller: String::new(),
            route: "/v1/footage".into(),
            key: key.to_string(),
        };
        let is_kept = async |code: Code| {
            store.begin_key(&scope(code), None, 0).await.unwrap();
            let held = Held(Some((store.clone(), scope(code))));
            let tally = Tally::of(Body::empty(), Sha256::new());
            let answer = Problem::from(code).into_response();
            assert_eq!(answer.status(), StatusCode::UNPROCESSABLE_ENTITY);
            keep(held, answer, &tally).await.unwrap();
            tokio::time::sleep(std::time::Duration::from_millis(50)).await;
            matches!(
                store.begin_key(&scope(code), None, 1).await.unwrap(),
                Begun::Done(_)
            )
        };
        assert!(is_kept(Code::NotAVideo).await);
        for code in [Code::TimeLimit, Code::MemoryLimit, Code::DecoderCrashed] {
            assert!(!is_kept(code).await, "{code}");
        }
    }

    #[test]
    fn no_failure_of_ours_is_kept_and_nothing_that_passes() {
        for status in [200, 201, 202, 400, 413, 422] {
            assert!(is_kept(StatusCode::from_u16(status).unwrap()), "{status}");
        }
        for status in [408, 409, 429, 500, 503, 507] {
            assert!(!is_kept(StatusCode::from_u16(status).unwrap()), "{status}");
        }
    }

    #[tokio::test]
    async fn a_request_that_outlasts_a_lease_keeps_its_key() {
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
        renewing(&context, &scope, Duration::from_millis(10), slow).await;
        let later_ms = context.now_ms().await.unwrap() + LEASE_MS - 5000;
        let met = store.begin_key(&scope, None, later_ms).await;
        assert_eq!(met.unwrap(), Begun::Running);
    }
}
