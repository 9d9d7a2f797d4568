//! Limits of space (docs/explanation/promises.md, "Limited space"): stored files and announced uploads of an owner, the free
//! disk, and what `/v1/usage` and `/readyz` tell about them.

use std::time::{Duration, Instant};

use flockreel::jobs::worker::{Step, Worker};
use flockreel::store::tokens::Scope;
use flockreel_core::code::Code;
use reqwest::{Method, Response, StatusCode};
use serde_json::{Value, json};
use tokio::io::{AsyncReadExt, AsyncWriteExt};
use tokio::net::TcpStream;

use crate::common::app::code_of;
use crate::common::clip::SWIM;
use crate::common::process::numbered_film;
use crate::common::results::{Results, dataset_of, id_in};
use crate::common::{Place, TestApp};

/// Longest wait for an effect that follows a response. Free choice.
const MAX_WAIT: Duration = Duration::from_secs(30);

/// Starts a service in which every owner may have this many bytes.
async fn limited(max_owner_bytes: usize) -> TestApp {
    TestApp::start(&["--max-owner-bytes", &max_owner_bytes.to_string()]).await
}

/// Returns the stored size of a film: the film and its poster.
async fn stored_size(film: Vec<u8>) -> usize {
    let app = TestApp::idle().await;
    app.upload(&film).await;
    let n_bytes = app.json("/v1/usage").await["footage"]["size_bytes"].clone();
    app.assert_sound().await;
    usize::try_from(n_bytes.as_u64().unwrap()).unwrap()
}

async fn send(app: &TestApp, film: Vec<u8>) -> Response {
    app.post("/v1/footage").body(film).send().await.unwrap()
}

/// Sends a film without its length.
async fn send_chunked(app: &TestApp, film: Vec<u8>) -> Response {
    let pieces = futures_util::stream::iter([Ok::<_, std::io::Error>(film)]);
    let body = reqwest::Body::wrap_stream(pieces);
    app.post("/v1/footage").body(body).send().await.unwrap()
}

/// Begins a resumable upload.
async fn announce(app: &TestApp, n_bytes: u64) -> Response {
    let request = app.post("/v1/uploads").header("tus-resumable", "1.0.0");
    let request = request.header("upload-length", n_bytes);
    request.send().await.unwrap()
}

/// Asserts that an upload was begun, and returns its path.
fn path_of(answer: &Response) -> String {
    assert_eq!(answer.status(), StatusCode::CREATED);
    answer.headers()["location"].to_str().unwrap().to_owned()
}

/// Cancels a resumable upload.
async fn cancel(app: &TestApp, path: &str) {
    let request = app.delete(path).header("tus-resumable", "1.0.0");
    assert_eq!(request.send().await.unwrap().status(), 204);
}

/// Sends the head of an upload that announces `n_bytes`, and no byte of its body.
async fn send_head(app: &TestApp, n_bytes: u64) -> TcpStream {
    let authority = app.address("").replace("http://", "");
    let mut connection = TcpStream::connect(&authority).await.unwrap();
    let head = format!(
        "POST /v1/footage HTTP/1.1\r\nhost: {authority}\r\ncontent-type: video/mp4\r\n\
         content-length: {n_bytes}\r\n\r\n"
    );
    connection.write_all(head.as_bytes()).await.unwrap();
    connection
}

/// Returns the beginning of the answer on a connection.
async fn status_line(connection: &mut TcpStream) -> String {
    let mut answer = [0; 12];
    let read = connection.read_exact(&mut answer);
    tokio::time::timeout(MAX_WAIT, read).await.unwrap().unwrap();
    String::from_utf8_lossy(&answer).into_owned()
}

/// Waits until the usage is as expected.
async fn usage_when(app: &TestApp, is_so: impl Fn(&Value) -> bool) -> Value {
    let begun = Instant::now();
    loop {
        let usage = app.json("/v1/usage").await;
        if is_so(&usage) {
            return usage;
        }
        assert!(begun.elapsed() < MAX_WAIT, "{usage}");
        tokio::time::sleep(Duration::from_millis(20)).await;
    }
}

#[tokio::test]
async fn films_beyond_the_limit_of_an_owner_are_refused() {
    let (film, size) = (numbered_film(0), stored_size(numbered_film(0)).await);
    // The third film itself would fit, but not with its poster.
    let app = limited(2 * size + film.len()).await;
    let first = app.upload(&film).await;
    app.upload(&numbered_film(1)).await;
    for answer in [
        send(&app, numbered_film(2)).await,
        send_chunked(&app, numbered_film(2)).await,
    ] {
        assert!(!answer.headers().contains_key("retry-after"));
        assert_eq!(code_of(answer, 507).await, "owner_storage_full");
    }
    assert_eq!(app.n_folders("footage").await, 2);
    let again = app.post("/v1/footage").body(film).send().await.unwrap();
    assert_eq!(again.status(), 200, "a known film takes no space");
    let gone = app.delete(&format!("/v1/footage/{first}")).send().await;
    assert_eq!(gone.unwrap().status(), 204);
    app.upload(&numbered_film(2)).await;
    app.assert_sound().await;
}

