//! Jobs in the API: accepted, listed, cancelled, followed by events, and refused with a picture.

use reqwest::StatusCode;
use serde_json::{Value, json};

use crate::common::TestApp;
use crate::common::app::{code_of, json_of};
use crate::common::clip::TINY;
use crate::common::film::Films;
use crate::common::substitute::{failed as refused, with_script};
use flockreel::jobs::worker::{Step, Worker};
use flockreel::store::tokens::Scope;
use flockreel_core::code::Code;

async fn queued(app: &TestApp) -> Value {
    let footage_id = app.upload(&TINY).await;
    analysis_of(app, &footage_id).await
}

async fn analysis_of(app: &TestApp, footage_id: &str) -> Value {
    app.accept("/v1/analyses", json!({"footage_id": footage_id}))
        .await
}

#[tokio::test(flavor = "multi_thread")]
async fn refused_film_has_a_picture_of_the_reason() {
    let mut app = TestApp::working().await;
    let (owner, stranger) = (
        app.token(Scope::Write, 9).await,
        app.token(Scope::Write, 9).await,
    );
    app.sign_in(&owner);
    let films = Films::new();
    let film = films.run("-f lavfi -i mandelbrot=size=640x480:rate=25,scroll=h=0.013:v=0.007,scale=160:120 -frames:v 60 a.mp4");
    let footage_id = app.upload(&std::fs::read(film).unwrap()).await;
    let body = json!({"footage_id": footage_id});
    let accepted = app.accept("/v1/analyses", body).await;
    let job = app.ended_job(&accepted["job_id"]).await;
    assert_eq!(job["error"]["code"], "background_not_static", "{job}");
    assert_eq!(job["error"]["mends"][0]["param"], "ignore", "{job}");
    assert_eq!(job["error"]["params"]["threshold"], 18, "{job}");
    let picture = job["error"]["picture"].as_str().expect("a picture");
    let answer = app.get(picture).send().await.unwrap();
    assert_eq!(answer.headers()["content-type"], "image/jpeg");
    let jpeg = answer.bytes().await.unwrap();
    let shown = image::load_from_memory(&jpeg).expect("a JPEG");
    assert!(shown.height() == 120 && [160, 328].contains(&shown.width()));
    app.sign_in(&stranger);
    let hidden = app.get(picture).send().await.unwrap();
    assert_eq!(code_of(hidden, 404).await, "not_found");
    app.sign_in(&owner);
    let deleted = app.delete(&format!("/v1/footage/{footage_id}"));
    assert!(deleted.send().await.unwrap().status().is_success());
    let gone = app.get(picture).send().await.unwrap();
    assert_eq!(code_of(gone, 404).await, "not_found");
    app.assert_sound().await;
}

#[tokio::test]
async fn accepted_job_has_links_to_itself_and_its_result() {
    let app = TestApp::idle().await;
    let footage_id = app.upload(&TINY).await;
    let answer = app
        .post("/v1/analyses")
        .json(&json!({"footage_id": footage_id}));
    let answer = answer.send().await.unwrap();
    let header = |name: &str| answer.headers()[name].to_str().unwrap().to_owned();
    let (location, link) = (header("location"), header("link"));
    let accepted = json_of(answer, StatusCode::ACCEPTED).await;
    let library = accepted["library_id"].as_str().unwrap();
    assert_eq!(link, format!("</v1/libraries/{library}>; rel=\"related\""));
    let job = app.json(&location).await;
    assert_eq!(
        (&job["state"], &job["kind"]),
        (&json!("queued"), &json!("analysis"))
    );
    let early = app
        .get(&format!("/v1/libraries/{library}"))
        .send()
        .await
        .unwrap();
    assert_eq!(code_of(early, 404).await, "not_ready");
    app.assert_sound().await;
}

#[tokio::test]
async fn a_queued_job_is_cancelled_once() {
    let app = TestApp::idle().await;
    let job = queued(&app).await;
    let path = format!("/v1/jobs/{}", job["job_id"].as_str().unwrap());
    let answer = app.delete(&path).send().await.unwrap();
    let cancelled = json_of(answer, StatusCode::OK).await;
    assert_eq!(cancelled["state"], "cancelled");
    let again = app.delete(&path).send().await.unwrap();
    assert_eq!(code_of(again, 409).await, "already_finished");
    app.assert_sound().await;
}

