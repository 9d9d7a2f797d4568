//! Steps a worker by hand, with substitutes for the work of the jobs: no video is decoded.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use flockreel::jobs::worker::{Step, Worker};
use flockreel::jobs::{Attempt, Error, Product};
use flockreel::store::jobs::cancel::Cancel;
use flockreel::store::jobs::finish::Source;
use flockreel::store::jobs::{Change, JobState, Lease};
use flockreel::store::owners::OwnerFilter;
use flockreel_core::code::Code;
use flockreel_core::ids::JobId;
use flockreel_core::progress::Progress;
use serde_json::json;

use crate::common::TestApp;
use crate::common::clip::TINY;

/// Returns an app with one queued analysis, and the ids of the job and its footage.
async fn with_job() -> (TestApp, JobId, uuid::Uuid) {
    let app = TestApp::idle().await;
    let footage_id = app.upload(&TINY).await;
    let body = json!({"footage_id": footage_id});
    let accepted = app.accept("/v1/analyses", body).await;
    let job = accepted["job_id"].as_str().unwrap().parse().unwrap();
    (app, job, footage_id.parse().unwrap())
}

fn product(attempt: &Attempt, footage: uuid::Uuid) -> Result<Product, Error> {
    std::fs::write(attempt.folder().join("library.json"), b"{}")?;
    Ok(Product {
        source: Source::Resource(footage),
        params: "{}".into(),
        summary: "{}".into(),
    })
}

fn wait_until_cancelled(attempt: &Attempt) -> Result<Product, Error> {
    while !attempt.listener.cancelled() {
        std::thread::yield_now();
    }
    Err(Error::Cancelled)
}

#[tokio::test]
async fn done_job_has_its_files_stored() {
    let (app, job, footage) = with_job().await;
    let worker = Worker::new(app.context.clone());
    let step = worker
        .step_by(move |_, attempt| product(attempt, footage))
        .await;
    assert_eq!(step.unwrap(), Step::Done(job));
    assert_eq!(worker.step().await.unwrap(), Step::Idle);
    assert_eq!(app.n_folders("libraries").await, 1);
    app.assert_sound().await;
}

#[tokio::test]
async fn worker_with_an_old_fence_discards_its_output() {
    let (app, job, footage) = with_job().await;
    let (end_second, second_may_end) = std::sync::mpsc::channel();
    let stale = Worker::new(app.context.clone());
    let (fresh, store) = (Worker::new(app.context.clone()), app.context.store.clone());
    let runtime = tokio::runtime::Handle::current();
    // During the first worker's attempt, the job is rescued and a second worker claims it. The second
    // worker finishes after the first has ended.
    let step = stale.step_by(move |_, attempt| {
        runtime.block_on(store.rescue_all(0))?;
        let (claimed, is_claimed) = std::sync::mpsc::channel();
        runtime.spawn(async move {
            let step = fresh.step_by(move |_, attempt| {
                claimed.send(()).unwrap();
                second_may_end.recv().unwrap();
                product(attempt, footage)
            });
            assert_eq!(step.await.unwrap(), Step::Done(job));
        });
        is_claimed.recv().unwrap();
        product(attempt, footage)
    });
    assert_eq!(step.await.unwrap(), Step::Lost(job));
    assert_eq!(app.n_folders("libraries").await, 0);
    end_second.send(()).unwrap();
    assert_eq!(app.ended_job(&json!(job)).await["state"], "done");
    assert_eq!(app.n_folders("libraries").await, 1);
    app.assert_sound().await;
}

#[tokio::test]
async fn running_job_stops_when_it_is_cancelled() {
    let (mut app, job, _) = with_job().await;
    app.context.lease = std::time::Duration::from_millis(60);
    let store = app.context.store.clone();
    let worker = Worker::new(app.context.clone());
    let (claimed, is_claimed) = tokio::sync::oneshot::channel();
    let cancel = async {
        is_claimed.await.unwrap();
        assert_eq!(
            store.cancel(job, &OwnerFilter::All, 0).await.unwrap(),
            Cancel::Requested
        );
    };
    let step = worker.step_by(|_, attempt| {
        claimed.send(()).unwrap();
        wait_until_cancelled(attempt)
    });
    let (step, ()) = tokio::join!(step, cancel);
    assert_eq!(step.unwrap(), Step::Cancelled(job));
    app.assert_sound().await;
}

