//! The HTTP API: the table of routes, the middleware around them, and the state that handlers share.
//!
//! A handler parses the request, makes one call to `store` or `jobs`, and responds. Only `problem` maps error
//! codes to HTTP statuses. The OpenAPI document is generated from the handlers
//! (docs/explanation/promises.md, "Contract").

mod access; // authentication, rate limits, response headers
mod idempotency; // same key and body, same response
mod problem;
pub mod server; // the accept loop

mod download;
mod extract; // ids, JSON bodies, conditional headers
mod paging;
mod receive; // request bodies to disk
mod resources; // find, list, get and delete: footage, libraries, flocks, fish
mod timestamp;

mod analyses;
mod fish;
mod flocks;
mod footage;
mod jobs;
mod libraries;
mod monitoring; // health, metrics, request ids
mod page; // the web page, /docs, /openapi.json
mod uploads;

use std::collections::HashSet;
use std::ops::Deref;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use axum::extract::{DefaultBodyLimit, Request, State};
use axum::middleware::Next;
use axum::response::{IntoResponse, Response};
use axum::{Router, middleware};
use tower_http::catch_panic::CatchPanicLayer;
use tower_http::timeout::RequestBodyTimeoutLayer;
use utoipa::OpenApi;
use utoipa_axum::router::OpenApiRouter;
use utoipa_axum::routes;
use uuid::Uuid;

pub use access::signed;
pub use monitoring::metrics::{metrics_router, worker_metrics_router};
pub use problem::Problem;

use download::compression;
use download::if_match::check_if_match;
use flocks::datasets;

use access::{HostNames, OpenRequests, Rates, authenticate, guard, session};
use monitoring::metrics::Metrics;
use monitoring::observe::{Requests, observe};
use monitoring::{health, metrics, usage};
use page::{docs, errors, examples, openapi};
use receive::CHUNK_TIMEOUT;

use crate::config::Config;
use crate::jobs::Context;
use crate::jobs::supervisor::recover;
use crate::store::Store;
use crate::store::space::SpaceLimits;
use crate::{media, store};
use flockreel_core::code::Code;

/// Maximum number of open resumable uploads of one owner, even if each is small. Free choice.
const MAX_OWNER_UPLOADS: i64 = 1000;

/// Largest JSON body, bytes. Free choice.
const MAX_JSON_BYTES: usize = 1 << 20;

/// State shared by all handlers. Every layer clones it for every request, so it is only a reference-counted
/// pointer.
#[derive(Clone)]
pub struct AppState(Arc<Shared>);

/// Contents of an [`AppState`].
pub struct Shared {
    /// Settings of the process.
    pub config: Config,
    /// Store, limits of the queue, and the signal that wakes the workers.
    pub context: Context,
    /// Version and sandbox of the media tool, found at the start; or the reason why there is no usable tool.
    pub media_tool: Result<media::SandboxStatus, String>,
    /// Rate limits of owners and addresses.
    rates: Rates,
    /// Open requests of owners and addresses.
    open_requests: OpenRequests,
    /// Resources whose use is being recorded.
    uses: Mutex<HashSet<Uuid>>,
    /// Counters of HTTP requests.
    requests: Requests,
    /// All metrics of the service.
    metrics: Metrics,
}

impl Deref for AppState {
    type Target = Shared;

    fn deref(&self) -> &Shared {
        &self.0
    }
}

