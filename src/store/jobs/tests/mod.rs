//! Tests of the transitions on a real database (docs/explanation/promises.md, "No job is lost", "Stalled
//! workers cannot overwrite" and "Poison jobs"). Times are arguments, so nothing sleeps.

mod crashes; // rescue and quarantine
mod owners; // fair queue, small jobs and quotas
mod retries; // another attempt, by a user

use tempfile::TempDir;

use super::cancel::Cancel;
use super::enqueue::NewJob;
use super::fail::Shown;
use super::finish::{Outcome, Source};
use super::heartbeat::Beat;
use super::read::JobRow;
use super::requeue::End;
use super::*;
use crate::store::Store;
use crate::store::owners::{Account, Owner, OwnerFilter};
use crate::store::resources::Fish;
use crate::store::{fresh, sql};
use flockreel_core::code::Code;

const LEASE_MS: i64 = 15_000;
/// Id of the process that rescues.
const ALIVE: Uuid = Uuid::nil();

struct Queue {
    store: Store,
    _data: TempDir,
}

impl Queue {
    async fn open() -> Queue {
        let data = tempfile::tempdir().unwrap();
        let store = fresh::open(data.path()).await;
        Queue { store, _data: data }
    }

    async fn enqueue(&self, after_job: Option<JobId>) -> JobId {
        self.enqueue_at(after_job, 0).await
    }

    async fn enqueue_at(&self, after_job: Option<JobId>, priority: i64) -> JobId {
        let account = Account::local();
        self.charge(account, after_job, priority).await.unwrap()
    }

    async fn charge(
        &self,
        account: Account,
        after_job: Option<JobId>,
        priority: i64,
    ) -> Result<JobId, Error> {
        let job = NewJob {
            after_job,
            priority,
            ..new_job(account)
        };
        self.store.enqueue(&job, 0).await?;
        Ok(job.job_id)
    }

    async fn claim(&self, now_ms: i64) -> Option<Lease> {
        let worker = Uuid::now_v7();
        self.store.claim(worker, now_ms, LEASE_MS).await.unwrap()
    }

    /// Rescues the jobs whose leases ended before `now_ms`.
    async fn rescue(&self, now_ms: i64) -> Vec<(JobId, JobState)> {
        let mut ended = self.store.held_leases().await.unwrap();
        ended.retain(|lease| lease.until_ms < now_ms);
        self.store.rescue(ALIVE, &ended, now_ms).await.unwrap()
    }

    async fn state(&self, job: JobId) -> JobState {
        self.row(job).await.state
    }

    async fn row(&self, job: JobId) -> JobRow {
        let row = self.store.job(job, &OwnerFilter::All).await;
        row.unwrap().unwrap()
    }

    /// Finishes a job with a result without files, made from a library that is added for it.
    async fn finish(&self, lease: &Lease) -> Change {
        let library = self.library().await;
        let outcome = Outcome {
            source: Source::Resource(library),
            folder: format!("fish/{}.{}", lease.result_id, lease.fence),
            files: Vec::new(),
            params: "{}".into(),
            summary: "{}".into(),
        };
        self.store.finish(lease, &outcome, 5).await.unwrap()
    }

    async fn library(&self) -> Uuid {
        let (footage, job, library) = (Uuid::now_v7(), Uuid::now_v7(), Uuid::now_v7());
        for sql in [
            "insert into footage (id, folder, sha256, background_sha256, name, size_bytes, width, \
             height, fps, n_frames_hint, sample, created_ms) \
             values ($1, $4, $5, $6, $4, 0, 1, 1, 1.0, 1, false, 0)",
            "insert into jobs (id, kind, state, input, result_id, priority, run_at_ms, \
             created_ms, finished_ms) values ($2, 'analysis', 'done', '{}', $3, 0, 0, 0, 0)",
            "insert into libraries (id, job_id, fence, folder, footage_id, params, summary, \
             size_bytes, created_ms) values ($3, $2, 0, $4, $1, '{}', '{}', 0, 0)",
        ] {
            let insert = sql::query(sql).bind(footage).bind(job).bind(library);
            let insert = insert.bind(library.to_string());
            let sha256 = library.as_bytes().repeat(2);
            let insert = insert.bind(&sha256).bind(&b""[..]);
            insert.execute(&self.store.writer).await.unwrap();
        }
        library
    }

    async fn n_fish(&self) -> i64 {
        let count = sql::query_scalar("select count(*) from fish");
        count.fetch_one(&self.store.reader).await.unwrap()
    }
}

fn new_job(account: Account) -> NewJob {
    NewJob {
        job_id: JobId(Uuid::now_v7()),
        account,
        kind: Kind::Fish,
        input: "{}".into(),
        result_id: Uuid::now_v7(),
        after_job: None,
        priority: 0,
        is_small: false,
        max_queued: 1_000,
    }
}

