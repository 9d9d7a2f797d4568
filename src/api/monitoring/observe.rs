//! Monitoring of requests. Every request gets an id for its log lines and its response, one log line when it
//! is answered, and counters by route and status.
//!
//! The query of an address is never logged, because it may hold the signature of a link.

use std::time::{Duration, Instant};

use axum::extract::{MatchedPath, Request, State};
use axum::http::{HeaderMap, HeaderName, HeaderValue, Method};
use axum::middleware::Next;
use axum::response::Response;
use prometheus_client::encoding::EncodeLabelSet;
use prometheus_client::metrics::counter::Counter;
use prometheus_client::metrics::family::Family;
use prometheus_client::metrics::gauge::Gauge;
use prometheus_client::metrics::histogram::Histogram;
use prometheus_client::registry::Registry;
use tracing::Instrument;
use tracing::field::Empty;
use uuid::Uuid;

use crate::store::jobs::trace::{self, TraceParent};
use crate::traces;

const TRACE_PARENT: HeaderName = HeaderName::from_static("traceparent");
const REQUEST_ID: HeaderName = HeaderName::from_static("x-request-id");
/// Longest request id that is accepted from a client, bytes. Free choice.
const MAX_ID_BYTES: usize = 64;
/// Histogram buckets of the time until the response begins, seconds: from a probe to a long `Prefer: wait`.
const ANSWER_S: [f64; 12] = [
    0.001, 0.003, 0.01, 0.03, 0.1, 0.3, 1.0, 3.0, 10.0, 30.0, 60.0, 300.0,
];
const METHODS: [Method; 7] = [
    Method::GET,
    Method::HEAD,
    Method::POST,
    Method::PATCH,
    Method::PUT,
    Method::DELETE,
    Method::OPTIONS,
];

#[derive(Clone, Debug, Hash, PartialEq, Eq, EncodeLabelSet)]
struct Answered {
    /// Template of the route, so that ids do not become labels.
    route: String,
    method: &'static str,
    status: u16,
}

#[derive(Clone, Debug, Hash, PartialEq, Eq, EncodeLabelSet)]
struct Route {
    route: String,
}

/// Counters of requests. Clones share the same counters.
#[derive(Clone)]
pub(in crate::api) struct Requests {
    answered: Family<Answered, Counter>,
    times: Family<Route, Histogram, fn() -> Histogram>,
    under_way: Gauge,
}

impl Default for Requests {
    fn default() -> Requests {
        Requests {
            answered: Family::default(),
            times: Family::new_with_constructor(|| Histogram::new(ANSWER_S)),
            under_way: Gauge::default(),
        }
    }
}

impl Requests {
    /// Registers the counters.
    pub(in crate::api) fn register(&self, registry: &mut Registry) {
        registry.register(
            "flockreel_http_requests",
            "Answered requests, by route template",
            self.answered.clone(),
        );
        registry.register(
            "flockreel_http_request_seconds",
            "Time until the response header is sent",
            self.times.clone(),
        );
        registry.register(
            "flockreel_http_requests_under_way",
            "Requests without a response yet",
            self.under_way.clone(),
        );
    }

    fn count(&self, route: &str, method: &Method, answer: &Response, took: Duration) {
        let route = route.to_owned();
        let method = METHODS.iter().find(|known| *known == method);
        let answered = Answered {
            route: route.clone(),
            method: method.map_or("other", Method::as_str),
            status: answer.status().as_u16(),
        };
        self.answered.get_or_create(&answered).inc();
        let times = self.times.get_or_create(&Route { route });
        times.observe(took.as_secs_f64());
    }
}

/// A running request. It is counted until it is dropped, which also happens when the client disconnects.
struct UnderWay(Gauge);

impl Drop for UnderWay {
    fn drop(&mut self) {
        self.0.dec();
    }
}

/// Middleware: gives the request an id, then counts and logs the response.
pub(in crate::api) async fn observe(
    State(requests): State<Requests>,
    request: Request,
    next: Next,
) -> Response {
    let start = Instant::now();
    let id = id_of(request.headers());
    let method = request.method().clone();
    let matched = request.extensions().get::<MatchedPath>().cloned();
    let route = matched.as_ref().map_or("unmatched", MatchedPath::as_str);
    let path = request.uri().path();
    let given = trace_of(request.headers());
    let span = tracing::info_span!("request", request_id = id, trace_id = Empty, %method, path);
    if let Some(given) = &given {
        traces::set_parent(&span, given.as_str());
    }
    // Jobs become children of the exported span, else of the span that the client named.
    let exported = traces::header_of(&span).and_then(|header| TraceParent::parse(&header));
    let trace = exported.or(given);
    span.record("trace_id", trace.as_ref().map(TraceParent::trace_id));
    requests.under_way.inc();
    let under_way = UnderWay(requests.under_way.clone());
    let answered = trace::within(trace, next.run(request));
    let mut answer = answered.instrument(span.clone()).await;
    drop(under_way);
    let took = start.elapsed();
    requests.count(route, &method, &answer, took);
    let status = answer.status().as_u16();
    span.in_scope(|| log(route, status, took));
    traces::set_answer(&span, method.as_str(), route, status);
    if let Ok(id) = HeaderValue::from_str(&id) {
        answer.headers_mut().insert(REQUEST_ID, id);
    }
    answer
}

/// Logs one line. Probes, which come every few seconds, and the files of the page are logged only at the
/// debug level.
fn log(route: &str, status: u16, took: Duration) {
    let duration_ms = took.as_secs_f64() * 1000.0;
    let is_frequent = ["/healthz", "/readyz", "/metrics"].contains(&route)
        || ["/static/", "/vendor/"]
            .iter()
            .any(|start| route.starts_with(start));
    if is_frequent {
        tracing::debug!(route, status, duration_ms, "request answered");
    } else {
        tracing::info!(route, status, duration_ms, "request answered");
    }
}

/// Returns the id that the client sent, if it is safe to log, else a new one.
fn id_of(headers: &HeaderMap) -> String {
    let given = headers.get(REQUEST_ID).and_then(|id| id.to_str().ok());
    let is_plain = |id: &&str| {
        (1..=MAX_ID_BYTES).contains(&id.len())
            && id
                .bytes()
                .all(|byte| byte.is_ascii_alphanumeric() || b"-_.".contains(&byte))
    };
    let given = given.filter(is_plain).map(str::to_owned);
    given.unwrap_or_else(|| Uuid::now_v7().to_string())
}

/// Returns the trace of a request that names exactly one.
fn trace_of(headers: &HeaderMap) -> Option<TraceParent> {
    let mut given = headers.get_all(TRACE_PARENT).iter();
    let only = given.next().filter(|_| given.next().is_none());
    TraceParent::parse(only?.to_str().ok()?)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn request_id_that_could_forge_a_log_line_is_replaced() {
        let of = |id: &'static str| {
            id_of(&HeaderMap::from_iter([(
                REQUEST_ID,
                HeaderValue::from_static(id),
            )]))
        };
        assert_eq!(of("a-1_b.c"), "a-1_b.c");
        for odd in ["", "a b", "a\"b", "id=1"] {
            assert_eq!(of(odd).len(), 36, "{odd}");
        }
    }
}
