//! `/metrics` in the text format of Prometheus: the counters of this process, and the current contents of the
//! store.
//!
//! The metrics cover the work of all owners. Requests from other machines therefore need a token of scope
//! `admin`. A separate listener (`--metrics-bind`) needs no token, and a firewall can protect it.

use std::fmt;
use std::sync::Arc;
use std::sync::atomic::Ordering;

use axum::Router;
use axum::body::Body;
use axum::extract::State;
use axum::http::{HeaderValue, Response, header};
use axum::middleware;
use axum::response::IntoResponse;
use axum::routing::get;
use prometheus_client::collector::Collector;
use prometheus_client::encoding::text::encode;
use prometheus_client::encoding::{DescriptorEncoder, EncodeLabelSet, EncodeMetric};
use prometheus_client::metrics::counter::{ConstCounter, Counter};
use prometheus_client::metrics::family::Family;
use prometheus_client::metrics::gauge::Gauge;
use prometheus_client::metrics::info::Info;
use prometheus_client::registry::{Registry, Unit};

use super::observe::Requests;
use crate::api::AppState;
use crate::api::access::{Caller, HostNames, guard};
use crate::api::problem::{Problem, ProblemBody};
use crate::jobs::Meters;
use crate::jobs::clock::now_ms;
use crate::logging;
use crate::store::jobs::{JobState, Kind};
use crate::store::upkeep::census::Census;
use flockreel_core::code::Code;

const MEDIA_TYPE: HeaderValue =
    HeaderValue::from_static("application/openmetrics-text; version=1.0.0; charset=utf-8");

#[derive(Clone, Debug, Hash, PartialEq, Eq, EncodeLabelSet)]
struct Jobs {
    kind: &'static str,
    state: &'static str,
}

#[derive(Clone, Debug, Hash, PartialEq, Eq, EncodeLabelSet)]
struct Limit {
    limit: &'static str,
}

#[derive(Clone, Debug, Hash, PartialEq, Eq, EncodeLabelSet)]
struct Stored {
    noun: &'static str,
}

/// All metrics of the service. Clones share the same values.
#[derive(Clone)]
pub(in crate::api) struct Metrics {
    registry: Arc<Registry>,
    jobs: Family<Jobs, Gauge>,
    oldest_queued: Gauge,
    stored: Family<Stored, Gauge>,
    announced: Gauge,
    refusals: Family<Limit, Counter>,
}

impl Metrics {
    /// Returns metrics that include the counters of jobs and requests.
    pub(in crate::api) fn new(meters: &Meters, requests: &Requests) -> Metrics {
        let mut registry = process_registry(meters);
        let (jobs, stored) = (Family::default(), Family::default());
        let (oldest_queued, announced) = (Gauge::default(), Gauge::default());
        let refusals = Family::default();
        registry.register("flockreel_jobs", "Jobs, by kind and state", jobs.clone());
        registry.register_with_unit(
            "flockreel_queue_oldest",
            "Longest time that a job which could run has waited",
            Unit::Seconds,
            oldest_queued.clone(),
        );
        registry.register_with_unit(
            "flockreel_stored",
            "Stored objects, by kind",
            Unit::Bytes,
            stored.clone(),
        );
        registry.register_with_unit(
            "flockreel_announced",
            "Announced sizes of open uploads and of bodies that are being received",
            Unit::Bytes,
            announced.clone(),
        );
        registry.register(
            "flockreel_space_refusals",
            "Uploads, jobs and results refused for lack of space, by limit",
            refusals.clone(),
        );
        requests.register(&mut registry);
        let registry = Arc::new(registry);
        Metrics {
            registry,
            jobs,
            oldest_queued,
            stored,
            announced,
            refusals,
        }
    }

