//! Deletion: an object is deleted with its rows, its files and everything made from it, and nothing else.

use flockreel::jobs::worker::{Step, Worker};
use reqwest::StatusCode;
use serde_json::json;

use crate::common::TestApp;
use crate::common::app::code_of;
use crate::common::clip::TINY;
use crate::common::substitute::{UNTIL_STOPPED, done, with_script};

/// Returns commands that make a result without doing the work of its job.
fn pretend() -> String {
    done(&[("some.json", "{}")], &json!({}))
}

/// Creates a footage with a library, a flock, a fish and a queued flock. Returns the paths of these and of
/// the job of the first flock.
async fn family(app: &TestApp) -> Vec<String> {
    let footage = app.upload(&TINY).await;
    let analysis = app.accept("/v1/analyses", json!({"footage_id": footage}));
    let library = analysis.await["library_id"].clone();
    let of_library = json!({"library_id": library});
    let flock = app.accept("/v1/flocks", of_library.clone()).await;
    let fish = app.accept("/v1/fish", of_library.clone()).await;
    let worker = Worker::new(with_script(&app.context, &pretend()));
    for _ in 0..3 {
        let step = worker.step().await.unwrap();
        assert!(matches!(step, Step::Done(_)), "{step:?}");
    }
    let queued = app.accept("/v1/flocks", of_library).await;
    [
        ("footage", &json!(footage)),
        ("libraries", &library),
        ("flocks", &flock["flock_id"]),
        ("fish", &fish["fish_id"]),
        ("jobs", &queued["job_id"]),
        ("jobs", &flock["job_id"]),
    ]
    .map(|(noun, id)| format!("/v1/{noun}/{}", id.as_str().unwrap()))
    .to_vec()
}

async fn delete(app: &TestApp, path: &str) {
    let answer = app.delete(path).send().await.unwrap();
    assert_eq!(answer.status(), StatusCode::NO_CONTENT, "{path}");
}

async fn assert_gone(app: &TestApp, path: &str) {
    let answer = app.get(path).send().await.unwrap();
    assert_eq!(code_of(answer, 404).await, "not_found", "{path}");
}

/// Returns the number of stored folders of footage, libraries, flocks and fish.
async fn folders(app: &TestApp) -> [usize; 4] {
    let mut counts = [0; 4];
    for (count, kind) in counts
        .iter_mut()
        .zip(["footage", "libraries", "flocks", "fish"])
    {
        *count = app.n_folders(kind).await;
    }
    counts
}

#[tokio::test]
async fn deleting_footage_deletes_everything_made_from_it() {
    let app = TestApp::idle().await;
    let paths = family(&app).await;
    assert_eq!(folders(&app).await, [1, 1, 1, 1]);
    delete(&app, &paths[0]).await;
    for path in &paths {
        assert_gone(&app, path).await;
    }
    assert_eq!(folders(&app).await, [0, 0, 0, 0]);
    assert_eq!(app.json("/v1/jobs").await["items"], json!([]));
    let again = app.delete(&paths[0]).send().await.unwrap();
    assert_eq!(code_of(again, 404).await, "not_found");
    app.upload(&TINY).await;
    app.assert_sound().await;
}

#[tokio::test]
async fn deleting_a_library_keeps_its_footage() {
    let app = TestApp::idle().await;
    let paths = family(&app).await;
    delete(&app, &paths[1]).await;
    for path in &paths[1..] {
        assert_gone(&app, path).await;
    }
    assert_eq!(folders(&app).await, [1, 0, 0, 0]);
    app.json(&paths[0]).await;
    app.assert_sound().await;
}

#[tokio::test]
async fn deleting_a_flock_or_fish_deletes_nothing_else() {
    let app = TestApp::idle().await;
    let paths = family(&app).await;
    delete(&app, &paths[2]).await;
    assert_eq!(folders(&app).await, [1, 1, 0, 1]);
    delete(&app, &paths[3]).await;
    assert_eq!(folders(&app).await, [1, 1, 0, 0]);
    let queued = app.json(&paths[4]).await;
    assert_eq!(queued["state"], "queued");
    let ahead_of_time = queued["links"]["result"].as_str().unwrap();
    let answer = app.delete(ahead_of_time).send().await.unwrap();
    assert_eq!(code_of(answer, 404).await, "not_ready");
    app.assert_sound().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn running_job_stores_nothing_after_its_footage_is_deleted() {
    let mut app = TestApp::idle().await;
    app.context.lease = std::time::Duration::from_millis(300);
    let footage = app.upload(&TINY).await;
    let accepted = app.accept("/v1/analyses", json!({"footage_id": footage}));
    let job = accepted.await["job_id"].clone();
    // The job ignores the cancellation and finishes.
    let commands = format!("{UNTIL_STOPPED}{}", pretend());
    let worker = Worker::new(with_script(&app.context, &commands));
    let step = tokio::spawn(async move { worker.step().await });
    app.job_when(&job, |job| job["state"] == "running").await;
    delete(&app, &format!("/v1/footage/{footage}")).await;
    assert!(matches!(step.await.unwrap().unwrap(), Step::Lost(_)));
    assert_eq!(folders(&app).await, [0, 0, 0, 0]);
    app.assert_sound().await;
}
