//! A service and two workers, each as on its own machine; one worker is killed during a job
//! (docs/explanation/promises.md, "No job is lost"). Every job is done once, and its files have the bytes of
//! an undisturbed run.

use std::collections::BTreeMap;
use std::time::{Duration, Instant, SystemTime};

use flockreel::jobs::Context;
use flockreel::jobs::admit::{ReceivedFiles, admit};
use flockreel::jobs::clock::now_ms;
use flockreel::store::Store;
use flockreel::store::footage::{Added, VIDEO};
use flockreel::store::owners::Owner;
use flockreel::store::space::Counted;
use reqwest::StatusCode;
use rustix::process::Signal;
use serde_json::{Value, json};
use uuid::Uuid;

use crate::common::Place;
use crate::common::app::json_of;
use crate::common::clip::SWIM;
use crate::common::process::{Server, WorkerProcess};

/// Stores the film of the swimming fish as an upload does, and returns the footage id.
pub(super) async fn admitted(store: &Store) -> Uuid {
    let draft = store.blobs().draft("film").unwrap();
    std::fs::write(draft.path().join(VIDEO), &*SWIM).unwrap();
    let video = store.blobs().seal(&draft).unwrap().remove(0);
    let received = ReceivedFiles {
        draft,
        video,
        background: None,
        masks: None,
        name: "swim".into(),
        owner: Owner::local(),
        counted: Counted::Upload(Uuid::nil()),
    };
    let mut context = Context::new(store.clone(), 1);
    // The program of the test is another one.
    context.attempt_program.0 = env!("CARGO_BIN_EXE_flockreel").into();
    let (Added::New(footage) | Added::Known(footage)) = admit(&context, received).await.unwrap();
    footage.id
}

/// Queues two analyses, and a flock and a fish from each. Returns the job ids and the paths of result
/// files, in the same order for every call.
async fn queue_everything(server: &Server) -> (Vec<Value>, Vec<String>) {
    let footage = json_of(server.upload(SWIM.clone()).await, StatusCode::CREATED).await;
    let (mut jobs, mut files) = (Vec::new(), Vec::new());
    for seed in 1..=2 {
        let wish = json!({"footage_id": footage["id"]});
        let analysis = server.accept("/v1/analyses", wish).await;
        let library = &analysis["library_id"];
        let wish = json!({"library_id": library, "count": 3, "frames": 20, "seed": seed});
        let flock = server.accept("/v1/flocks", wish).await;
        let wish = json!({"library_id": library});
        let fish = server.accept("/v1/fish", wish).await;
        for accepted in [&analysis, &flock, &fish] {
            jobs.push(accepted["job_id"].clone());
        }
        for (kind, id, names) in [
            (
                "libraries",
                library,
                &["library.json", "poses.json", "sprites.zip", "poster.jpg"][..],
            ),
            ("flocks", &flock["flock_id"], &["flock.json", "video.mp4"]),
            ("fish", &fish["fish_id"], &["video.mp4", "model.glb"]),
        ] {
            let id = id.as_str().unwrap();
            files.extend(names.iter().map(|name| format!("/v1/{kind}/{id}/{name}")));
        }
    }
    (jobs, files)
}

async fn all_done(server: &Server, jobs: &[Value]) -> Vec<Value> {
    let mut ended = Vec::new();
    for id in jobs {
        let job = server.ended(id).await;
        assert_eq!(job["state"], "done", "{job}");
        ended.push(job);
    }
    ended
}

async fn contents(server: &Server, files: &[String]) -> Vec<Vec<u8>> {
    let mut contents = Vec::new();
    for path in files {
        let answer = server.get(path).await;
        assert_eq!(answer.status(), StatusCode::OK, "{path}");
        contents.push(answer.bytes().await.unwrap().to_vec());
    }
    contents
}

/// Returns the contents of the result files of an undisturbed run on one machine.
async fn undisturbed() -> Vec<Vec<u8>> {
    let place = Place::local();
    let server = Server::start_at(&place);
    let (jobs, files) = queue_everything(&server).await;
    all_done(&server, &jobs).await;
    let contents = contents(&server, &files).await;
    assert_eq!(server.terminate(), Some(0));
    contents
}

/// Waits until a worker has logged these words, and returns its index.
async fn when_any(workers: &[WorkerProcess], words: &str) -> usize {
    let begun = Instant::now();
    loop {
        let found = workers.iter().position(|worker| worker.has_logged(words));
        if let Some(found) = found {
            return found;
        }
        assert!(begun.elapsed() < Duration::from_secs(60), "{words}");
        tokio::time::sleep(Duration::from_millis(5)).await;
    }
}

#[tokio::test(flavor = "multi_thread")]
#[ignore = "needs PostgreSQL and a bucket: make scale-test"]
async fn worker_killed_during_a_job_changes_no_result() {
    let expected = undisturbed().await;
    let place = Place::shared();
    let server = Server::start_at(&place);
    let machines = [place.second_machine(), place.second_machine()];
    let mut workers: Vec<_> = machines.iter().map(WorkerProcess::start).collect();
    when_any(&workers, "waiting for jobs").await;
    let (jobs, files) = queue_everything(&server).await;
    let killed = workers.remove(when_any(&workers, "job claimed").await);
    killed.signal(Signal::KILL);
    drop(killed);

    let ended = all_done(&server, &jobs).await;
    let n_attempts: i64 = ended
        .iter()
        .map(|job| job["attempt"].as_i64().unwrap())
        .sum();
    assert_eq!(
        n_attempts,
        jobs.len() as i64 + 1,
        "one was tried twice: {ended:?}"
    );
    let found = contents(&server, &files).await;
    let differ: BTreeMap<_, _> = (files.iter().zip(found.iter().zip(&expected)))
        .filter(|(_, (found, expected))| found != expected)
        .map(|(path, (found, expected))| (path, (found.len(), expected.len())))
        .collect();
    assert_eq!(differ, BTreeMap::new());
    assert_eq!(workers.remove(0).terminate(), Some(0));
    assert_eq!(server.terminate(), Some(0));

    let store = Store::open(place.storage()).await.unwrap();
    let in_two_hours = SystemTime::now() + Duration::from_secs(7200);
    store.sweep(in_two_hours).await.unwrap();
    assert_eq!(store.check(now_ms()).await.unwrap(), Vec::<String>::new());
    let mut folders = store.blobs().folders().await.unwrap();
    folders.retain(|folder| !folder.name.starts_with("views/"));
    assert_eq!(folders.len(), 1 + jobs.len());
}
