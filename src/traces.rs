//! Export of traces: the spans of requests and jobs go to a collector of OpenTelemetry, by OTLP over HTTP
//! (docs/how-to/trace-requests.md). The spans wait in a bounded queue for a thread of their own, so that a slow or
//! absent collector delays nothing; spans that find the queue full are dropped.
//!
//! Without an exporter the functions for spans do nothing.

use std::collections::HashMap;
use std::time::Duration;

use opentelemetry::propagation::TextMapPropagator;
use opentelemetry::trace::{Status, TraceContextExt, TracerProvider};
use opentelemetry_otlp::{SpanExporter, WithExportConfig};
use opentelemetry_sdk::Resource;
use opentelemetry_sdk::propagation::TraceContextPropagator;
use opentelemetry_sdk::trace::SdkTracerProvider;
use reqwest::Url;
use tracing::level_filters::LevelFilter;
use tracing::{Span, Subscriber};
use tracing_opentelemetry::OpenTelemetrySpanExt;
use tracing_subscriber::Layer;
use tracing_subscriber::filter::filter_fn;
use tracing_subscriber::registry::LookupSpan;

/// Header of W3C Trace Context, also the key of its propagator.
const TRACE_PARENT: &str = "traceparent";
/// Path of spans at a collector, by the specification of OTLP over HTTP.
const SPANS_PATH: &str = "v1/traces";
/// Time for the collector to take one batch, and for the last batch when the process ends. Free choice.
const EXPORT_TIME: Duration = Duration::from_secs(3);

/// The running export. Dropping it sends the spans that wait.
#[must_use]
#[derive(Debug)]
pub struct Exporter {
    provider: SdkTracerProvider,
}

impl Drop for Exporter {
    fn drop(&mut self) {
        if let Err(error) = self.provider.shutdown_with_timeout(EXPORT_TIME) {
            tracing::warn!(%error, "the last spans were not exported");
        }
    }
}

impl Exporter {
    /// Starts the export to the collector at this address. A cryptography library for TLS must have been selected.
    /// Whether the collector answers is not checked.
    pub fn start(endpoint: &Url) -> Result<Exporter, String> {
        let base = endpoint.as_str().trim_end_matches('/');
        let exporter = SpanExporter::builder()
            .with_http()
            .with_endpoint(format!("{base}/{SPANS_PATH}"))
            .with_timeout(EXPORT_TIME)
            .build()
            .map_err(|error| error.to_string())?;
        let resource = Resource::builder().with_service_name("flockreel").build();
        let provider = SdkTracerProvider::builder()
            .with_batch_exporter(exporter)
            .with_resource(resource)
            .build();
        Ok(Exporter { provider })
    }

    /// Returns the layer that exports the spans of this crate, whatever the filter of the log.
    pub fn layer<S>(&self) -> impl Layer<S> + use<S>
    where
        S: Subscriber + for<'a> LookupSpan<'a>,
    {
        let spans = filter_fn(|what| what.is_span() && what.target().starts_with("flockreel"));
        tracing_opentelemetry::layer()
            .with_tracer(self.provider.tracer("flockreel"))
            .with_location(false)
            .with_threads(false)
            .with_target(false)
            .with_filter(spans.with_max_level_hint(LevelFilter::INFO))
    }
}

/// Makes a new span a child of the span that a `traceparent` header names.
pub fn set_parent(span: &Span, header: &str) {
    let carrier = HashMap::from([(TRACE_PARENT.to_owned(), header.to_owned())]);
    let parent = TraceContextPropagator::new().extract(&carrier);
    // Fails without an exporter.
    span.set_parent(parent).ok();
}

/// Returns the `traceparent` header that names an exported span. The parent of the span can no longer be set.
pub fn header_of(span: &Span) -> Option<String> {
    let mut carrier = HashMap::new();
    TraceContextPropagator::new().inject_context(&span.context(), &mut carrier);
    carrier.remove(TRACE_PARENT)
}

/// Tells the collector how an HTTP request was answered, in the terms of OpenTelemetry's semantic conventions.
pub fn set_answer(span: &Span, method: &str, route: &str, status: u16) {
    let context = span.context();
    context.span().update_name(format!("{method} {route}"));
    span.set_attribute("http.request.method", method.to_owned());
    span.set_attribute("http.route", route.to_owned());
    span.set_attribute("http.response.status_code", i64::from(status));
    if status >= 500 {
        set_failure(span, "");
    }
}

/// Tells the collector that the work of a span failed.
pub fn set_failure(span: &Span, description: &str) {
    span.set_status(Status::error(description.to_owned()));
}
