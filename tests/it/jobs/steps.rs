//! Steps a worker by hand, with shell scripts in place of the computation: no video is decoded.

use std::path::Path;
use std::time::Duration;

use flockreel::jobs::worker::{Step, Worker};
use flockreel::store::jobs::cancel::Cancel;
use flockreel::store::jobs::requeue::End;
use flockreel::store::jobs::{Change, JobState};
use flockreel::store::owners::OwnerFilter;
use flockreel_core::code::Code;
use flockreel_core::ids::JobId;
use serde_json::json;

use crate::common::TestApp;
use crate::common::clip::TINY;
use crate::common::process::processes_of;
use crate::common::substitute::{UNTIL_STOPPED, done, failed, until_exists, with_script};

/// Returns an app with one queued analysis, and the id of its job.
async fn with_job() -> (TestApp, JobId) {
    let app = TestApp::idle().await;
    let footage_id = app.upload(&TINY).await;
    let body = json!({"footage_id": footage_id});
    let accepted = app.accept("/v1/analyses", body).await;
    let job = accepted["job_id"].as_str().unwrap().parse().unwrap();
    (app, job)
}

/// Returns commands that make a library.
fn library() -> String {
    done(&[("library.json", "{}")], &json!({}))
}

/// Returns a worker whose attempts run these shell commands.
fn worker(app: &TestApp, commands: &str) -> Worker {
    Worker::new(with_script(&app.context, commands))
}

async fn state_of(app: &TestApp, job: JobId) -> (JobState, i64) {
    let row = app.context.store.job(job, &OwnerFilter::All).await;
    let row = row.unwrap().unwrap();
    (row.state, row.attempt)
}