    /// Updates the metrics that describe the store.
    fn update(&self, census: &Census, n_refusals: [u64; 2], now_ms: i64) {
        for (kind, state) in Kind::ALL
            .into_iter()
            .flat_map(|kind| JobState::ALL.map(|state| (kind, state)))
        {
            let counts = census.jobs.iter();
            let count = counts.filter(|(k, s, _)| (*k, *s) == (kind, state));
            let labels = Jobs {
                kind: kind.name(),
                state: state.name(),
            };
            let n_jobs = count.map(|(_, _, n_jobs)| n_jobs).sum();
            self.jobs.get_or_create(&labels).set(n_jobs);
        }
        let waited_ms = census.waiting_since_ms.map_or(0, |ms| now_ms - ms);
        self.oldest_queued.set(waited_ms.max(0) / 1000);
        for &(noun, n_bytes) in &census.stored_bytes {
            self.stored.get_or_create(&Stored { noun }).set(n_bytes);
        }
        self.announced.set(census.announced_bytes);
        for (limit, n) in ["owner", "disk"].into_iter().zip(n_refusals) {
            let refusals = self.refusals.get_or_create(&Limit { limit });
            refusals.inner().store(n, Ordering::Relaxed);
        }
    }
}

/// Get the metrics of the service for Prometheus.
///
/// The format is OpenMetrics text. Local requests need no token, unless the service requires tokens. Other
/// requests need one of scope `admin`. The listener of `--metrics-bind` needs none.
#[utoipa::path(get, path = "/metrics", responses(
    (status = 200, content_type = "application/openmetrics-text", body = str),
    (status = "4XX", body = ProblemBody, content_type = "application/problem+json"),
))]
pub(in crate::api) async fn get_metrics(
    State(state): State<AppState>,
    caller: Caller,
) -> Result<Response<Body>, Problem> {
    if !caller.is_operator() {
        return Err(Code::ScopeTooSmall.into());
    }
    text(&state).await
}

/// Returns a router that serves only the metrics, without a token, for a separate listener.
pub fn metrics_router(state: AppState) -> Router {
    let answer = async |State(state): State<AppState>| text(&state).await;
    Router::new()
        .route("/metrics", get(answer))
        .fallback(|| async { Problem::from(Code::NotFound) })
        .with_state(state)
        .layer(middleware::from_fn_with_state(HostNames::Any, guard))
}

/// Returns a router for the metrics of a process that only runs jobs. They cover this process; the queue and
/// the store are reported once, by the service.
pub fn worker_metrics_router(meters: &Meters) -> Router {
    let registry = Arc::new(process_registry(meters));
    let answer = async |State(registry): State<Arc<Registry>>| encoded(&registry);
    Router::new()
        .route("/metrics", get(answer))
        .fallback(|| async { Problem::from(Code::NotFound) })
        .with_state(registry)
        .layer(middleware::from_fn_with_state(HostNames::Any, guard))
}

/// Collector for the number of dropped log lines, which is read at every request.
#[derive(Debug)]
struct LostLines;

impl Collector for LostLines {
    fn encode(&self, mut encoder: DescriptorEncoder<'_>) -> Result<(), fmt::Error> {
        let lost = ConstCounter::new(logging::n_lost_lines());
        let (name, help) = (
            "flockreel_log_lines_lost",
            "Log lines dropped because stderr was too slow or failed",
        );
        lost.encode(encoder.encode_descriptor(name, help, None, lost.metric_type())?)
    }
}

/// Returns a registry with the metrics of every process: version, dropped log lines, and jobs.
fn process_registry(meters: &Meters) -> Registry {
    let mut registry = Registry::default();
    let version = Info::new([("version", env!("CARGO_PKG_VERSION"))]);
    registry.register("flockreel_build", "Version of the running process", version);
    registry.register_collector(Box::new(LostLines));
    meters.register(&mut registry);
    registry
}

async fn text(state: &AppState) -> Result<Response<Body>, Problem> {
    let store = &state.context.store;
    let census = store.census().await?;
    state.metrics.update(&census, store.n_refusals(), now_ms());
    encoded(&state.metrics.registry)
}

fn encoded(registry: &Registry) -> Result<Response<Body>, Problem> {
    let mut text = String::new();
    encode(&mut text, registry).map_err(|error| {
        tracing::error!(%error, "the metrics could not be written");
        Code::Internal
    })?;
    Ok(([(header::CONTENT_TYPE, MEDIA_TYPE)], text).into_response())
}