#[tokio::test]
async fn body_that_does_not_fit_is_refused_before_it_arrives() {
    let app = limited(10_000).await;
    let mut connection = send_head(&app, 10_001).await;
    assert_eq!(status_line(&mut connection).await, "HTTP/1.1 507");
    app.assert_sound().await;
}

#[tokio::test]
async fn open_uploads_count_with_their_announced_sizes() {
    let mut app = TestApp::start(&["--auth", "required", "--max-owner-bytes", "10000"]).await;
    let (first, second) = (
        app.token(Scope::Write, 9).await,
        app.token(Scope::Write, 9).await,
    );
    app.sign_in(&first);
    let path = path_of(&announce(&app, 6000).await);
    let refused = announce(&app, 4001).await;
    assert_eq!(code_of(refused, 507).await, "owner_storage_full");
    let refused = send(&app, vec![7; 4001]).await;
    assert_eq!(code_of(refused, 507).await, "owner_storage_full");
    let usage = app.json("/v1/usage").await;
    assert_eq!(usage["uploads"], json!({"n": 1, "size_bytes": 6000}));
    assert_eq!(
        (&usage["used_bytes"], &usage["max_bytes"]),
        (&json!(6000), &json!(10_000))
    );
    app.sign_in(&second);
    assert_eq!(app.json("/v1/usage").await["used_bytes"], 0);
    path_of(&announce(&app, 10_000).await);
    app.sign_in(&first);
    cancel(&app, &path).await;
    path_of(&announce(&app, 10_000).await);
    app.assert_sound().await;
}

#[tokio::test]
async fn complete_upload_takes_the_space_that_it_had_announced() {
    let film = numbered_film(0);
    let app = limited(stored_size(film.clone()).await).await;
    let path = path_of(&announce(&app, film.len() as u64).await);
    let last = app.request(Method::PATCH, &path).body(film);
    let last = last
        .header("tus-resumable", "1.0.0")
        .header("upload-offset", 0)
        .header("content-type", "application/offset+octet-stream");
    assert_eq!(last.send().await.unwrap().status(), 204);
    let usage = app.json("/v1/usage").await;
    assert_eq!(usage["used_bytes"], usage["max_bytes"]);
    assert_eq!(usage["uploads"]["n"], 0);
    app.assert_sound().await;
}

