//! HTTP: the table of routes and what they share (DESIGN.md, REST API; RELIABILITY.md, S4 to S7).
//!
//! Handlers are thin: extract, one call, answer. What an error means to HTTP is `problem`'s alone.

mod access; // who may ask, and the headers of every answer
mod idempotency; // same key and body, same answer
mod problem;
pub mod server; // the accept loop

mod download;
mod extract; // ids, JSON, conditions
mod paging;
mod receive; // bodies to disk
mod timestamp;

mod analyses;
mod fish;
mod flocks;
mod footage;
mod jobs;
mod libraries;
mod links;
mod page; // the page, the pages about the API
mod seen; // health, metrics, ids of requests
mod uploads;

use std::ops::Deref;
use std::sync::Arc;
use std::time::Duration;

use axum::extract::{DefaultBodyLimit, Request, State};
use axum::middleware::Next;
use axum::response::{IntoResponse, Response};
use axum::{Router, middleware};
use tower_http::catch_panic::CatchPanicLayer;
use tower_http::timeout::RequestBodyTimeoutLayer;
use utoipa::OpenApi;
use utoipa_axum::router::OpenApiRouter;
use utoipa_axum::routes;

pub use access::signed;
pub use problem::Problem;
pub use seen::metrics::{metrics_router, worker_metrics_router};

use access::{Names, Rates, authenticate, guard, session};
use page::{docs, openapi};
use seen::metrics::Metrics;
use seen::observe::{Requests, observe};
use seen::{health, metrics};

use crate::code::Code;
use crate::config::Config;
use crate::jobs::Context;
use crate::jobs::supervisor::recover;
use crate::store::Store;
use crate::{media, store};

/// The largest JSON body.
const MAX_JSON_BYTES: usize = 1 << 20;
/// The longest wait for the next piece of a body.
const BODY_PIECE: Duration = Duration::from_secs(30);

/// What handlers share. Every layer has one of its own for every request, so that cloning it must cost nothing.
#[derive(Clone)]
pub struct AppState(Arc<Shared>);

/// What is behind an [`AppState`].
pub struct Shared {
    /// The settings.
    pub config: Config,
    /// The store, and the way to wake the workers.
    pub context: Context,
    /// The media tool and the walls around it, or why there is none; asked for at the start.
    pub walls: Result<media::Walls, String>,
    /// How often each owner may ask.
    rates: Rates,
    /// What is counted of requests.
    requests: Requests,
    /// What is told of everything.
    metrics: Metrics,
}

impl Deref for AppState {
    type Target = Shared;

    fn deref(&self) -> &Shared {
        &self.0
    }
}

impl AppState {
    /// Opens the data folder, mends what a crash left, and looks for the media tool.
    pub async fn open(config: Config) -> Result<AppState, store::Error> {
        let store = Store::open(config.storage.clone()).await?;
        let mut context = Context::new(store, config.crew.threads_per_worker());
        context.budget = Duration::from_secs(config.crew.job_time_s);
        context.max_queued = config.max_queued;
        context.least_room_bytes = Config::least_room_bytes(config.disk_reserve_bytes);
        recover(&context).await?;
        let tool = tokio::task::spawn_blocking(media::walls).await;
        let tool = tool.map_err(std::io::Error::other)?;
        match &tool {
            Ok(walls) => tracing::info!(version = walls.version, "media tool found"),
            Err(error) => tracing::error!(%error, "no media tool: install ffmpeg"),
        }
        let requests = Requests::default();
        Ok(AppState(Arc::new(Shared {
            metrics: Metrics::new(&context.meters, &requests),
            requests,
            rates: Rates::new(config.rate),
            config,
            context,
            walls: tool.map_err(|error| error.to_string()),
        })))
    }
}

