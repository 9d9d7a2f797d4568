//! A server that is killed in the middle of a job, or told to stop (RELIABILITY.md, R2, R4, R5).

use std::time::{Duration, Instant};

use flockreel::jobs::clock::now_ms;
use flockreel::store::Store;
use reqwest::Client;
use serde_json::{Value, json};

use crate::common::Place;
use crate::common::clip::SWIM;
use crate::common::process::Server;

async fn get(server: &Server, path: &str) -> Value {
    let answer = Client::new()
        .get(format!("{}{path}", server.base))
        .send()
        .await;
    answer.unwrap().json().await.unwrap()
}

/// Uploads the film and starts its analysis; returns the job's path.
async fn start_job(server: &Server) -> String {
    let client = Client::new();
    let post = |path: &str| client.post(format!("{}{path}", server.base));
    let footage = post("/v1/footage").body(SWIM.clone()).send().await.unwrap();
    let footage: Value = footage.json().await.unwrap();
    let body = json!({"footage_id": footage["id"]});
    let accepted = post("/v1/analyses").json(&body).send().await.unwrap();
    let accepted: Value = accepted.json().await.unwrap();
    format!("/v1/jobs/{}", accepted["job_id"].as_str().unwrap())
}

/// Waits until the job is as wanted, for at most two minutes.
async fn wait_for(server: &Server, job: &str, wanted: impl Fn(&Value) -> bool) -> Value {
    let start = Instant::now();
    loop {
        let seen = get(server, job).await;
        if wanted(&seen) {
            return seen;
        }
        assert!(start.elapsed() < Duration::from_secs(120), "{seen}");
        tokio::time::sleep(Duration::from_millis(20)).await;
    }
}

async fn assert_sound(place: &Place) {
    let store = Store::open(place.storage()).await.unwrap();
    assert_eq!(store.check(now_ms()).await.unwrap(), Vec::<String>::new());
    assert_eq!(place.n_drafts(), 0);
}

#[tokio::test(flavor = "multi_thread")]
async fn a_job_outlives_the_server_that_ran_it_and_has_one_result() {
    let place = Place::of_tests();
    let server = Server::start(&place);
    let job = start_job(&server).await;
    wait_for(&server, &job, |job| job["state"] == "running").await;
    server.kill();

    let server = Server::start(&place);
    let ended = wait_for(&server, &job, |job| !job["finished_at"].is_null()).await;
    assert_eq!(
        (&ended["state"], &ended["attempt"]),
        (&json!("done"), &json!(2)),
        "{ended}"
    );
    let libraries = get(&server, "/v1/libraries").await;
    assert_eq!(libraries["items"].as_array().unwrap().len(), 1);
    assert_eq!(server.terminate(), Some(0));
    assert_sound(&place).await;
}

#[tokio::test(flavor = "multi_thread")]
async fn a_server_told_to_stop_gives_its_job_back_unused() {
    let place = Place::of_tests();
    let server = Server::start(&place);
    let job = start_job(&server).await;
    wait_for(&server, &job, |job| job["state"] == "running").await;
    let start = Instant::now();
    assert_eq!(server.terminate(), Some(0));
    assert!(start.elapsed() < Duration::from_secs(20));
    assert_sound(&place).await;

    let server = Server::start(&place);
    let ended = wait_for(&server, &job, |job| !job["finished_at"].is_null()).await;
    assert_eq!(
        (&ended["state"], &ended["attempt"]),
        (&json!("done"), &json!(1)),
        "{ended}"
    );
    assert_eq!(server.terminate(), Some(0));
    assert_sound(&place).await;
}
