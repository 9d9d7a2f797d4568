//! One request with a film and parameters: it uploads the film and queues the jobs.

use reqwest::StatusCode;
use reqwest::multipart::{Form, Part};
use serde_json::json;

use crate::common::TestApp;
use crate::common::app::{code_of, json_of};
use crate::common::clip::{SWIM, TINY};

#[tokio::test]
async fn analysis_request_with_a_film_stores_it_first() {
    let app = TestApp::idle().await;
    let raw = app
        .post("/v1/analyses?name=a.mp4")
        .header("content-type", "video/mp4");
    let raw = raw.body(TINY.clone()).send().await.unwrap();
    let raw = json_of(raw, StatusCode::ACCEPTED).await;
    let form = Form::new()
        .text("params", r#"{"threshold": 30}"#)
        .part("video", Part::bytes(TINY.clone()));
    let form = app.send_form("/v1/analyses", form).await;
    let form = json_of(form, StatusCode::ACCEPTED).await;
    assert_eq!(form["footage_id"], raw["footage_id"], "the same bytes");
    assert_ne!(form["job_id"], raw["job_id"]);
    for params in ["{", "[]", r#"{"colour": 1}"#] {
        let form = Form::new().part("video", Part::bytes(TINY.clone()));
        let answer = app
            .post("/v1/analyses")
            .multipart(form.text("params", params));
        let answer = answer.send().await.unwrap();
        assert_eq!(code_of(answer, 422).await, "invalid_params", "{params}");
    }
    app.assert_sound().await;
}

#[tokio::test]
async fn form_may_exceed_the_limit_of_json() {
    let app = TestApp::idle().await;
    let form = Form::new().part("video", Part::bytes(vec![7; 3 << 20]));
    let answer = app.send_form("/v1/footage", form).await;
    assert_eq!(code_of(answer, 422).await, "not_a_video");
    app.assert_sound().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn a_film_becomes_a_flock_in_one_call() {
    let app = TestApp::working().await;
    let form = Form::new()
        .part("footage", Part::bytes(SWIM.clone()).file_name("fish.mp4"))
        .text("params", json!({"count": 2, "frames": 10}).to_string());
    let answer = app.send_form("/v1/flocks", form).await;
    let link = answer.headers()["link"].to_str().unwrap().to_owned();
    let flock = json_of(answer, StatusCode::ACCEPTED).await;
    let path = format!("/v1/flocks/{}", flock["flock_id"].as_str().unwrap());
    assert_eq!(link, format!("<{path}>; rel=\"related\""));
    let job = app.ended_job(&flock["job_id"]).await;
    assert_eq!(job["state"], "done", "{job}");
    assert_eq!(app.json(&path).await["library_id"], flock["library_id"]);
    app.assert_sound().await;
}