#[tokio::test]
async fn bodies_of_requests_count_while_they_arrive() {
    let app = limited(1_000_000).await;
    let arriving = send_head(&app, 999_999).await;
    usage_when(&app, |usage| usage["incoming_bytes"] == 999_999).await;
    for refused in [
        send(&app, numbered_film(0)).await,
        send_chunked(&app, numbered_film(0)).await,
        announce(&app, 2).await,
    ] {
        assert_eq!(code_of(refused, 507).await, "owner_storage_full");
    }
    drop(arriving);
    usage_when(&app, |usage| usage["used_bytes"] == 0).await;
    app.upload(&numbered_film(0)).await;
    app.assert_sound().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn job_whose_result_does_not_fit_fails() {
    let size = stored_size(SWIM.clone()).await;
    let app = limited(size + 1).await;
    let footage = app.upload(&SWIM).await;
    let body = json!({"footage_id": footage});
    let accepted = app.accept("/v1/analyses", body.clone()).await;
    let step = Worker::new(app.context.clone()).step().await.unwrap();
    assert!(
        matches!(step, Step::Failed(_, Code::OwnerStorageFull)),
        "{step:?}"
    );
    let job = app.ended_job(&accepted["job_id"]).await;
    assert_eq!(job["error"]["code"], "owner_storage_full");
    assert_eq!(app.n_folders("libraries").await, 0);
    path_of(&announce(&app, 1).await);
    let refused = app.post("/v1/analyses").json(&body).send().await.unwrap();
    assert_eq!(code_of(refused, 507).await, "owner_storage_full");
    app.assert_sound().await;
}

#[tokio::test]
async fn usage_tells_number_and_size_of_the_things_of_the_caller() {
    let mut app = TestApp::start(&["--auth", "required", "--keep-days", "30"]).await;
    let (owner, stranger) = (
        app.token(Scope::Write, 9).await,
        app.token(Scope::Read, 9).await,
    );
    app.sign_in(&owner);
    let results = Results::make(&app, "finch.mp4").await;
    let dataset = dataset_of(&app, &id_in(&results.library)).await;
    let usage = app.json("/v1/usage").await;
    let mut used_bytes = 0;
    for (noun, path) in [
        ("footage", &results.footage),
        ("libraries", &results.library),
        ("flocks", &results.flock),
        ("fish", &results.fish),
        ("datasets", &dataset),
    ] {
        let size_bytes = app.json(path).await["size_bytes"].as_i64().unwrap();
        assert_eq!(usage[noun], json!({"n": 1, "size_bytes": size_bytes}));
        used_bytes += size_bytes;
    }
    assert_eq!(usage["used_bytes"], used_bytes);
    assert_eq!(usage["max_bytes"], 34_359_738_368_u64);
    assert_eq!(
        (&usage["keep_days"], &usage["keep_jobs_days"]),
        (&json!(30), &json!(90))
    );
    app.sign_in(&stranger);
    let usage = app.json("/v1/usage").await;
    assert_eq!(
        (&usage["used_bytes"], &usage["flocks"]["n"]),
        (&json!(0), &json!(0))
    );
    app.assert_sound().await;
}

#[tokio::test]
async fn announced_bytes_take_no_space_of_the_disk_from_others() {
    let disk = rustix::fs::statvfs(std::env::temp_dir()).unwrap();
    let n_free = disk.f_bavail * disk.f_frsize;
    // Half of what uploads may take, with room for what other programs write and delete meanwhile.
    let n_bytes = n_free / 4;
    let reserve = (n_free / 2).to_string();
    let n_free = n_free.to_string();
    let flags = ["--max-owner-bytes", "0", "--max-upload-bytes", &n_free];
    let flags = [&flags[..], &["--disk-reserve-bytes", &reserve]].concat();
    // Uploads to a bucket do not take the disk of the service.
    let app = TestApp::on(Place::with_files_in_folder(), &flags).await;
    for _ in 0..3 {
        path_of(&announce(&app, n_bytes).await);
    }
    let arriving = send_head(&app, n_bytes).await;
    usage_when(&app, |usage| usage["incoming_bytes"] == n_bytes).await;
    path_of(&announce(&app, n_bytes).await);
    app.upload(&numbered_film(0)).await;
    assert_eq!(app.json("/readyz").await["refused"], json!([]));

    // An upload that does not fit is refused when it begins.
    let refused = announce(&app, 3 * n_bytes).await;
    assert!(refused.headers().contains_key("retry-after"));
    assert_eq!(code_of(refused, 507).await, "storage_full");
    let mut body = send_head(&app, 3 * n_bytes).await;
    assert_eq!(status_line(&mut body).await, "HTTP/1.1 507");
    drop(arriving);
    usage_when(&app, |usage| usage["incoming_bytes"] == 0).await;
    let metrics = app.get("/metrics").send().await.unwrap();
    let metrics = metrics.text().await.unwrap();
    for line in [
        format!("flockreel_announced_bytes {}\n", 4 * n_bytes),
        "flockreel_space_refusals_total{limit=\"disk\"} 2\n".to_owned(),
        "flockreel_space_refusals_total{limit=\"owner\"} 0\n".to_owned(),
    ] {
        assert!(metrics.contains(&line), "{line}{metrics}");
    }
    app.assert_sound().await;
}

#[tokio::test]
async fn service_below_the_reserve_of_the_disk_is_ready_for_everything_but_uploads() {
    let app = TestApp::start(&["--disk-reserve-bytes", "0"]).await;
    let ready = app.json("/readyz").await;
    assert_eq!(
        (&ready["ready"], &ready["refused"]),
        (&json!(true), &json!([]))
    );
    app.assert_sound().await;
    // More than any disk has, of which jobs leave an eighth free.
    let reserve = (1_u64 << 60).to_string();
    let app = TestApp::start(&["--disk-reserve-bytes", &reserve]).await;
    let refused = send(&app, numbered_film(0)).await;
    assert_eq!(code_of(refused, 507).await, "storage_full");
    let ready = app.json("/readyz").await;
    let reason = "the free disk space is below the reserve";
    // If machines share the queue, another may have space for the jobs.
    let work = if app.context.store.is_alone() {
        &["uploads", "jobs"][..]
    } else {
        &["uploads"]
    };
    let refused: Vec<_> = (work.iter())
        .map(|work| json!({"work": work, "reason": reason}))
        .collect();
    assert_eq!(
        (&ready["ready"], &ready["refused"], &ready["disk"]["ok"]),
        (&json!(true), &json!(refused), &json!(false))
    );
    assert_eq!(app.json("/v1/footage").await["items"], json!([]));
    app.assert_sound().await;
}