#[tokio::test]
async fn jobs_are_claimed_once_by_priority_and_age() {
    let queue = Queue::open().await;
    let first = queue.enqueue(None).await;
    let second = queue.enqueue(None).await;
    let urgent = queue.enqueue_at(None, 1).await;
    let mut turns = Vec::new();
    while let Some(lease) = queue.claim(0).await {
        turns.push(lease.job_id);
    }
    assert_eq!(turns, [urgent, first, second]);
}

#[tokio::test]
async fn heartbeat_prevents_rescue() {
    let queue = Queue::open().await;
    queue.enqueue(None).await;
    let lease = queue.claim(0).await.unwrap();
    let beat = queue.store.heartbeat(&lease, 40_000, "tracking", 0.5).await;
    assert_eq!(beat.unwrap(), Beat::Held);
    assert_eq!(queue.rescue(39_000).await, []);
    let rescued = queue.rescue(40_001).await;
    assert_eq!(rescued, [(lease.job_id, JobState::Queued)]);
}

#[tokio::test]
async fn finish_links_the_result() {
    let queue = Queue::open().await;
    let job = queue.enqueue(None).await;
    let lease = queue.claim(0).await.unwrap();
    assert_eq!(queue.finish(&lease).await, Change::Made);
    assert_eq!(queue.state(job).await, JobState::Done);
    let fish = queue
        .store
        .resource::<Fish>(lease.result_id, &OwnerFilter::All)
        .await
        .unwrap()
        .unwrap();
    assert_eq!(fish.job_id, job.0);
}

#[tokio::test]
async fn worker_with_an_old_fence_changes_nothing() {
    let queue = Queue::open().await;
    let job = queue.enqueue(None).await;
    let stale = queue.claim(0).await.unwrap();
    queue.rescue(LEASE_MS + 1).await;
    let fresh = queue.claim(LEASE_MS + 1).await.unwrap();

    assert_eq!(queue.finish(&stale).await, Change::Lost);
    let failed = queue
        .store
        .fail(&stale, Code::Internal, "", Shown::default(), 0)
        .await;
    assert_eq!(failed.unwrap(), Change::Lost);
    assert_eq!(queue.store.stop(&stale, 0).await.unwrap(), Change::Lost);
    let requeued = queue.store.requeue(&stale, End::Crash, 0).await;
    assert_eq!(requeued.unwrap(), Change::Lost);
    assert_eq!(queue.store.release(&stale).await.unwrap(), Change::Lost);
    let beat = queue.store.heartbeat(&stale, i64::MAX, "", 0.0).await;
    assert_eq!(beat.unwrap(), Beat::Lost);

    assert_eq!(queue.state(job).await, JobState::Running);
    assert_eq!(queue.finish(&fresh).await, Change::Made);
    assert_eq!(queue.finish(&fresh).await, Change::Lost);
    assert_eq!(queue.n_fish().await, 1);
}

#[tokio::test]
async fn requeued_job_waits_and_counts_the_attempt_and_its_end() {
    let queue = Queue::open().await;
    queue.enqueue(None).await;
    let lease = queue.claim(0).await.unwrap();
    let requeued = queue.store.requeue(&lease, End::Crash, 2_000).await;
    assert_eq!(requeued.unwrap(), Change::Made);
    assert_eq!(queue.claim(1_999).await, None);
    let lease = queue.claim(2_000).await.unwrap();
    let counts = |lease: &Lease| (lease.attempt, lease.own_crashes, lease.transient_ends);
    assert_eq!(counts(&lease), (2, 1, 0));
    let requeued = queue.store.requeue(&lease, End::Transient, 0).await;
    assert_eq!(requeued.unwrap(), Change::Made);
    assert_eq!(counts(&queue.claim(2_000).await.unwrap()), (3, 1, 1));
}

#[tokio::test]
async fn waiting_time_begins_when_a_job_could_run() {
    let queue = Queue::open().await;
    let since = async || queue.store.census().await.unwrap().waiting_since_ms;
    queue.enqueue_at(None, -1).await;
    assert_eq!(since().await, None, "nobody waits for a background job");
    let first = queue.enqueue(None).await;
    queue.enqueue(Some(first)).await;
    assert_eq!(since().await, Some(0));
    let lease = queue.claim(0).await.unwrap();
    assert_eq!(since().await, None, "the second waits for the first");
    assert_eq!(queue.finish(&lease).await, Change::Made);
    assert_eq!(since().await, Some(5));
    let lease = queue.claim(5).await.unwrap();
    let requeued = queue.store.requeue(&lease, End::Crash, 2_000).await;
    assert_eq!(requeued.unwrap(), Change::Made);
    assert_eq!(since().await, Some(2_000));
}

#[tokio::test]
async fn released_job_does_not_count_the_attempt() {
    let queue = Queue::open().await;
    queue.enqueue(None).await;
    let lease = queue.claim(0).await.unwrap();
    assert_eq!(queue.store.release(&lease).await.unwrap(), Change::Made);
    let again = queue.claim(0).await.unwrap();
    assert_eq!((again.attempt, again.fence), (1, 2));
}