/// The whole service over a state: the same for the program and for tests.
pub fn router(state: AppState) -> Router {
    let (routes, mut document) = table().split_for_parts();
    openapi::add_headers(&mut document);
    openapi::join_flattened(&mut document);
    let requests = state.requests.clone();
    let names = match state.config.demands_tokens() {
        true => Names::Any,
        false => Names::Loopback,
    };
    routes
        .merge(openapi::route(&document))
        .merge(docs::routes())
        .merge(page::routes())
        .fallback(|| async { Problem::from(Code::NotFound) })
        .method_not_allowed_fallback(|| async { Problem::from(Code::MethodNotAllowed) })
        .with_state(state.clone())
        .layer(middleware::from_fn_with_state(
            state.clone(),
            idempotency::run_once,
        ))
        .layer(middleware::from_fn_with_state(
            state.clone(),
            jobs::wait::wait_for_result,
        ))
        .layer(middleware::from_fn(uploads::speak_tus))
        .layer(middleware::from_fn_with_state(state.clone(), authenticate))
        .layer(DefaultBodyLimit::max(MAX_JSON_BYTES))
        .layer(RequestBodyTimeoutLayer::new(BODY_PIECE))
        .layer(CatchPanicLayer::custom(panicked))
        .layer(middleware::from_fn_with_state(state, refuse_while_stopping))
        .layer(middleware::from_fn_with_state(names, guard))
        .layer(middleware::from_fn_with_state(requests, observe))
}

/// Every route with its entry in the OpenAPI document.
fn table() -> OpenApiRouter<AppState> {
    OpenApiRouter::with_openapi(openapi::Document::openapi())
        .routes(routes!(footage::create_footage, footage::list_footage))
        .routes(routes!(footage::get_footage, footage::delete_footage))
        .routes(routes!(footage::get_footage_file))
        .routes(routes!(uploads::describe_uploads, uploads::create_upload))
        .routes(routes!(
            uploads::head_upload,
            uploads::patch_upload,
            uploads::delete_upload
        ))
        .routes(routes!(analyses::create_analysis))
        .routes(routes!(libraries::list_libraries))
        .routes(routes!(libraries::get_library, libraries::delete_library))
        .routes(routes!(libraries::get_library_file))
        .routes(routes!(flocks::create_flock, flocks::list_flocks))
        .routes(routes!(flocks::preview_flock))
        .routes(routes!(flocks::get_flock, flocks::delete_flock))
        .routes(routes!(flocks::get_flock_file))
        .routes(routes!(links::create_flock_link))
        .routes(routes!(fish::create_fish, fish::list_fish))
        .routes(routes!(fish::get_fish, fish::delete_fish))
        .routes(routes!(fish::get_fish_file))
        .routes(routes!(jobs::list_jobs))
        .routes(routes!(jobs::get_job, jobs::cancel_job))
        .routes(routes!(jobs::get_refused_jpeg))
        .routes(routes!(jobs::events::get_job_events))
        .routes(routes!(jobs::events::get_events))
        .routes(routes!(session::begin_session, session::end_session))
        .routes(routes!(health::healthz))
        .routes(routes!(health::readyz))
        .routes(routes!(metrics::get_metrics))
}

/// Nothing new is begun once the service stops; what is there can still be read.
async fn refuse_while_stopping(
    State(state): State<AppState>,
    request: Request,
    next: Next,
) -> Response {
    match state.context.draining.is_cancelled() && !request.method().is_safe() {
        true => Problem::from(Code::Stopping).into_response(),
        false => next.run(request).await,
    }
}

fn panicked(_: Box<dyn std::any::Any + Send>) -> Response {
    tracing::error!("a handler panicked");
    Problem::from(Code::Internal).into_response()
}

/// JSON of a row of ours.
fn stored<T: serde::de::DeserializeOwned>(json: &str) -> Result<T, Problem> {
    serde_json::from_str(json).map_err(|error| {
        tracing::error!(%error, "a stored row cannot be read");
        Code::Internal.into()
    })
}
