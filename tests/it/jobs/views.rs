//! The views of a library, film.mp4 and overlay.mp4: a job of their own makes them after the library.

use std::time::Duration;

use flockreel::jobs::worker::{Step, Worker};
use flockreel_core::code::Code;
use flockreel_core::ids::JobId;
use reqwest::{Response, StatusCode};
use serde_json::{Value, json};

use crate::common::TestApp;
use crate::common::app::code_of;
use crate::common::clip::{SWIM, TINY};
use crate::common::substitute::{UNTIL_STOPPED, done, with_script};

/// The files.
const FILES: [&str; 2] = ["film.mp4", "overlay.mp4"];

/// A library whose views wait in the queue.
struct Waiting {
    app: TestApp,
    /// Address of the library.
    library: String,
    job: JobId,
}

impl Waiting {
    /// Measures a film: the analysis of an attempt that runs these commands.
    async fn measured(app: TestApp, film: &[u8], worker: &Worker) -> Waiting {
        let footage_id = app.upload(film).await;
        let analysis = app.accept("/v1/analyses", json!({"footage_id": footage_id}));
        let id = analysis.await["library_id"].as_str().unwrap().to_owned();
        let library = format!("/v1/libraries/{id}");
        let step = worker.step().await.unwrap();
        assert!(matches!(step, Step::Done(_)), "{step:?}");
        let views = app.json(&library).await["views"].clone();
        assert_eq!(views["state"], "making");
        Waiting {
            job: views["job_id"].as_str().unwrap().parse().unwrap(),
            app,
            library,
        }
    }

    /// Makes a library without computing it.
    async fn substitute(app: TestApp) -> Waiting {
        let summary = json!({"fps": 25.0, "image_size_px": [64, 64], "view": "side", "n_frames": 10,
            "detected_share": 1.0, "n_transitions": 1, "component_share": 1.0, "clip_frames": 4, "length_px": null});
        let commands = done(&[("library.json", "{}")], &summary);
        let worker = Worker::new(with_script(&app.context, &commands));
        Waiting::measured(app, &TINY, &worker).await
    }

    /// Returns a worker whose attempts at views run these shell commands.
    fn worker(&self, commands: &str) -> Worker {
        Worker::new(with_script(&self.app.context, commands))
    }

    async fn get(&self, file: &str) -> Response {
        let path = format!("{}/{file}", self.library);
        self.app.get(&path).send().await.unwrap()
    }

    async fn state(&self) -> Value {
        self.app.json(&self.library).await["views"]["state"].clone()
    }

    /// Asserts that both files are there, with this content.
    async fn assert_made(&self, content: &str) {
        assert_eq!(self.state().await, "done");
        for file in FILES {
            assert_eq!(
                self.get(file).await.text().await.unwrap(),
                content,
                "{file}"
            );
        }
        assert_eq!(self.app.n_folders("views").await, 1);
    }

    /// Waits until the attempt at the views runs.
    async fn until_running(&self) {
        let id = json!(self.job.to_string());
        self.app
            .job_when(&id, |job| job["state"] == "running")
            .await;
    }
}

/// Returns commands that make both files with this content.
fn made(content: &str) -> String {
    done(&FILES.map(|file| (file, content)), &json!({}))
}

