//! Tests of retries by users: which jobs return to the queue, and with which others.

use super::fail::Shown;
use super::retry::{Refusal, Retry};
use super::*;

impl Queue {
    async fn retry(&self, job: JobId) -> Retry {
        let (owners, account) = (OwnerFilter::All, Account::local());
        let retry = self.store.retry(job, &owners, &account, 1_000, 9);
        retry.await.unwrap()
    }

    async fn fail(&self, lease: &Lease, code: Code) {
        let shown = Shown {
            picture: Some(b"jpeg"),
            mends: Some("[]"),
        };
        let failed = self.store.fail(lease, code, "why", shown, 5).await;
        assert_eq!(failed.unwrap(), Change::Made);
    }
}

#[tokio::test]
async fn retried_job_runs_again_with_its_followers_and_a_fresh_budget() {
    let queue = Queue::open().await;
    let first = queue.enqueue(None).await;
    let second = queue.enqueue(Some(first)).await;
    let third = queue.enqueue(Some(second)).await;
    for _ in 0..2 {
        let lease = queue.claim(0).await.unwrap();
        let requeued = queue.store.requeue(&lease, End::Crash, 0).await;
        assert_eq!(requeued.unwrap(), Change::Made);
    }
    let lease = queue.claim(0).await.unwrap();
    queue.fail(&lease, Code::CrashedWorker).await;
    let before = queue.row(first).await;
    assert!(before.is_retriable() && before.has_picture);
    assert_eq!(queue.retry(first).await, Retry::Queued);
    for job in [first, second, third] {
        let row = queue.row(job).await;
        assert_eq!(
            (row.state, row.failure(), row.finished_ms),
            (JobState::Queued, None, None)
        );
        assert!(!row.has_picture);
    }
    let again = queue.claim(9).await.unwrap();
    assert_eq!((again.job_id, again.result_id), (first, before.result_id));
    assert_eq!((again.attempt, again.own_crashes), (4, 0));
    assert_eq!(queue.finish(&again).await, Change::Made);
    assert_eq!(queue.claim(9).await.unwrap().job_id, second);
}

#[tokio::test]
async fn retried_cancelled_job_takes_along_only_what_was_cancelled_with_it() {
    let queue = Queue::open().await;
    let first = queue.enqueue(None).await;
    let unwanted = queue.enqueue(Some(first)).await;
    let second = queue.enqueue(Some(first)).await;
    for (job, now_ms) in [(unwanted, 1), (first, 2)] {
        let cancelled = queue.store.cancel(job, &OwnerFilter::All, now_ms).await;
        assert_eq!(cancelled.unwrap(), Cancel::Cancelled);
    }
    assert_eq!(queue.retry(second).await, Retry::Refused(Refusal::NoInput));
    assert!(!queue.row(second).await.is_retriable());
    assert_eq!(queue.retry(first).await, Retry::Queued);
    assert_eq!(queue.state(second).await, JobState::Queued);
    assert_eq!(queue.state(unwanted).await, JobState::Cancelled);
    assert_eq!(queue.retry(unwanted).await, Retry::Queued);
}

#[tokio::test]
async fn cancel_request_of_a_retried_job_is_forgotten() {
    let queue = Queue::open().await;
    let job = queue.enqueue(None).await;
    let lease = queue.claim(0).await.unwrap();
    queue.store.cancel(job, &OwnerFilter::All, 1).await.unwrap();
    assert_eq!(queue.store.stop(&lease, 2).await.unwrap(), Change::Made);
    assert_eq!(queue.retry(job).await, Retry::Queued);
    let lease = queue.claim(9).await.unwrap();
    let beat = queue.store.heartbeat(&lease, i64::MAX, "", 0.0).await;
    assert_eq!(beat.unwrap(), Beat::Held);
}

#[tokio::test]
async fn jobs_that_cannot_succeed_are_refused() {
    let queue = Queue::open().await;
    let job = queue.enqueue(None).await;
    let follower = queue.enqueue(Some(job)).await;
    assert_eq!(queue.retry(job).await, Retry::Refused(Refusal::NotEnded));
    let lease = queue.claim(0).await.unwrap();
    assert_eq!(queue.retry(job).await, Retry::Refused(Refusal::NotEnded));
    queue.fail(&lease, Code::NothingMoves).await;
    assert_eq!(queue.retry(job).await, Retry::Refused(Refusal::SameReason));
    assert_eq!(
        queue.retry(follower).await,
        Retry::Refused(Refusal::NoInput)
    );
    let done = queue.enqueue(None).await;
    let lease = queue.claim(0).await.unwrap();
    assert_eq!(queue.finish(&lease).await, Change::Made);
    assert_eq!(queue.retry(done).await, Retry::Refused(Refusal::Done));
    assert_eq!(queue.retry(JobId(Uuid::now_v7())).await, Retry::Absent);
    let (stranger, account) = (
        OwnerFilter::One(Owner("stranger".to_owned())),
        Account::local(),
    );
    let retry = queue.store.retry(done, &stranger, &account, 1_000, 9);
    assert_eq!(retry.await.unwrap(), Retry::Absent);
}

#[tokio::test]
async fn retry_keeps_the_limits_of_the_owner_and_the_queue() {
    let queue = Queue::open().await;
    let account = Account {
        owner: Owner::local(),
        quota: Some(2),
    };
    let first = queue.charge(account.clone(), None, 0).await.unwrap();
    queue.charge(account.clone(), Some(first), 0).await.unwrap();
    let lease = queue.claim(0).await.unwrap();
    queue.fail(&lease, Code::Internal).await;
    let other = queue.charge(account.clone(), None, 0).await.unwrap();
    let retry = async |max_queued| {
        let owners = OwnerFilter::All;
        let retry = queue.store.retry(first, &owners, &account, max_queued, 9);
        retry.await
    };
    let refused = retry(1_000).await;
    assert!(matches!(refused, Err(Error::QuotaExceeded { quota: 2 })));
    assert_eq!(queue.state(first).await, JobState::Failed);
    queue
        .store
        .cancel(other, &OwnerFilter::All, 1)
        .await
        .unwrap();
    let refused = retry(1).await;
    assert!(matches!(refused, Err(Error::QueueFull { max_queued: 1 })));
    assert_eq!(retry(2).await.unwrap(), Retry::Queued);
}