#[tokio::test]
async fn queued_job_is_cancelled_with_its_followers() {
    let queue = Queue::open().await;
    let first = queue.enqueue(None).await;
    let second = queue.enqueue(Some(first)).await;
    let third = queue.enqueue(Some(second)).await;
    let met = queue
        .store
        .cancel(first, &OwnerFilter::All, 1)
        .await
        .unwrap();
    assert_eq!(met, Cancel::Cancelled);
    assert_eq!(queue.state(third).await, JobState::Cancelled);
    let met = queue
        .store
        .cancel(first, &OwnerFilter::All, 2)
        .await
        .unwrap();
    assert_eq!(met, Cancel::Final(JobState::Cancelled));
}

#[tokio::test]
async fn heartbeat_reports_a_cancel_request() {
    let queue = Queue::open().await;
    let job = queue.enqueue(None).await;
    let lease = queue.claim(0).await.unwrap();
    assert_eq!(
        queue.store.cancel(job, &OwnerFilter::All, 1).await.unwrap(),
        Cancel::Requested
    );
    let beat = queue.store.heartbeat(&lease, 1, "", 0.0).await.unwrap();
    assert_eq!(beat, Beat::CancelRequested);
    assert_eq!(queue.store.stop(&lease, 2).await.unwrap(), Change::Made);
    assert_eq!(queue.state(job).await, JobState::Cancelled);
}

#[tokio::test]
async fn follower_waits_until_its_predecessor_is_done() {
    let queue = Queue::open().await;
    let first = queue.enqueue(None).await;
    let second = queue.enqueue_at(Some(first), 9).await;
    let lease = queue.claim(0).await.unwrap();
    assert_eq!(lease.job_id, first);
    assert_eq!(queue.claim(0).await, None);
    assert_eq!(queue.finish(&lease).await, Change::Made);
    assert_eq!(queue.claim(0).await.unwrap().job_id, second);
}

#[tokio::test]
async fn follower_of_a_failed_job_fails() {
    let queue = Queue::open().await;
    let first = queue.enqueue(None).await;
    let second = queue.enqueue(Some(first)).await;
    let lease = queue.claim(0).await.unwrap();
    let failed = queue
        .store
        .fail(&lease, Code::NothingMoves, "still", Shown::default(), 1);
    assert_eq!(failed.await.unwrap(), Change::Made);
    let row = queue
        .store
        .job(second, &OwnerFilter::All)
        .await
        .unwrap()
        .unwrap();
    assert_eq!(row.failure().unwrap().code, Code::InputFailed);
}

#[tokio::test]
async fn ended_job_has_no_stage() {
    let queue = Queue::open().await;
    let running = async || {
        queue.enqueue(None).await;
        let lease = queue.claim(0).await.unwrap();
        let beat = queue.store.heartbeat(&lease, i64::MAX, "tracking", 0.5);
        assert_eq!(beat.await.unwrap(), Beat::Held);
        lease
    };
    let stage = async |lease: &Lease| {
        let row = queue.store.job(lease.job_id, &OwnerFilter::All).await;
        row.unwrap().unwrap().stage
    };
    let done = running().await;
    assert_eq!(stage(&done).await.as_deref(), Some("tracking"));
    assert_eq!(queue.finish(&done).await, Change::Made);
    assert_eq!(stage(&done).await, None);
    let failed = running().await;
    let failure = queue
        .store
        .fail(&failed, Code::Internal, "", Shown::default(), 1);
    assert_eq!(failure.await.unwrap(), Change::Made);
    assert_eq!(stage(&failed).await, None, "failed");
    let stopped = running().await;
    assert_eq!(queue.store.stop(&stopped, 1).await.unwrap(), Change::Made);
    assert_eq!(stage(&stopped).await, None, "cancelled");
}

#[tokio::test]
async fn concurrent_claims_give_each_job_to_one_worker() {
    let queue = Queue::open().await;
    for _ in 0..100 {
        queue.enqueue(None).await;
    }
    let mut workers = tokio::task::JoinSet::new();
    for _ in 0..8 {
        let store = queue.store.clone();
        workers.spawn(async move {
            let mut claimed = Vec::new();
            while let Some(lease) = store.claim(Uuid::now_v7(), 0, LEASE_MS).await.unwrap() {
                claimed.push(lease.job_id);
            }
            claimed
        });
    }
    let mut claimed = workers.join_all().await.concat();
    let n_claims = claimed.len();
    claimed.sort();
    claimed.dedup();
    assert_eq!((n_claims, claimed.len()), (100, 100));
}

#[tokio::test]
async fn second_store_in_a_folder_is_refused() {
    let data = tempfile::tempdir().unwrap();
    let first = Store::open(data.path()).await.unwrap();
    let second = Store::open(data.path()).await;
    assert!(matches!(second.err(), Some(Error::InUse(_))));
    drop(first);
    assert!(Store::open(data.path()).await.is_ok());
}