#[tokio::test(flavor = "multi_thread")]
async fn library_is_there_before_its_views() {
    let app = TestApp::idle().await;
    let worker = Worker::new(app.context.clone());
    let waiting = Waiting::measured(app, &SWIM, &worker).await;
    let app = &waiting.app;
    assert_eq!(waiting.get("poster.jpg").await.status(), 200);
    assert_eq!(waiting.get("atlas.json").await.status(), 200);
    for file in FILES {
        let early = waiting.get(file).await;
        assert!(early.headers().contains_key("retry-after"));
        assert_eq!(code_of(early, 409).await, "making");
        let head = app
            .head(&format!("{}/{file}", waiting.library))
            .send()
            .await;
        assert_eq!(head.unwrap().status(), StatusCode::CONFLICT);
    }
    let job = app.json(&format!("/v1/jobs/{}", waiting.job)).await;
    assert_eq!(
        (&job["kind"], &job["state"]),
        (&json!("views"), &json!("queued"))
    );
    assert_eq!(job["links"]["result"], json!(waiting.library));
    let id = waiting.library.rsplit('/').next().unwrap();
    assert_eq!(job["subject"], json!({"kind": "library", "id": id}));

    assert_eq!(worker.step().await.unwrap(), Step::Done(waiting.job));
    assert_eq!(waiting.state().await, "done");
    for file in FILES {
        let path = format!("{}/{file}", waiting.library);
        let part = app
            .get(&path)
            .header("range", "bytes=4-7")
            .send()
            .await
            .unwrap();
        assert_eq!(part.status(), StatusCode::PARTIAL_CONTENT);
        let etag = part.headers()["etag"].clone();
        assert_eq!(part.bytes().await.unwrap(), &b"ftyp"[..], "{file}");
        let again = app.get(&path).header("if-none-match", etag).send().await;
        assert_eq!(again.unwrap().status(), StatusCode::NOT_MODIFIED);
    }
    assert_sizes(&waiting).await;
    waiting.app.assert_sound().await;
}

/// Asserts that the views are among the files of the library, and count in its size and in the space of the owner.
async fn assert_sizes(waiting: &Waiting) {
    let library = waiting.app.json(&waiting.library).await;
    let files = library["files"].as_array().unwrap();
    for file in FILES {
        assert!(files.iter().any(|one| one["name"] == file), "{file}");
    }
    let sizes = files
        .iter()
        .map(|file| file["size_bytes"].as_i64().unwrap());
    assert_eq!(library["size_bytes"], sizes.sum::<i64>());
    let usage = waiting.app.json("/v1/usage").await;
    assert_eq!(
        usage["libraries"],
        json!({"n": 1, "size_bytes": library["size_bytes"]})
    );
    let all = ["libraries", "footage"].map(|kind| usage[kind]["size_bytes"].as_i64().unwrap());
    assert_eq!(usage["used_bytes"], all.iter().sum::<i64>());
}