#[tokio::test]
async fn lost_result_gives_the_code_and_the_link_of_its_job() {
    let app = TestApp::idle().await;
    let footage_id = app.upload(&TINY).await;
    let failed = analysis_of(&app, &footage_id).await;
    let worker = Worker::new(with_script(
        &app.context,
        &refused("no_video_stream", false),
    ));
    let step = worker.step();
    assert!(matches!(
        step.await.unwrap(),
        Step::Failed(_, Code::NoVideoStream)
    ));
    let cancelled = analysis_of(&app, &footage_id).await;
    let job = format!("/v1/jobs/{}", cancelled["job_id"].as_str().unwrap());
    app.delete(&job).send().await.unwrap();
    for (accepted, code) in [(failed, "no_video_stream"), (cancelled, "cancelled")] {
        let id = |name: &str| accepted[name].as_str().unwrap().to_owned();
        let job = format!("/v1/jobs/{}", id("job_id"));
        for path in ["", "/library.json"] {
            let path = format!("/v1/libraries/{}{path}", id("library_id"));
            let answer = app.get(&path).send().await.unwrap();
            assert_eq!(
                answer.headers()["link"],
                format!("<{job}>; rel=\"related\"")
            );
            assert!(!answer.headers().contains_key("retry-after"));
            let problem = json_of(answer, StatusCode::NOT_FOUND).await;
            assert_eq!(problem["code"], code);
            assert!(problem["detail"].as_str().unwrap().contains(&job));
        }
    }
    app.assert_sound().await;
}

#[tokio::test]
async fn job_events_show_every_state_and_end_with_the_last() {
    let app = TestApp::idle().await;
    let job = queued(&app).await;
    let path = format!("/v1/jobs/{}", job["job_id"].as_str().unwrap());
    let events = app.get(&format!("{path}/events")).send().await.unwrap();
    assert_eq!(events.headers()["content-type"], "text/event-stream");
    let reading = tokio::spawn(events.text());
    app.delete(&path).send().await.unwrap();
    let text = reading.await.unwrap().unwrap();
    let states: Vec<Value> = text
        .lines()
        .filter_map(|line| line.strip_prefix("data: "))
        .map(|data| serde_json::from_str::<Value>(data).unwrap()["state"].clone())
        .collect();
    assert_eq!(states, [json!("queued"), json!("cancelled")]);
    app.assert_sound().await;
}

#[tokio::test]
async fn lists_are_paged_from_the_newest() {
    let app = TestApp::idle().await;
    let footage_id = app.upload(&TINY).await;
    let mut ids = Vec::new();
    for _ in 0..3 {
        let body = json!({"footage_id": footage_id});
        ids.push(app.accept("/v1/analyses", body).await["job_id"].clone());
    }
    let first = app.json("/v1/jobs?limit=2").await;
    let cursor = first["next_cursor"].as_str().unwrap();
    let second = app.json(&format!("/v1/jobs?limit=2&cursor={cursor}")).await;
    let of = |page: &Value| -> Vec<Value> {
        let items = page["items"].as_array().unwrap();
        items.iter().map(|job| job["id"].clone()).collect()
    };
    assert_eq!(
        [of(&first), of(&second)].concat(),
        [ids[2].clone(), ids[1].clone(), ids[0].clone()]
    );
    assert_eq!(second["next_cursor"], Value::Null);
    let answer = app.get("/v1/jobs?limit=0").send().await.unwrap();
    assert_eq!(code_of(answer, 422).await, "invalid_params");
    app.assert_sound().await;
}

#[tokio::test]
async fn flock_needs_an_existing_or_queued_library() {
    let app = TestApp::idle().await;
    let unknown = json!({"library_id": uuid::Uuid::now_v7(), "count": 2});
    let answer = app.post("/v1/flocks").json(&unknown).send().await.unwrap();
    assert_eq!(code_of(answer, 422).await, "invalid_params");
    let job = queued(&app).await;
    let coming = json!({"library_id": job["library_id"], "count": 2, "preset": "papers"});
    let flock = app.accept("/v1/flocks", coming).await;
    let path = format!("/v1/jobs/{}", job["job_id"].as_str().unwrap());
    app.delete(&path).send().await.unwrap();
    assert_eq!(app.ended_job(&flock["job_id"]).await["state"], "cancelled");
    app.assert_sound().await;
}
