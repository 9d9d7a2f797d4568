//! Attempts whose processes, or whose media tools, are killed from outside or run out of memory
//! (docs/explanation/promises.md, "Poison jobs"). Only their own jobs notice.

use std::time::{Duration, Instant};

use reqwest::StatusCode;
use rustix::process::{Pid, Signal, kill_process};
use serde_json::{Value, json};

use crate::common::app::{code_of, json_of};
use crate::common::clip::SWIM;
use crate::common::process::{Server, command_lines};
use crate::common::{Place, client};

/// Kills a process whose command line contains all words, as soon as there is one.
async fn kill(words: &[&str], signal: Signal) {
    let start = Instant::now();
    loop {
        let mut lines = command_lines().into_iter();
        let found = lines.find(|(_, line)| words.iter().all(|word| line.contains(word)));
        if let Some((pid, _)) = found {
            return kill_process(Pid::from_raw(pid).unwrap(), signal).unwrap();
        }
        assert!(start.elapsed() < Duration::from_secs(120), "no {words:?}");
        tokio::time::sleep(Duration::from_millis(5)).await;
    }
}

async fn retry(server: &Server, job: &Value) -> reqwest::Response {
    let url = format!("{}/v1/jobs/{}/retry", server.base, job.as_str().unwrap());
    client().post(url).send().await.unwrap()
}

/// Returns the memory that a process uses, bytes.
fn memory_bytes(pid: u32) -> u64 {
    let status = std::fs::read_to_string(format!("/proc/{pid}/status")).unwrap();
    let line = status.lines().find(|line| line.starts_with("VmRSS:"));
    let kilobytes = line.unwrap().split_whitespace().nth(1).unwrap();
    kilobytes.parse::<u64>().unwrap() << 10
}

#[tokio::test(flavor = "multi_thread")]
async fn job_whose_process_dies_three_times_fails_alone_and_can_be_retried() {
    let place = Place::from_environment();
    let server = Server::start_at(&place);
    let culprit = server.analyze(SWIM.clone()).await;
    let job = &culprit["job_id"];
    let of_library = json!({"library_id": culprit["library_id"], "count": 2, "frames": 8});
    let follower = server.accept("/v1/flocks", of_library).await["job_id"].clone();
    let wish = json!({"footage_id": server.json("/v1/footage").await["items"][0]["id"]});
    let bystander = server.accept("/v1/analyses", wish).await["job_id"].clone();
    for attempt in 1..=3 {
        let is_attempt = |job: &Value| job["attempt"] == attempt;
        server.job_when(job, is_attempt).await;
        let name = format!("{}.{attempt}", job.as_str().unwrap());
        kill(&["attempt", &name], Signal::ABORT).await;
    }
    let ended = server.ended(job).await;
    assert_eq!(ended["error"]["code"], "crashed_worker", "{ended}");
    assert_eq!(ended["retriable"], true);
    let ended = server.ended(&follower).await;
    assert_eq!(ended["error"]["code"], "input_failed", "{ended}");
    assert_eq!(ended["retriable"], false);
    let ended = server.ended(&bystander).await;
    let outcome = (&ended["state"], &ended["attempt"]);
    assert_eq!(outcome, (&json!("done"), &json!(1)), "{ended}");

    assert_eq!(
        code_of(retry(&server, &bystander).await, 409).await,
        "retry_refused"
    );
    let queued = json_of(retry(&server, job).await, StatusCode::ACCEPTED).await;
    assert_eq!((&queued["id"], &queued["error"]), (job, &Value::Null));
    for id in [job, &follower] {
        let ended = server.ended(id).await;
        assert_eq!(ended["state"], "done", "{ended}");
    }
    assert_eq!(server.terminate(), Some(0));
    assert_eq!(place.n_drafts(), 0);
}

#[tokio::test(flavor = "multi_thread")]
async fn job_whose_media_tool_is_killed_from_outside_is_done_by_the_next_attempt() {
    let place = Place::local();
    let server = Server::start_at(&place);
    let accepted = server.analyze(SWIM.clone()).await;
    let name = format!("{}.1", accepted["job_id"].as_str().unwrap());
    // The encoder writes to the folder of the attempt.
    kill(&["ffmpeg", &name], Signal::KILL).await;
    let ended = server.ended(&accepted["job_id"]).await;
    let outcome = (&ended["state"], &ended["attempt"]);
    assert_eq!(outcome, (&json!("done"), &json!(2)), "{ended}");
    assert_eq!(server.terminate(), Some(0));
    assert_eq!(place.n_drafts(), 0);
}

/// Queues a flock of so many individuals, frames and pixels, and returns the id of its job.
async fn flock(server: &Server, library: &Value, size: (u32, u32, [u32; 2])) -> Value {
    let (count, frames, size_px) = size;
    let render = json!({"size_px": size_px});
    let wish = json!({"library_id": library, "count": count, "frames": frames, "render": render});
    server.accept("/v1/flocks", wish).await["job_id"].clone()
}

const HUGE: (u32, u32, [u32; 2]) = (400, 5000, [3840, 2160]);
const SMALL: (u32, u32, [u32; 2]) = (2, 8, [320, 240]);

#[tokio::test(flavor = "multi_thread")]
async fn job_over_its_memory_limit_fails_and_leaves_the_service_as_it_was() {
    let place = Place::local();
    let server = Server::start_with(place.data(), &["--job-memory-bytes", "150000000"]);
    let accepted = server.analyze(SWIM.clone()).await;
    let ended = server.ended(&accepted["job_id"]).await;
    assert_eq!(ended["state"], "done", "{ended}");
    let before = memory_bytes(server.pid());
    let huge = flock(&server, &accepted["library_id"], HUGE).await;
    let huge = server.ended(&huge).await;
    assert_eq!(huge["error"]["code"], "memory_limit", "{huge}");
    assert_eq!(huge["attempt"], 1);
    let small = flock(&server, &accepted["library_id"], SMALL).await;
    let small = server.ended(&small).await;
    assert_eq!(small["state"], "done", "{small}");
    let grown = memory_bytes(server.pid()).saturating_sub(before);
    assert!(grown < 100 << 20, "{grown}");
    assert_eq!(server.terminate(), Some(0));
    assert_eq!(place.n_drafts(), 0);
}

#[tokio::test(flavor = "multi_thread")]
async fn small_flock_is_done_while_a_huge_one_renders() {
    let place = Place::local();
    let server = Server::start_with(place.data(), &["--workers", "2"]);
    let accepted = server.analyze(SWIM.clone()).await;
    server.ended(&accepted["job_id"]).await;
    let mut huge = Vec::new();
    for _ in 0..2 {
        huge.push(flock(&server, &accepted["library_id"], HUGE).await);
    }
    let is_running = |job: &Value| job["state"] == "running";
    server.job_when(&huge[0], is_running).await;
    let small = flock(&server, &accepted["library_id"], SMALL).await;
    let small = server.ended(&small).await;
    assert_eq!(small["state"], "done", "{small}");
    let path = |job: &Value| format!("/v1/jobs/{}", job.as_str().unwrap());
    for (job, state) in huge.iter().zip(["running", "queued"]) {
        assert_eq!(server.json(&path(job)).await["state"], state);
    }
    // The queued one first: a worker would begin it.
    for job in huge.iter().rev() {
        server.delete(&path(job)).await;
        assert_eq!(server.ended(job).await["state"], "cancelled");
    }
    assert_eq!(server.terminate(), Some(0));
    assert_eq!(place.n_drafts(), 0);
}
