//! Export of traces: a collector receives the spans of requests and jobs, and a collector that does not answer
//! delays nothing.

use std::process::Stdio;
use std::sync::{Arc, Mutex};
use std::time::Duration;

use axum::Router;
use axum::body::Bytes;
use axum::extract::State;
use axum::routing::post;
use clap::Parser;
use flockreel::cli::Cli;
use opentelemetry_proto::tonic::collector::trace::v1::ExportTraceServiceRequest;
use opentelemetry_proto::tonic::trace::v1::Span;
use prost::Message;
use reqwest::StatusCode;
use serde_json::{Value, json};
use tokio::net::TcpListener;

use super::stderr::Service;
use crate::common::app::json_of;
use crate::common::client;
use crate::common::clip::TINY;

const TRACE_ID: &str = "4bf92f3577b34da6a3ce929d0e0e4736";
const PARENT_ID: &str = "00f067aa0ba902b7";

type Spans = Arc<Mutex<Vec<Span>>>;

/// Starts a collector. Returns its address and the spans that it has received so far.
async fn collector() -> (String, Spans) {
    async fn collect(State(spans): State<Spans>, body: Bytes) {
        let request = ExportTraceServiceRequest::decode(body).unwrap();
        let scopes = request.resource_spans.into_iter();
        let scopes = scopes.flat_map(|resource| resource.scope_spans);
        let received = scopes.flat_map(|scope| scope.spans);
        spans.lock().unwrap().extend(received);
    }
    let spans = Spans::default();
    let router = Router::new()
        .route("/v1/traces", post(collect))
        .with_state(spans.clone());
    let listener = TcpListener::bind("127.0.0.1:0").await.unwrap();
    let address = format!("http://{}", listener.local_addr().unwrap());
    tokio::spawn(async move { axum::serve(listener, router).await });
    (address, spans)
}

fn hex(bytes: &[u8]) -> String {
    bytes.iter().map(|byte| format!("{byte:02x}")).collect()
}

async fn wait_for_job(base: &str, id: &Value) {
    let job = format!("{base}/v1/jobs/{}", id.as_str().unwrap());
    loop {
        let job = client().get(&job).send().await.unwrap();
        if !job.json::<Value>().await.unwrap()["finished_at"].is_null() {
            return;
        }
        tokio::time::sleep(Duration::from_millis(50)).await;
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn collector_receives_a_request_and_its_job_as_one_trace() {
    let (address, spans) = collector().await;
    let flags = ["--otlp-endpoint", &address, "--log", "error"];
    let mut service = Service::start_with(Stdio::null(), Stdio::inherit(), &flags).await;
    let post = |path: &str| client().post(format!("{}{path}", service.base));
    let footage = post("/v1/footage").body(TINY.clone()).send().await.unwrap();
    let footage = json_of(footage, StatusCode::CREATED).await;
    let body = json!({"footage_id": footage["id"]});
    let traced = post("/v1/analyses").json(&body);
    let traced = traced.header("traceparent", format!("00-{TRACE_ID}-{PARENT_ID}-01"));
    let traced = json_of(traced.send().await.unwrap(), StatusCode::ACCEPTED).await;
    wait_for_job(&service.base, &traced["job_id"]).await;
    let body = json!({"footage_id": footage["id"], "params": {"threshold": 30}});
    let alone = post("/v1/analyses").json(&body).send().await.unwrap();
    let alone = json_of(alone, StatusCode::ACCEPTED).await;
    wait_for_job(&service.base, &alone["job_id"]).await;
    assert_eq!(service.terminate(), Some(0));

    let spans = spans.lock().unwrap();
    let requests = spans.iter().filter(|span| span.name == "POST /v1/analyses");
    let requests: Vec<&Span> = requests.collect();
    let jobs: Vec<&Span> = spans.iter().filter(|span| span.name == "job").collect();
    assert_eq!((requests.len(), jobs.len()), (2, 2), "{spans:#?}");
    for (request, job) in requests.iter().zip(&jobs) {
        assert_eq!(job.trace_id, request.trace_id);
        assert_eq!(job.parent_span_id, request.span_id);
    }
    assert_eq!(hex(&requests[0].trace_id), TRACE_ID);
    assert_eq!(hex(&requests[0].parent_span_id), PARENT_ID);
    // Without a header a request begins a trace of its own.
    assert_ne!(requests[1].trace_id, requests[0].trace_id);
    assert!(requests[1].parent_span_id.is_empty());
    let keys = requests[0]
        .attributes
        .iter()
        .map(|attribute| &*attribute.key);
    let keys: Vec<&str> = keys.collect();
    assert!(keys.contains(&"http.response.status_code"), "{keys:?}");
}

#[tokio::test(flavor = "multi_thread")]
async fn collector_that_never_answers_delays_nothing() {
    // Connections are accepted by the kernel, and nobody reads them.
    let silent = TcpListener::bind("127.0.0.1:0").await.unwrap();
    let address = format!("http://{}", silent.local_addr().unwrap());
    let flags = ["--otlp-endpoint", &address, "--log", "error"];
    let mut service = Service::start_with(Stdio::null(), Stdio::null(), &flags).await;
    let client = client();
    // More than the queue of the exporter holds.
    for _ in 0..3000 {
        let answer = client.get(format!("{}/healthz", service.base));
        assert_eq!(answer.send().await.unwrap().status(), StatusCode::OK);
    }
    assert_eq!(service.terminate(), Some(0));
}

#[test]
fn address_of_a_collector_must_be_http() {
    for wrong in [
        "collector:4318",
        "ftp://collector",
        "grpc://collector:4317",
        "",
    ] {
        let arguments = ["flockreel", "serve", "--otlp-endpoint", wrong];
        assert!(Cli::try_parse_from(arguments).is_err(), "{wrong}");
    }
}