impl Shared {
    fn uses(&self) -> MutexGuard<'_, HashSet<Uuid>> {
        self.uses.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl AppState {
    /// Opens the store, recovers from a crash, and searches for the media tool. Fails if the store cannot be
    /// opened. A missing media tool is only logged.
    pub async fn open(config: Config) -> Result<AppState, store::Error> {
        let store = Store::open(config.storage.clone()).await?;
        let store = store.with_space_limits(SpaceLimits {
            max_owner_bytes: config.owner_space.max_owner_bytes,
            max_owner_uploads: MAX_OWNER_UPLOADS,
            disk_reserve_bytes: config.disk_reserve_bytes,
        });
        let mut context = Context::for_jobs(store, &config.jobs);
        context.max_queued = config.max_queued;
        context.retention = config.retention;
        context.min_free_bytes = Config::job_reserve_bytes(config.disk_reserve_bytes);
        recover(&context).await?;
        let tool = tokio::task::spawn_blocking(media::sandbox_status).await;
        let tool = tool.map_err(std::io::Error::other)?;
        match &tool {
            Ok(status) => tracing::info!(version = status.version, "media tool found"),
            Err(error) => tracing::error!(%error, "ffmpeg was not found: install it"),
        }
        let requests = Requests::default();
        Ok(AppState(Arc::new(Shared {
            metrics: Metrics::new(&context.meters, &requests),
            requests,
            rates: Rates::new(config.rate),
            open_requests: OpenRequests::new(config.max_open_requests),
            uses: Mutex::default(),
            config,
            context,
            media_tool: tool.map_err(|error| error.to_string()),
        })))
    }

    /// Changes the context. Panics if the state was cloned.
    pub fn with_context(mut self, change: impl FnOnce(&mut Context)) -> AppState {
        let shared = Arc::get_mut(&mut self.0);
        change(&mut shared.expect("a state without clones").context);
        self
    }
}

/// Returns the router of the whole service. The program and the tests use the same one.
pub fn router(state: AppState) -> Router {
    let (routes, mut document) = table().split_for_parts();
    openapi::add_headers(&mut document);
    openapi::join_flattened(&mut document);
    examples::add(&mut document);
    let requests = state.requests.clone();
    let names = if state.config.requires_tokens() {
        HostNames::Any
    } else {
        HostNames::Loopback
    };
    routes
        .merge(openapi::route(&document))
        .merge(docs::routes())
        .merge(page::routes())
        .fallback(page::get_missing)
        .method_not_allowed_fallback(|| async { Problem::from(Code::MethodNotAllowed) })
        .with_state(state.clone())
        .layer(middleware::from_fn(check_if_match))
        .layer(middleware::from_fn_with_state(
            state.clone(),
            idempotency::run_once,
        ))
        .layer(middleware::from_fn_with_state(
            state.clone(),
            jobs::wait::wait_for_result,
        ))
        .layer(middleware::from_fn(uploads::tus_version))
        .layer(middleware::from_fn_with_state(state.clone(), authenticate))
        .layer(DefaultBodyLimit::max(MAX_JSON_BYTES))
        .layer(RequestBodyTimeoutLayer::new(CHUNK_TIMEOUT))
        .layer(CatchPanicLayer::custom(panic_response))
        .layer(compression::layer())
        .layer(middleware::from_fn(compression::negotiate))
        .layer(middleware::from_fn_with_state(state, refuse_while_stopping))
        .layer(middleware::from_fn_with_state(names, guard))
        .layer(middleware::from_fn_with_state(requests, observe))
}

/// Returns all API routes with their entries in the OpenAPI document.
fn table() -> OpenApiRouter<AppState> {
    OpenApiRouter::with_openapi(openapi::Document::openapi())
        .routes(routes!(footage::create_footage, footage::list_footage))
        .routes(routes!(
            footage::get_footage,
            footage::change_footage,
            footage::delete_footage
        ))
        .routes(routes!(footage::get_footage_file))
        .routes(routes!(footage::get_footage_poster))
        .routes(routes!(footage::create_variant))
        .routes(routes!(uploads::describe_uploads, uploads::create_upload))
        .routes(routes!(
            uploads::head_upload,
            uploads::patch_upload,
            uploads::delete_upload
        ))
        .routes(routes!(analyses::create_analysis))
        .routes(routes!(analyses::preview_analysis))
        .routes(routes!(libraries::list_libraries))
        .routes(routes!(
            libraries::get_library,
            libraries::change_library,
            libraries::delete_library
        ))
        .routes(routes!(libraries::get_library_file))
        .routes(routes!(flocks::create::create_flock, flocks::list_flocks))
        .routes(routes!(flocks::preview::preview_flock))
        .routes(routes!(
            flocks::get_flock,
            flocks::change_flock,
            flocks::delete_flock
        ))
        .routes(routes!(flocks::school::get_school))
        .routes(routes!(flocks::get_flock_file))
        .routes(routes!(flocks::links::create_flock_link))
        .routes(routes!(fish::create_fish, fish::list_fish))
        .routes(routes!(
            fish::get_fish,
            fish::change_fish,
            fish::delete_fish
        ))
        .routes(routes!(fish::get_fish_file))
        .merge(datasets::table())
        .routes(routes!(jobs::list_jobs))
        .routes(routes!(jobs::get_job, jobs::cancel_job))
        .routes(routes!(jobs::retry::retry_job))
        .routes(routes!(jobs::get_refused_jpeg))
        .routes(routes!(jobs::events::get_job_events))
        .routes(routes!(jobs::events::get_events))
        .routes(routes!(usage::get_usage))
        .routes(routes!(errors::list_errors))
        .routes(routes!(session::begin_session, session::end_session))
        .routes(routes!(health::healthz))
        .routes(routes!(health::readyz))
        .routes(routes!(metrics::get_metrics))
}

/// Middleware: refuses writes with `stopping` once the service stops. Reads are still served
/// (docs/explanation/promises.md, "Graceful stop").
async fn refuse_while_stopping(
    State(state): State<AppState>,
    request: Request,
    next: Next,
) -> Response {
    if state.context.draining.is_cancelled() && !request.method().is_safe() {
        return Problem::from(Code::Stopping).into_response();
    }
    next.run(request).await
}

fn panic_response(_: Box<dyn std::any::Any + Send>) -> Response {
    tracing::error!("a handler panicked");
    Problem::from(Code::Internal).into_response()
}

/// Parses JSON from a stored row. Fails with `internal` and logs the cause.
fn stored<T: serde::de::DeserializeOwned>(json: &str) -> Result<T, Problem> {
    serde_json::from_str(json).map_err(|error| {
        tracing::error!(%error, "a stored row cannot be read");
        Code::Internal.into()
    })
}
