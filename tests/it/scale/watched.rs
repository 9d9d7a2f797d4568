//! Monitoring of workers and services: the metrics of a worker, and readiness when the bucket is silent.

use std::time::{Duration, Instant};

use reqwest::StatusCode;
use tokio::io::copy_bidirectional;
use tokio::net::{TcpListener, TcpStream};
use tokio::sync::watch;

use crate::common::process::{Server, WorkerProcess};
use crate::common::{Place, client};

#[tokio::test]
#[ignore = "needs PostgreSQL and a bucket: make scale-test"]
async fn worker_metrics_cover_only_its_own_jobs() {
    let place = Place::shared();
    let server = Server::start_at(&place);
    let flags = ["--metrics-bind", "127.0.0.1:0"];
    let worker = WorkerProcess::start_with(&place.second_machine(), &flags);
    let begun = Instant::now();
    while !worker.has_logged("waiting for jobs") {
        assert!(begun.elapsed() < Duration::from_secs(60), "never ready");
        tokio::time::sleep(Duration::from_millis(20)).await;
    }
    let log = worker.log();
    let (_, at) = log.split_once("the metrics are at ").expect(&log);
    let url = at.lines().next().unwrap();
    let metrics = client().get(url).send().await.unwrap();
    let metrics = metrics.text().await.unwrap();
    for name in ["flockreel_decoded_frames", "flockreel_build_info"] {
        assert!(metrics.contains(name), "{metrics}");
    }
    for name in ["flockreel_stored", "flockreel_queue", "flockreel_http"] {
        assert!(!metrics.contains(name), "{metrics}");
    }
    let other_path = client().get(url.replace("/metrics", "/v1/jobs"));
    assert_eq!(other_path.send().await.unwrap().status(), 404);
    assert_eq!(worker.terminate(), Some(0));
    assert_eq!(server.terminate(), Some(0));
}

#[tokio::test(flavor = "multi_thread")]
#[ignore = "needs PostgreSQL and a bucket: make scale-test"]
async fn service_reports_an_unreachable_bucket_within_seconds() {
    let place = Place::shared();
    let wire = Wire::to(&std::env::var("AWS_ENDPOINT_URL").unwrap()).await;
    let flags = place.server_flags();
    let flags: Vec<&str> = flags.iter().map(String::as_str).collect();
    let bucket = [("AWS_ENDPOINT_URL", wire.url.as_str())];
    let server = Server::start_in(place.data(), &flags, &bucket);
    let ready = async || {
        let asked = client().get(format!("{}/readyz", server.base)).send();
        let answer = asked.await.unwrap();
        let status = answer.status();
        let body: serde_json::Value = answer.json().await.unwrap();
        (status, body["blob_store"].clone())
    };
    assert_eq!(ready().await, (StatusCode::OK, true.into()));
    wire.open.send_replace(false);
    let begun = Instant::now();
    let silent = (StatusCode::SERVICE_UNAVAILABLE, false.into());
    assert_eq!(ready().await, silent);
    assert!(begun.elapsed() < Duration::from_secs(4));
    wire.open.send_replace(true);
    assert_eq!(ready().await, (StatusCode::OK, true.into()));
    assert_eq!(server.terminate(), Some(0));
}

/// A TCP proxy to the bucket. While blocked, it neither answers nor refuses connections.
pub(super) struct Wire {
    pub(super) url: String,
    pub(super) open: watch::Sender<bool>,
}

impl Wire {
    pub(super) async fn to(url: &str) -> Wire {
        let (scheme, address) = url.split_once("://").unwrap();
        let address = address.to_owned();
        let listener = TcpListener::bind("127.0.0.1:0").await.unwrap();
        let url = format!("{scheme}://{}", listener.local_addr().unwrap());
        let (open, is_open) = watch::channel(true);
        tokio::spawn(async move {
            while let Ok((from, _)) = listener.accept().await {
                tokio::spawn(carry(from, address.clone(), is_open.clone()));
            }
        });
        Wire { url, open }
    }
}

async fn carry(mut from: TcpStream, address: String, mut is_open: watch::Receiver<bool>) {
    if is_open.wait_for(|open| *open).await.is_err() {
        return;
    }
    let mut to = TcpStream::connect(address).await.unwrap();
    tokio::select! {
        _ = copy_bidirectional(&mut from, &mut to) => {}
        _ = is_open.wait_for(|open| !open) => {}
    }
    // Keep the connection open, so that the client keeps waiting for its answer.
    is_open.wait_for(|open| *open).await.ok();
}