#[tokio::test]
async fn done_job_has_its_files_stored() {
    let (app, job) = with_job().await;
    let worker = worker(&app, &library());
    assert_eq!(worker.step().await.unwrap(), Step::Done(job));
    assert_eq!(app.n_folders("libraries").await, 1);
    app.assert_sound().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn worker_with_an_old_fence_discards_its_output() {
    let (app, job) = with_job().await;
    let gates = tempfile::tempdir().unwrap();
    let (first, second) = (gates.path().join("first"), gates.path().join("second"));
    let step_after = |gate: &Path| {
        let worker = worker(&app, &(until_exists(gate) + &library()));
        tokio::spawn(async move { worker.step().await.unwrap() })
    };
    // During the first worker's attempt, the job is rescued and a second worker claims it. The second
    // worker finishes after the first has ended.
    let stale = step_after(&first);
    app.job_when(&json!(job), |job| job["attempt"] == 1).await;
    app.context.store.rescue_all(0).await.unwrap();
    let fresh = step_after(&second);
    app.job_when(&json!(job), |job| job["attempt"] == 2).await;
    std::fs::write(&first, b"").unwrap();
    assert_eq!(stale.await.unwrap(), Step::Lost(job));
    assert_eq!(app.n_folders("libraries").await, 0);
    std::fs::write(&second, b"").unwrap();
    assert_eq!(fresh.await.unwrap(), Step::Done(job));
    assert_eq!(app.n_folders("libraries").await, 1);
    app.assert_sound().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn running_job_stops_when_it_is_cancelled() {
    let (app, job) = with_job().await;
    let mut context = with_script(&app.context, UNTIL_STOPPED);
    context.lease = Duration::from_millis(900);
    let step = tokio::spawn(async move { Worker::new(context).step().await.unwrap() });
    app.job_when(&json!(job), |job| job["state"] == "running")
        .await;
    let cancel = app.context.store.cancel(job, &OwnerFilter::All, 0).await;
    assert_eq!(cancel.unwrap(), Cancel::Requested);
    assert_eq!(step.await.unwrap(), Step::Cancelled(job));
    app.assert_sound().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn running_job_is_released_when_the_service_stops() {
    let (app, job) = with_job().await;
    let worker = worker(&app, UNTIL_STOPPED);
    let step = tokio::spawn(async move { worker.step().await.unwrap() });
    app.job_when(&json!(job), |job| job["state"] == "running")
        .await;
    app.context.draining.cancel();
    assert_eq!(step.await.unwrap(), Step::Released(job));
    assert_eq!(state_of(&app, job).await, (JobState::Queued, 0));
    app.assert_sound().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn attempt_that_is_ended_with_the_service_uses_no_attempt() {
    for end in ["kill -TERM $$".to_owned(), failed("decoder_crashed", false)] {
        let (app, job) = with_job().await;
        let folder = tempfile::tempdir().unwrap();
        let gate = folder.path().join("gate");
        let worker = worker(&app, &(until_exists(&gate) + &end));
        let step = tokio::spawn(async move { worker.step().await.unwrap() });
        app.job_when(&json!(job), |job| job["state"] == "running")
            .await;
        app.context.draining.cancel();
        std::fs::write(&gate, b"").unwrap();
        assert_eq!(step.await.unwrap(), Step::Released(job));
        assert_eq!(state_of(&app, job).await, (JobState::Queued, 0));
        app.assert_sound().await;
    }
}

/// Returns a worker with a job budget of 300 ms and a lease of 900 ms, whose attempts run these shell commands.
fn hurried(app: &TestApp, commands: &str) -> Worker {
    let mut context = with_script(&app.context, commands);
    context.budget = Duration::from_millis(300);
    context.lease = Duration::from_millis(900);
    Worker::new(context)
}

#[tokio::test(flavor = "multi_thread")]
async fn job_over_its_time_limit_is_stopped_and_fails() {
    let (app, job) = with_job().await;
    let step = hurried(&app, UNTIL_STOPPED).step().await;
    assert_eq!(step.unwrap(), Step::Failed(job, Code::TimeLimit));
    app.assert_sound().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn job_is_stopped_before_it_fills_the_disk() {
    let (app, job) = with_job().await;
    let commands = format!("fallocate -l 512M \"$folder/large\"; {UNTIL_STOPPED}");
    let mut context = with_script(&app.context, &commands);
    let free_bytes = app.context.store.blobs().free_bytes().unwrap();
    context.min_free_bytes = free_bytes - (128 << 20);
    let step = Worker::new(context).step().await;
    assert_eq!(step.unwrap(), Step::Failed(job, Code::StorageFull));
    app.assert_sound().await;
}

#[tokio::test]
async fn job_waits_while_disk_space_is_short() {
    let (app, job) = with_job().await;
    let mut context = with_script(&app.context, &library());
    context.min_free_bytes = u64::MAX;
    let step = Worker::new(context.clone()).step().await;
    assert_eq!(step.unwrap(), Step::Idle);
    assert_eq!(state_of(&app, job).await, (JobState::Queued, 0));
    context.min_free_bytes = 0;
    let step = Worker::new(context).step().await;
    assert_eq!(step.unwrap(), Step::Done(job));
    app.assert_sound().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn job_that_ignores_cancellation_is_killed_with_its_whole_group() {
    let (app, job) = with_job().await;
    // Both processes name the folder.
    let commands = "sh -c 'sleep 300; :' \"$folder\" & sh -c 'sleep 300; :' \"$folder\"";
    let step = hurried(&app, commands).step().await;
    assert_eq!(step.unwrap(), Step::Failed(job, Code::TimeLimit));
    assert_eq!(app.n_folders("libraries").await, 0);
    while !processes_of(app.folder()).is_empty() {
        tokio::time::sleep(Duration::from_millis(20)).await;
    }
    app.assert_sound().await;
}

#[tokio::test]
async fn transient_error_is_retried_after_a_wait() {
    let (app, job) = with_job().await;
    let worker = worker(&app, &failed("internal", true));
    assert_eq!(worker.step().await.unwrap(), Step::Retried(job));
    assert_eq!(state_of(&app, job).await, (JobState::Queued, 1));
    let step = worker.step().await.unwrap();
    assert_eq!(step, Step::Idle, "the wait is not over");
    app.assert_sound().await;
}

/// Ends two attempts at the only job badly.
async fn end_twice(app: &TestApp, end: End) {
    let store = &app.context.store;
    for _ in 0..2 {
        let now_ms = app.context.now_ms().await.unwrap();
        let lease = store.claim(uuid::Uuid::now_v7(), now_ms, 60_000).await;
        let lease = lease.unwrap().unwrap();
        assert_eq!(store.requeue(&lease, end, 0).await.unwrap(), Change::Made);
    }
}

#[tokio::test]
async fn third_transient_error_fails_the_job() {
    let (app, job) = with_job().await;
    end_twice(&app, End::Transient).await;
    let step = worker(&app, &failed("internal", true)).step().await;
    assert_eq!(step.unwrap(), Step::Failed(job, Code::Internal));
    app.assert_sound().await;
}

#[tokio::test]
async fn attempt_that_was_killed_is_retried_after_a_wait() {
    for signal in ["ABRT", "KILL", "SEGV"] {
        let (app, job) = with_job().await;
        let worker = worker(&app, &format!("kill -{signal} $$"));
        assert_eq!(worker.step().await.unwrap(), Step::Retried(job));
        assert_eq!(worker.step().await.unwrap(), Step::Idle);
        app.assert_sound().await;
    }
}

#[tokio::test]
async fn third_crash_of_its_own_process_quarantines_the_job() {
    let (app, job) = with_job().await;
    end_twice(&app, End::Crash).await;
    let step = worker(&app, "kill -ABRT $$").step().await;
    assert_eq!(step.unwrap(), Step::Failed(job, Code::CrashedWorker));
    app.assert_sound().await;
}

#[tokio::test]
async fn transient_errors_and_crashes_have_budgets_of_their_own() {
    let (app, job) = with_job().await;
    end_twice(&app, End::Transient).await;
    let step = worker(&app, "kill -ABRT $$").step().await;
    assert_eq!(step.unwrap(), Step::Retried(job));
    app.assert_sound().await;
}

#[tokio::test]
async fn attempt_without_memory_fails_as_memory_limit_at_once() {
    let (app, job) = with_job().await;
    let commands = "echo memory allocation of 5 bytes failed >&2; kill -ABRT $$";
    let step = worker(&app, commands).step().await;
    assert_eq!(step.unwrap(), Step::Failed(job, Code::MemoryLimit));
    app.assert_sound().await;
}

#[tokio::test]
async fn attempt_that_says_nothing_or_nonsense_has_crashed() {
    for commands in [
        "exit 0",
        "exit 7",
        "yes",
        "head -c 5000000 /dev/zero; sleep 300",
        "exec >&-; sleep 300",
    ] {
        let (app, job) = with_job().await;
        let mut context = with_script(&app.context, commands);
        context.lease = Duration::from_millis(900);
        let step = Worker::new(context).step().await;
        assert_eq!(step.unwrap(), Step::Retried(job), "{commands}");
        app.assert_sound().await;
    }
}

#[tokio::test]
async fn attempt_inherits_no_environment() {
    let (app, job) = with_job().await;
    // A shell sets PWD, OLDPWD, SHLVL and _ by itself.
    let commands = "env | grep -v '^\\(PWD\\|OLDPWD\\|SHLVL\\|_\\)=' >&2 || ";
    let step = worker(&app, &format!("{commands}{{ {}}}", library()))
        .step()
        .await;
    assert_eq!(step.unwrap(), Step::Done(job));
    app.assert_sound().await;
}
