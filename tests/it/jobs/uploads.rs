//! Kills the service at seeded random times during uploads (docs/explanation/promises.md,
//! "No upload is lost" and "No orphans"). Each upload answered with 201 is stored byte for byte, the database
//! is sound, and no leftovers remain. The median start takes less than two seconds. FLOCKREEL_KILLS sets the
//! number of kills: 20 by default, 200 in `make kills`.

use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::{Duration, Instant};

use flockreel::jobs::clock::now_ms;
use flockreel::store::Store;
use flockreel_core::random::uniform;
use serde_json::Value;
use tokio::sync::Mutex;

use crate::common::client;
use crate::common::process::{Server, numbered_film, processes_of, sha256};

const SEED: u64 = 6;
const UPLOADERS: usize = 4;

/// Id and SHA-256 of each upload that was answered with 201.
type Accepted = Arc<Mutex<Vec<(String, String)>>>;

/// Uploads films one after the other until the server is gone.
async fn upload_on(base: String, next: Arc<AtomicUsize>, accepted: Accepted) {
    let client = client();
    loop {
        let bytes = numbered_film(next.fetch_add(1, Ordering::Relaxed));
        let sha256 = sha256(&bytes);
        let sent = client.post(format!("{base}/v1/footage")).body(bytes).send();
        let Ok(answer) = sent.await else { return };
        let status = answer.status();
        let Ok(footage) = answer.json::<Value>().await else {
            return;
        };
        assert_eq!(status, 201, "{footage}");
        let id = footage["id"].as_str().unwrap().to_owned();
        accepted.lock().await.push((id, sha256));
    }
}

async fn assert_all_there(base: &str, accepted: &[(String, String)]) {
    let client = client();
    for (id, hash) in accepted {
        let answer = client.get(format!("{base}/v1/footage/{id}/file")).send();
        let bytes = answer.await.unwrap().bytes().await.unwrap();
        assert_eq!(sha256(&bytes), *hash, "{id}");
    }
}

/// Asserts that the killed server left no drafts and no child processes.
async fn assert_nothing_left(data: &Path) {
    let n_drafts = std::fs::read_dir(data.join("tmp")).unwrap().count();
    assert_eq!(n_drafts, 0, "drafts are left");
    let start = Instant::now();
    while processes_of(data).len() > 1 {
        assert!(
            start.elapsed() < Duration::from_secs(5),
            "{:?}",
            processes_of(data)
        );
        tokio::time::sleep(Duration::from_millis(50)).await;
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn an_accepted_upload_survives_every_kill() {
    let n_kills: u64 = std::env::var("FLOCKREEL_KILLS").map_or(20, |n| n.parse().unwrap());
    let data = tempfile::tempdir().unwrap();
    let (next, accepted) = (Arc::new(AtomicUsize::new(1_000)), Accepted::default());
    let mut server = Server::start(data.path());
    // Kill within the time of three uploads, measured on this machine.
    let start = Instant::now();
    let first = client().post(format!("{}/v1/footage", server.base));
    let first = first.body(numbered_film(0)).send().await;
    assert_eq!(first.unwrap().status(), 201);
    let longest = 3 * start.elapsed();
    let mut starts = Vec::new();
    for kill in 0..n_kills {
        let uploads: Vec<_> = (0..UPLOADERS)
            .map(|_| {
                tokio::spawn(upload_on(
                    server.base.clone(),
                    next.clone(),
                    accepted.clone(),
                ))
            })
            .collect();
        tokio::time::sleep(longest.mul_f64(uniform(SEED, &[kill]))).await;
        server.kill();
        for upload in uploads {
            upload.await.unwrap();
        }
        let start = Instant::now();
        server = Server::start(data.path());
        starts.push(start.elapsed());
        assert_nothing_left(data.path()).await;
    }
    starts.sort();
    // Use the median, because a shared machine may delay single starts.
    assert!(
        starts[starts.len() / 2] < Duration::from_secs(2),
        "{starts:?}"
    );
    let accepted = accepted.lock().await.clone();
    assert!(
        accepted.len() as u64 >= n_kills / 2,
        "too little was uploaded: {}",
        accepted.len()
    );
    assert_all_there(&server.base, &accepted).await;
    assert_eq!(server.terminate(), Some(0));
    let store = Store::open(data.path()).await.unwrap();
    assert_eq!(
        store.check_after_crash(now_ms()).await.unwrap(),
        Vec::<String>::new()
    );
}
