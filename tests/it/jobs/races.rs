//! Many processes claim jobs from one queue concurrently (docs/explanation/promises.md,
//! "Race-free claims"). They are further instances of this test program. FLOCKREEL_RACE_JOBS sets the number
//! of jobs, 400 by default.

use std::process::{Command, Stdio};

use flockreel::store::Store;
use flockreel::store::footage::{Added, Footage, VIDEO};
use flockreel::store::jobs::cancel::Cancel;
use flockreel::store::jobs::enqueue::NewJob;
use flockreel::store::jobs::finish::{Outcome, Source};
use flockreel::store::jobs::{Change, JobState, Kind};
use flockreel::store::owners::{Account, Owner, OwnerFilter};
use flockreel::store::resources::Fish;
use flockreel_core::ids::JobId;
use uuid::Uuid;

use crate::common::Place;

const N_PROCESSES: usize = 8;
const LEASE_MS: i64 = 600_000;

fn n_jobs() -> usize {
    let wanted = std::env::var("FLOCKREEL_RACE_JOBS").ok();
    wanted.map_or(400, |n| n.parse().unwrap())
}

fn job(kind: Kind) -> NewJob {
    NewJob {
        job_id: JobId(Uuid::now_v7()),
        account: Account::local(),
        kind,
        input: "{}".into(),
        result_id: Uuid::now_v7(),
        after_job: None,
        priority: 0,
        is_small: false,
        max_queued: i64::MAX,
    }
}

/// Returns a result without files.
fn outcome(source: Uuid, result: Uuid) -> Outcome {
    Outcome {
        source: Source::Resource(source),
        folder: format!("{result}"),
        files: Vec::new(),
        params: "{}".into(),
        summary: "{}".into(),
    }
}

/// Stores a library without files, as input of the fish jobs.
async fn library(store: &Store) -> Uuid {
    let draft = store.blobs().draft("film").unwrap();
    std::fs::write(draft.path().join(VIDEO), b"film").unwrap();
    let files = store.blobs().seal(&draft).unwrap();
    let footage = Footage {
        id: Uuid::now_v7(),
        owner: Owner::local(),
        folder: String::new(),
        sha256: files[0].sha256.clone(),
        background_sha256: Vec::new(),
        masks_sha256: Vec::new(),
        name: "film".into(),
        size_bytes: 4,
        width: 1,
        height: 1,
        fps: 1.0,
        n_frames_hint: 1,
        sample: false,
        pinned: false,
        used_ms: 0,
        created_ms: 0,
    };
    let added = store.add_footage(footage, draft, &files, None);
    let added = added.await.unwrap();
    let (Added::New(footage) | Added::Known(footage)) = added;
    store.enqueue(&job(Kind::Analysis), 0).await.unwrap();
    let lease = store.claim(Uuid::now_v7(), 0, LEASE_MS).await;
    let lease = lease.unwrap().unwrap();
    let made = outcome(footage.id, lease.result_id);
    assert_eq!(store.finish(&lease, &made, 0).await.unwrap(), Change::Made);
    // The job of its views does not take part.
    let jobs = store.jobs_under_way(0, &OwnerFilter::All).await.unwrap();
    for views in jobs.iter().filter(|job| job.kind == Kind::Views) {
        let cancel = store.cancel(views.id, &OwnerFilter::All, 0);
        assert_eq!(cancel.await.unwrap(), Cancel::Cancelled);
    }
    lease.result_id
}

#[tokio::test]
async fn concurrent_processes_do_each_job_once() {
    let place = Place::from_environment();
    let store = Store::open(place.storage()).await.unwrap();
    let library = library(&store).await;
    let mut jobs = Vec::new();
    for _ in 0..n_jobs() {
        let job = job(Kind::Fish);
        store.enqueue(&job, 0).await.unwrap();
        jobs.push(job.job_id);
    }
    let begun = std::time::Instant::now();
    let racers: Vec<_> = (0..N_PROCESSES)
        .map(|_| racer(&place, library).spawn().unwrap())
        .collect();
    let mut n_done = 0;
    for racer in racers {
        let ended = racer.wait_with_output().unwrap();
        let said = String::from_utf8_lossy(&ended.stdout).into_owned();
        assert!(ended.status.success(), "{said}");
        let count = said.split("done: ").nth(1).unwrap();
        n_done += count
            .split_whitespace()
            .next()
            .unwrap()
            .parse::<usize>()
            .unwrap();
    }
    println!(
        "{} jobs: {:.1} s",
        jobs.len(),
        begun.elapsed().as_secs_f64()
    );
    assert_eq!(n_done, jobs.len());
    for job in jobs {
        let row = store.job(job, &OwnerFilter::All).await.unwrap().unwrap();
        assert_eq!((row.state, row.attempt), (JobState::Done, 1));
        let made = store
            .resource::<Fish>(row.result_id, &OwnerFilter::All)
            .await
            .unwrap();
        assert_eq!(made.unwrap().job_id, job.0);
    }
}

fn racer(place: &Place, library: Uuid) -> Command {
    let mut racer = Command::new(std::env::current_exe().unwrap());
    racer
        .args(["--exact", "jobs::races::claiming_process", "--ignored"])
        .arg("--nocapture")
        .env("FLOCKREEL_RACE_FOR", library.to_string())
        .env("FLOCKREEL_RACE_PLACE", place.flags().join(" "))
        .stdout(Stdio::piped());
    racer
}

#[tokio::test]
#[ignore = "started as a process by the test above"]
async fn claiming_process() {
    let of = |name: &str| std::env::var(name).unwrap();
    let library = of("FLOCKREEL_RACE_FOR").parse().unwrap();
    let storage = Place::storage_of(of("FLOCKREEL_RACE_PLACE").split(' '));
    let store = Store::open_beside(storage).await.unwrap();
    let mut n_done = 0;
    while let Some(lease) = store.claim(Uuid::now_v7(), 1, LEASE_MS).await.unwrap() {
        let made = outcome(library, lease.result_id);
        assert_eq!(store.finish(&lease, &made, 1).await.unwrap(), Change::Made);
        n_done += 1;
    }
    println!("done: {n_done} ");
}
