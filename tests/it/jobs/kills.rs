//! A server that is killed or stopped during a job (docs/explanation/promises.md, "No job is lost",
//! "Graceful stop" and "No orphans").

use std::time::{Duration, Instant};

use flockreel::jobs::clock::now_ms;
use flockreel::store::Store;
use flockreel::store::jobs::JobState;
use flockreel::store::jobs::read::JobRow;
use flockreel::store::owners::OwnerFilter;
use flockreel_core::random::uniform;
use futures_util::StreamExt;
use futures_util::stream::once;
use reqwest::StatusCode;
use serde_json::{Value, json};
use tokio::sync::oneshot;
use tokio::task::JoinHandle;

use crate::common::app::code_of;
use crate::common::clip::SWIM;
use crate::common::process::{Server, numbered_film, processes_of};
use crate::common::{Place, client};

/// Uploads the film, queues its analysis and returns the job id.
async fn start_job(server: &Server) -> Value {
    // From the second call on, the film is already stored.
    let footage: Value = server.upload(SWIM.clone()).await.json().await.unwrap();
    let wish = json!({"footage_id": footage["id"]});
    server.accept("/v1/analyses", wish).await["job_id"].clone()
}

fn is_running(job: &Value) -> bool {
    job["state"] == "running"
}

/// Returns the longest time for which a job of a killed server may stay unclaimed. With PostgreSQL the job
/// stays leased until its lease of 15 s ends, because other servers may share the queue. With SQLite the
/// next server claims it at once. Both have a tolerance of 2 s.
fn longest_orphan() -> Duration {
    match std::env::var_os("FLOCKREEL_TEST_POSTGRES") {
        Some(_) => Duration::from_secs(15 + 2),
        None => Duration::from_secs(2),
    }
}

/// Reads the row of a job while no service runs.
async fn row_of(place: &Place, job: &Value) -> JobRow {
    let store = Store::open(place.storage()).await.unwrap();
    let id = job.as_str().unwrap().parse().unwrap();
    store.job(id, &OwnerFilter::All).await.unwrap().unwrap()
}

async fn assert_sound(place: &Place) {
    let store = Store::open(place.storage()).await.unwrap();
    assert_eq!(store.check(now_ms()).await.unwrap(), Vec::<String>::new());
}

/// Asserts that the store is sound and that the drafts of the killed server are gone.
async fn assert_swept(place: &Place) {
    assert_sound(place).await;
    assert_eq!(place.n_drafts(), 0);
}

#[tokio::test(flavor = "multi_thread")]
async fn job_of_a_killed_server_is_finished_once() {
    let place = Place::from_environment();
    let server = Server::start_at(&place);
    let job = start_job(&server).await;
    server.job_when(&job, is_running).await;
    server.kill();

    let server = Server::start_at(&place);
    let start = Instant::now();
    server.job_when(&job, |job| job["attempt"] == 2).await;
    assert!(start.elapsed() < longest_orphan(), "{:?}", start.elapsed());
    let ended = server.ended(&job).await;
    assert_eq!(
        (&ended["state"], &ended["attempt"]),
        (&json!("done"), &json!(2)),
        "{ended}"
    );
    let libraries = server.json("/v1/libraries").await;
    assert_eq!(libraries["items"].as_array().unwrap().len(), 1);
    assert_eq!(server.terminate(), Some(0));
    assert_swept(&place).await;
}

#[tokio::test(flavor = "multi_thread")]
async fn stopping_server_releases_its_job_without_counting_the_attempt() {
    let place = Place::from_environment();
    let server = Server::start_at(&place);
    let job = start_job(&server).await;
    server.job_when(&job, is_running).await;
    let start = Instant::now();
    assert_eq!(server.terminate(), Some(0));
    assert!(start.elapsed() < Duration::from_secs(20));
    assert_sound(&place).await;
    let released = row_of(&place, &job).await;
    assert_eq!(
        released.state,
        JobState::Queued,
        "the job is not finished while the service stops"
    );

    let server = Server::start_at(&place);
    let ended = server.ended(&job).await;
    assert_eq!(
        (&ended["state"], &ended["attempt"]),
        (&json!("done"), &json!(1)),
        "{ended}"
    );
    assert_eq!(server.terminate(), Some(0));
    assert_swept(&place).await;
}

