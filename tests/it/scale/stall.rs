//! A worker that stalls for longer than its lease and then continues (docs/explanation/promises.md,
//! "Stalled workers cannot overwrite").

use std::time::{Duration, Instant};

use flockreel::jobs::clock::now_ms;
use flockreel::jobs::{Context, IdSequence, analysis};
use flockreel::store::Store;
use flockreel::store::jobs::JobState;
use flockreel::store::owners::{Account, OwnerFilter};
use flockreel::store::resources::Library;
use flockreel_core::analysis::Params;
use flockreel_core::ids::FootageId;
use rustix::process::Signal;

use super::machines::admitted;
use crate::common::Place;
use crate::common::process::WorkerProcess;

async fn wait_until(event: &str, mut has_happened: impl AsyncFnMut() -> bool) {
    let begun = Instant::now();
    while !has_happened().await {
        assert!(begun.elapsed() < Duration::from_secs(120), "never: {event}");
        tokio::time::sleep(Duration::from_millis(20)).await;
    }
}

#[tokio::test]
#[ignore = "needs PostgreSQL and a bucket: make scale-test"]
async fn worker_stalled_past_its_lease_overwrites_nothing() {
    let place = Place::shared();
    let store = Store::open(place.storage()).await.unwrap();
    let context = Context::new(store.clone(), 1);
    let footage_id = FootageId(admitted(&store).await);
    let input = analysis::Input {
        footage_id,
        params: Params::default(),
    };
    let (account, mut ids) = (Account::local(), IdSequence::random());
    let queued = context.enqueue(&input, None, &account, &mut ids);
    let (job, library) = queued.await.unwrap();
    // The views are made later, by another job.
    let stored = async || {
        let row = store.resource::<Library>(library.0, &OwnerFilter::All);
        row.await.unwrap().map(|library| Library {
            views_state: None,
            views_folder: None,
            size_bytes: 0,
            ..library
        })
    };

    let machine = place.second_machine();
    let stalled = WorkerProcess::start(&machine);
    let claims = async || stalled.has_logged("job claimed");
    wait_until("the worker claims the job", claims).await;
    stalled.signal(Signal::STOP);
    let fresh = WorkerProcess::start(&place.second_machine());
    let row = async || store.job(job, &OwnerFilter::All).await.unwrap().unwrap();
    wait_until("the other worker finishes the job", async || {
        row().await.state == JobState::Done
    })
    .await;
    let finished = row().await;
    let kept = stored().await;

    stalled.signal(Signal::CONT);
    let ends = async || {
        // The connection to the bucket may have ended while the worker stalled: then the attempt ends badly.
        [
            "job stopped",
            "job result discarded",
            "job failed",
            "job requeued",
        ]
        .iter()
        .any(|words| stalled.has_logged(words))
    };
    wait_until("the stalled worker ends the job", ends).await;
    let log = stalled.log();
    let job_name = job.0.to_string();
    let mut done = log.lines().filter(|line| line.contains("job done"));
    assert!(!done.any(|line| line.contains(&job_name)), "{log}");
    assert_eq!(stalled.terminate(), Some(0));
    assert_eq!(fresh.terminate(), Some(0));

    assert_eq!(row().await, finished);
    let folder = &kept.as_ref().unwrap().folder;
    assert!(finished.attempt == 2 && folder.ends_with(".2"), "{folder}");
    assert_eq!(stored().await, kept);
    let mut folders = store.blobs().folders().await.unwrap();
    folders.retain(|folder| !folder.name.starts_with("views/"));
    assert_eq!(folders.len(), 2, "a footage and a library");
    assert_eq!(machine.n_drafts(), 0);
    assert_eq!(store.check(now_ms()).await.unwrap(), Vec::<String>::new());
}