#[tokio::test(flavor = "multi_thread")]
async fn views_of_a_cancelled_job_are_made_by_a_retry() {
    let waiting = Waiting::substitute(TestApp::idle().await).await;
    let job = format!("/v1/jobs/{}", waiting.job);
    let cancelled = waiting.app.delete(&job).send().await.unwrap();
    assert_eq!(cancelled.status(), StatusCode::OK);
    assert_eq!(waiting.state().await, "failed");
    let absent = waiting.get("film.mp4").await;
    assert_eq!(
        absent.headers()["link"],
        format!("<{job}>; rel=\"related\"")
    );
    let problem: Value = absent.json().await.unwrap();
    assert_eq!(
        (&problem["status"], &problem["code"]),
        (&json!(404), &json!("cancelled"))
    );
    let detail = problem["detail"].as_str().unwrap();
    assert!(detail.contains(&format!("POST {job}/retry")), "{detail}");

    let retry = waiting.app.post(&format!("{job}/retry")).send().await;
    assert_eq!(retry.unwrap().status(), StatusCode::ACCEPTED);
    assert_eq!(code_of(waiting.get("film.mp4").await, 409).await, "making");
    let step = waiting.worker(&made("new")).step().await.unwrap();
    assert_eq!(step, Step::Done(waiting.job));
    waiting.assert_made("new").await;
    waiting.app.assert_sound().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn views_of_a_lost_worker_are_made_once() {
    let waiting = Waiting::substitute(TestApp::idle().await).await;
    let stale = waiting.worker(&format!("{UNTIL_STOPPED}{}", made("old")));
    let lost = tokio::spawn(async move { stale.step().await.unwrap() });
    waiting.until_running().await;
    assert_eq!(code_of(waiting.get("film.mp4").await, 409).await, "making");
    let rescued = waiting.app.context.store.rescue_all(0).await.unwrap();
    assert_eq!(rescued.len(), 1);
    let step = waiting.worker(&made("new")).step().await.unwrap();
    assert_eq!(step, Step::Done(waiting.job));
    assert_eq!(lost.await.unwrap(), Step::Lost(waiting.job));
    waiting.assert_made("new").await;
    waiting.app.assert_sound().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn views_give_way_to_a_job_that_waits() {
    let waiting = Waiting::substitute(TestApp::idle().await).await;
    let worker = waiting.worker(UNTIL_STOPPED);
    let running = tokio::spawn(async move { worker.step().await.unwrap() });
    waiting.until_running().await;
    let id = waiting.library.rsplit('/').next().unwrap();
    let fish = waiting.app.accept("/v1/fish", json!({"library_id": id}));
    let fish: JobId = fish.await["job_id"].as_str().unwrap().parse().unwrap();
    let step = tokio::time::timeout(Duration::from_secs(30), running).await;
    assert_eq!(step.unwrap().unwrap(), Step::Released(waiting.job));
    let job = waiting.app.json(&format!("/v1/jobs/{}", waiting.job)).await;
    assert_eq!(
        (&job["state"], &job["attempt"]),
        (&json!("queued"), &json!(0))
    );
    let next = waiting.worker(&made("new"));
    assert_eq!(next.step().await.unwrap(), Step::Done(fish));
    assert_eq!(next.step().await.unwrap(), Step::Done(waiting.job));
    waiting.assert_made("new").await;
    waiting.app.assert_sound().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn deletion_of_a_library_stops_its_views() {
    let waiting = Waiting::substitute(TestApp::idle().await).await;
    let worker = waiting.worker(UNTIL_STOPPED);
    let running = tokio::spawn(async move { worker.step().await.unwrap() });
    waiting.until_running().await;
    let deleted = waiting.app.delete(&waiting.library).send().await.unwrap();
    assert_eq!(deleted.status(), StatusCode::NO_CONTENT);
    let stopped = tokio::time::timeout(Duration::from_secs(30), running).await;
    assert_eq!(stopped.unwrap().unwrap(), Step::Lost(waiting.job));
    assert_eq!(waiting.app.json("/v1/jobs").await["items"], json!([]));
    assert_eq!(
        code_of(waiting.get("film.mp4").await, 404).await,
        "not_found"
    );
    waiting.app.assert_sound().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn deletion_of_a_library_deletes_its_views() {
    let waiting = Waiting::substitute(TestApp::idle().await).await;
    waiting.worker(&made("new")).step().await.unwrap();
    waiting.assert_made("new").await;
    let deleted = waiting.app.delete(&waiting.library).send().await.unwrap();
    assert_eq!(deleted.status(), StatusCode::NO_CONTENT);
    assert_eq!(waiting.app.n_folders("views").await, 0);
    waiting.app.assert_sound().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn views_that_exceed_the_space_of_their_owner_fail_and_can_be_made_later() {
    let app = TestApp::start(&["--max-owner-bytes", "100000"]).await;
    let waiting = Waiting::substitute(app).await;
    let large = "x".repeat(60_000);
    let step = waiting.worker(&made(&large)).step().await.unwrap();
    assert_eq!(step, Step::Failed(waiting.job, Code::OwnerStorageFull));
    assert_eq!(waiting.state().await, "failed");
    let absent = waiting.get("overlay.mp4").await;
    assert_eq!(code_of(absent, 404).await, "owner_storage_full");
    assert_eq!(waiting.get("library.json").await.status(), 200);
    assert_eq!(waiting.app.n_folders("views").await, 0);
    let job = waiting.app.json(&format!("/v1/jobs/{}", waiting.job)).await;
    assert_eq!(job["retriable"], true);
    waiting.app.assert_sound().await;
}