/// Returns the entity tags (hashes of the content) of the files of a finished analysis, when its views are done.
async fn result_of(server: &Server, job: &Value) -> Vec<String> {
    let library = job["links"]["result"].as_str().unwrap();
    let views = server.json(library).await["views"]["job_id"].clone();
    assert_eq!(server.ended(&views).await["state"], "done");
    let mut tags = Vec::new();
    for file in [
        "library.json",
        "poses.json",
        "background.png",
        "sprites.zip",
        "mattes.zip",
        "poster.jpg",
        "film.mp4",
        "overlay.mp4",
    ] {
        let url = format!("{}{library}/{file}", server.base);
        let answer = client().head(url).send().await.unwrap();
        assert_eq!(answer.status(), 200, "{file}");
        tags.push(answer.headers()["etag"].to_str().unwrap().to_owned());
    }
    tags
}

#[tokio::test(flavor = "multi_thread")]
async fn jobs_end_once_with_identical_results_after_kills() {
    let place = Place::from_environment();
    let mut server = Server::start_at(&place);
    let mut jobs = Vec::new();
    for _ in 0..3 {
        jobs.push(start_job(&server).await);
    }
    for kill in 0..4 {
        tokio::time::sleep(Duration::from_secs_f64(0.1 + 0.9 * uniform(6, &[kill]))).await;
        server.kill();
        server = Server::start_at(&place);
    }
    let mut done = Vec::new();
    for job in &jobs {
        let ended = server.ended(job).await;
        // None of them ran alone in three of the kills.
        assert_eq!(ended["state"], "done", "{ended}");
        done.push(ended);
    }
    let uncrashed = start_job(&server).await;
    let uncrashed = server.ended(&uncrashed).await;
    assert_eq!(uncrashed["attempt"], 1);
    let wanted = result_of(&server, &uncrashed).await;
    for job in &done {
        assert_eq!(result_of(&server, job).await, wanted, "{job}");
    }
    let libraries = server.json("/v1/libraries").await;
    assert_eq!(libraries["items"].as_array().unwrap().len(), done.len() + 1);
    assert_eq!(server.terminate(), Some(0));
    assert_eq!(processes_of(place.data()), Vec::<String>::new());
    let store = Store::open(place.storage()).await.unwrap();
    assert_eq!(
        store.check_after_crash(now_ms()).await.unwrap(),
        Vec::<String>::new()
    );
}

/// Uploads a film in two halves. The second half is sent when the returned sender is used.
fn slow_upload(server: &Server) -> (oneshot::Sender<()>, JoinHandle<StatusCode>) {
    let (go_on, may_go_on) = oneshot::channel::<()>();
    let film = numbered_film(1);
    let (first, second) = film.split_at(film.len() / 2);
    let (first, second) = (first.to_vec(), second.to_vec());
    let rest = async move {
        may_go_on.await.ok();
        Ok(second)
    };
    let halves = once(async move { Ok::<_, std::io::Error>(first) }).chain(once(rest));
    let sent = client()
        .post(format!("{}/v1/footage", server.base))
        .body(reqwest::Body::wrap_stream(halves))
        .send();
    (
        go_on,
        tokio::spawn(async move { sent.await.unwrap().status() }),
    )
}

#[tokio::test(flavor = "multi_thread")]
async fn stopping_server_refuses_new_requests_and_finishes_running_ones() {
    let place = Place::from_environment();
    let server = Server::start_at(&place);
    let (go_on, upload) = slow_upload(&server);
    let job = start_job(&server).await;
    server.job_when(&job, is_running).await;
    let start = Instant::now();
    server.send_sigterm();
    tokio::time::sleep(Duration::from_millis(300)).await;
    let refused = server.upload(numbered_film(2)).await;
    assert_eq!(refused.headers()["retry-after"], "5");
    assert_eq!(code_of(refused, 503).await, "stopping");
    server.job_when(&job, |job| job["state"] == "queued").await;
    // Without its jobs a service that did not wait for uploads would now end.
    tokio::time::sleep(Duration::from_millis(500)).await;
    go_on.send(()).unwrap();
    assert_eq!(upload.await.unwrap(), 201);
    assert_eq!(server.wait(), Some(0));
    assert!(
        start.elapsed() < Duration::from_secs(20),
        "{:?}",
        start.elapsed()
    );
    assert_eq!(processes_of(place.data()), Vec::<String>::new());
    assert_sound(&place).await;
    let row = row_of(&place, &job).await;
    assert_eq!((row.state, row.attempt), (JobState::Queued, 0));
}
