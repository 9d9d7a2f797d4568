//! `Prefer: wait=N`: the response waits for the end of the job, but at most N seconds.

use std::time::{Duration, Instant};

use flockreel::jobs::supervisor::Supervisor;
use reqwest::StatusCode;
use serde_json::json;

use crate::common::TestApp;
use crate::common::app::json_of;
use crate::common::clip::{SWIM, SWIM_FRAMES, TINY};

#[tokio::test]
async fn wait_ends_after_the_requested_time() {
    let app = TestApp::idle().await;
    let body = json!({"footage_id": app.upload(&TINY).await});
    let start = Instant::now();
    let request = app.post("/v1/analyses").header("prefer", "wait=1");
    let answer = request.json(&body).send().await.unwrap();
    assert!(start.elapsed() >= Duration::from_secs(1));
    assert_eq!(answer.headers()["preference-applied"], "wait=1");
    let location = answer.headers()["location"].to_str().unwrap().to_owned();
    assert!(location.starts_with("/v1/jobs/"));
    json_of(answer, StatusCode::ACCEPTED).await;
    let start = Instant::now();
    let job = app
        .get(&location)
        .header("prefer", "wait=1")
        .send()
        .await
        .unwrap();
    assert!(start.elapsed() >= Duration::from_secs(1));
    assert_eq!(job.headers()["preference-applied"], "wait=1");
    assert_eq!(json_of(job, StatusCode::OK).await["state"], "queued");
    app.assert_sound().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn job_that_ends_in_time_gives_201_with_its_result() {
    let app = TestApp::idle().await;
    let body = json!({"footage_id": app.upload(&SWIM).await});
    let workers = Supervisor::start(app.context.clone(), 1);
    let request = app.post("/v1/analyses").header("prefer", "wait=60");
    let answer = request.json(&body).send().await.unwrap();
    let location = answer.headers()["location"].to_str().unwrap().to_owned();
    let made = json_of(answer, StatusCode::CREATED).await;
    assert_eq!(
        location,
        format!("/v1/libraries/{}", made["library_id"].as_str().unwrap())
    );
    assert_eq!(app.json(&location).await["n_frames"], SWIM_FRAMES);
    workers.drain().await;
    app.assert_sound().await;
}
