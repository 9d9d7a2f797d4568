//! The sample of a new data folder: three ordinary jobs that film, analyze and make a flock.

use std::time::Duration;

use flockreel::jobs::worker::{Step, Worker};
use flockreel::jobs::{IdSequence, analysis, sample};
use flockreel::store::owners::Account;
use flockreel_core::ids::{FootageId, JobId};
use reqwest::StatusCode;
use serde_json::{Value, json};

use crate::common::TestApp;
use crate::common::app::code_of;
use crate::common::substitute::{until_exists, with_program};

/// Queues a sample of 20 frames. Returns the ids of its job and its footage.
async fn queued(app: &TestApp) -> (JobId, FootageId) {
    let (input, account) = (sample::Input { n_frames: 20 }, Account::local());
    let mut ids = IdSequence::random();
    let queued = app.context.enqueue(&input, None, &account, &mut ids);
    queued.await.unwrap()
}

/// Returns kind, state and subject of every job, oldest first.
async fn jobs(app: &TestApp) -> Vec<(String, String, Value)> {
    let page = app.json("/v1/jobs").await;
    let mut jobs: Vec<_> = (page["items"].as_array().unwrap().iter())
        .map(|job| {
            let text = |name: &str| job[name].as_str().unwrap().to_owned();
            (text("kind"), text("state"), job["subject"].clone())
        })
        .collect();
    jobs.reverse();
    jobs
}

#[tokio::test]
async fn empty_store_is_filled_by_three_visible_jobs() {
    let app = TestApp::idle().await;
    sample::fill(&app.context).await.unwrap();
    sample::fill(&app.context).await.unwrap(); // a second start while they are queued adds none
    let seen = jobs(&app).await;
    let kinds: Vec<&str> = seen.iter().map(|(kind, ..)| kind.as_str()).collect();
    assert_eq!(kinds, ["sample", "analysis", "flock"]);
    assert!(seen.iter().all(|(_, state, _)| state == "queued"));
    assert_eq!(seen[0].2, Value::Null);
    let film = app.json("/v1/jobs").await["items"][2]["links"]["result"].clone();
    let (kind, id) = (&seen[1].2["kind"], seen[1].2["id"].as_str().unwrap());
    assert_eq!(
        (kind, &film),
        (&json!("footage"), &json!(format!("/v1/footage/{id}")))
    );
    assert_eq!(seen[2].2["kind"], "library");
    let early = app.get(film.as_str().unwrap()).send().await.unwrap();
    assert_eq!(code_of(early, 404).await, "not_ready");
    app.assert_sound().await;
}

#[tokio::test]
async fn a_store_with_footage_is_not_filled() {
    let app = TestApp::idle().await;
    app.upload(&crate::common::clip::TINY).await;
    sample::fill(&app.context).await.unwrap();
    assert_eq!(jobs(&app).await, []);
}

#[tokio::test(flavor = "multi_thread")]
async fn a_sample_that_is_filmed_twice_is_one_footage() {
    let app = TestApp::idle().await;
    let (job, footage_id) = queued(&app).await;
    // The first attempt tells its end only after the job has been rescued.
    let outside = tempfile::tempdir().unwrap();
    let (messages, go_on) = (
        outside.path().join("messages"),
        outside.path().join("go-on"),
    );
    let program = env!("CARGO_BIN_EXE_flockreel");
    let commands = format!(
        "{program} attempt \"$folder\" >{0}.part; mv {0}.part {0}; {1} cat {0}",
        messages.display(),
        until_exists(&go_on)
    );
    let stale = Worker::new(with_program(&app.context, &commands));
    let lost = tokio::spawn(async move { stale.step().await.unwrap() });
    while !messages.exists() {
        assert!(!lost.is_finished());
        tokio::time::sleep(Duration::from_millis(20)).await;
    }
    let told = std::fs::read_to_string(&messages).unwrap();
    assert!(told.contains(r#"{"progress":["filming","#), "{told}");
    app.context.store.rescue_all(0).await.unwrap();
    std::fs::write(&go_on, b"").unwrap();
    assert_eq!(lost.await.unwrap(), Step::Lost(job));
    let fresh = Worker::new(app.context.clone());
    assert_eq!(fresh.step().await.unwrap(), Step::Done(job));

    let film = app.json(&format!("/v1/footage/{footage_id}")).await;
    assert_eq!(
        (&film["sample"], &film["name"], &film["n_frames_hint"]),
        (&json!(true), &json!("sample.mp4"), &json!(20))
    );
    let file = app
        .get(&format!("/v1/footage/{footage_id}/file"))
        .send()
        .await;
    assert_eq!(&file.unwrap().bytes().await.unwrap()[4..8], b"ftyp");
    let poster = app.get(&format!("/v1/footage/{footage_id}/poster.jpg"));
    assert_eq!(poster.send().await.unwrap().status(), 200);
    assert_eq!(app.n_folders("footage").await, 1);
    app.assert_sound().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn a_sample_that_is_stored_already_fails_with_that_reason() {
    let app = TestApp::idle().await;
    let (first, _) = queued(&app).await;
    let (second, footage_id) = queued(&app).await;
    let worker = Worker::new(app.context.clone());
    assert_eq!(worker.step().await.unwrap(), Step::Done(first));
    worker.step().await.unwrap();
    let job = app.json(&format!("/v1/jobs/{second}")).await;
    assert_eq!(job["error"]["code"], "already_stored");
    let answer = app.get(&format!("/v1/footage/{footage_id}")).send().await;
    assert_eq!(code_of(answer.unwrap(), 404).await, "already_stored");
    assert_eq!(app.n_folders("footage").await, 1);
    app.assert_sound().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn deletion_of_a_sample_deletes_its_job_and_the_jobs_after_it() {
    let app = TestApp::idle().await;
    let (job, footage_id) = queued(&app).await;
    let measure = analysis::Input {
        footage_id,
        params: Default::default(),
    };
    let (account, mut ids) = (Account::local(), IdSequence::random());
    let after = app.context.enqueue(&measure, Some(job), &account, &mut ids);
    after.await.unwrap();
    let step = Worker::new(app.context.clone()).step().await;
    assert_eq!(step.unwrap(), Step::Done(job));
    let film = format!("/v1/footage/{footage_id}");
    let answer = app.delete(&film).send().await.unwrap();
    assert_eq!(answer.status(), StatusCode::NO_CONTENT);
    assert_eq!(jobs(&app).await, []);
    assert_eq!(app.n_folders("footage").await, 0);
    let answer = app.get(&film).send().await.unwrap();
    assert_eq!(code_of(answer, 404).await, "not_found");
    app.assert_sound().await;
}