#[tokio::test]
async fn running_job_is_released_when_the_service_stops() {
    let (app, job, _) = with_job().await;
    let worker = Worker::new(app.context.clone());
    let draining = app.context.draining.clone();
    let step = worker.step_by(move |_, attempt| {
        draining.cancel();
        wait_until_cancelled(attempt)
    });
    assert_eq!(step.await.unwrap(), Step::Released(job));
    let row = app
        .context
        .store
        .job(job, &OwnerFilter::All)
        .await
        .unwrap()
        .unwrap();
    assert_eq!((row.state, row.attempt), (JobState::Queued, 0));
    app.assert_sound().await;
}

#[tokio::test]
async fn panic_fails_only_its_own_job() {
    let (app, job, _) = with_job().await;
    let worker = Worker::new(app.context.clone());
    let step = worker.step_by(|_, _| panic!("panic of a test")).await;
    assert_eq!(
        step.unwrap(),
        Step::Failed(job, flockreel_core::code::Code::Internal)
    );
    assert_eq!(worker.step().await.unwrap(), Step::Idle);
    app.assert_sound().await;
}

/// Returns a worker with a job budget of 300 ms and a lease of 900 ms.
fn hurried(app: &TestApp) -> Worker {
    let mut context = app.context.clone();
    context.budget = Duration::from_millis(300);
    context.lease = Duration::from_millis(900);
    Worker::new(context)
}

#[tokio::test(flavor = "multi_thread")]
async fn job_over_its_time_limit_is_stopped_and_fails() {
    let (app, job, _) = with_job().await;
    let step = hurried(&app)
        .step_by(|_, attempt| wait_until_cancelled(attempt))
        .await;
    assert_eq!(step.unwrap(), Step::Failed(job, Code::TimeLimit));
    app.assert_sound().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn job_is_stopped_before_it_fills_the_disk() {
    let (app, job, _) = with_job().await;
    let mut context = app.context.clone();
    context.min_free_bytes = u64::MAX;
    let step = Worker::new(context)
        .step_by(|_, attempt| wait_until_cancelled(attempt))
        .await;
    assert_eq!(step.unwrap(), Step::Failed(job, Code::StorageFull));
    app.assert_sound().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn job_that_ignores_cancellation_is_abandoned_and_fails() {
    let (app, job, footage) = with_job().await;
    let ends = Arc::new(AtomicBool::new(false));
    let end = ends.clone();
    let spin = move |_: &_, attempt: &Attempt| {
        while !end.load(Ordering::Relaxed) {
            std::thread::yield_now();
        }
        product(attempt, footage)
    };
    let step = hurried(&app).step_by(spin).await;
    assert_eq!(step.unwrap(), Step::Failed(job, Code::TimeLimit));
    ends.store(true, Ordering::Relaxed);
    let worker = Worker::new(app.context.clone());
    assert_eq!(worker.step().await.unwrap(), Step::Idle);
    // The job ends late. Its output is discarded.
    tokio::time::sleep(Duration::from_millis(500)).await;
    assert_eq!(app.n_folders("libraries").await, 0);
    app.assert_sound().await;
}

fn fail_transiently(_: &Lease, _: &Attempt) -> Result<Product, Error> {
    Err(Error::Io(std::io::Error::other("transient")))
}

#[tokio::test]
async fn transient_error_is_retried_after_a_wait() {
    let (app, job, _) = with_job().await;
    let worker = Worker::new(app.context.clone());
    let step = worker.step_by(fail_transiently).await.unwrap();
    assert_eq!(step, Step::Retried(job));
    let row = app
        .context
        .store
        .job(job, &OwnerFilter::All)
        .await
        .unwrap()
        .unwrap();
    assert_eq!((row.state, row.attempt), (JobState::Queued, 1));
    assert_eq!(
        worker.step_by(fail_transiently).await.unwrap(),
        Step::Idle,
        "the wait is not over"
    );
    app.assert_sound().await;
}

#[tokio::test]
async fn transient_error_of_the_third_attempt_fails_the_job() {
    let (app, job, _) = with_job().await;
    let store = &app.context.store;
    for _ in 0..2 {
        let now_ms = app.context.now_ms().await.unwrap();
        let lease = store.claim(uuid::Uuid::now_v7(), now_ms, 60_000).await;
        let lease = lease.unwrap().unwrap();
        assert_eq!(store.retry(&lease, 0).await.unwrap(), Change::Made);
    }
    let worker = Worker::new(app.context.clone());
    let step = worker.step_by(fail_transiently).await.unwrap();
    assert_eq!(step, Step::Failed(job, Code::Internal));
    app.assert_sound().await;
}
