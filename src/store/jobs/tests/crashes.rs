//! Tests of rescues: who is blamed for the crash of a process (docs/explanation/promises.md, "Poison jobs").

use super::*;

impl Queue {
    /// Queues jobs and claims them for one process. Their leases end one after the other, from `LEASE_MS` on.
    async fn claim_together(&self, n_jobs: i64) -> Vec<JobId> {
        let process = Uuid::now_v7();
        let mut jobs = Vec::new();
        for now_ms in 0..n_jobs {
            let lease = self.store.claim(process, now_ms, LEASE_MS).await.unwrap();
            jobs.push(lease.unwrap().job_id);
        }
        jobs
    }
}

#[tokio::test]
async fn rescued_job_keeps_its_attempt_count() {
    let queue = Queue::open().await;
    queue.enqueue(None).await;
    queue.claim(0).await.unwrap();
    queue.store.rescue_all(1).await.unwrap();
    assert_eq!(queue.claim(1).await.unwrap().attempt, 2);
}

#[tokio::test]
async fn job_alone_in_three_crashes_is_quarantined() {
    let queue = Queue::open().await;
    let job = queue.enqueue(None).await;
    let follower = queue.enqueue(Some(job)).await;
    for n_crashes in 1..=3 {
        assert_eq!(queue.state(job).await, JobState::Queued, "{n_crashes}");
        queue.claim(0).await.unwrap();
        queue.store.rescue_all(1).await.unwrap();
    }
    let code = async |job| queue.row(job).await.failure().unwrap().code;
    assert_eq!(code(job).await, Code::CrashedWorker);
    assert_eq!(code(follower).await, Code::InputFailed);
    assert_eq!(queue.claim(i64::MAX - LEASE_MS).await, None);
}

#[tokio::test]
async fn jobs_beside_each_other_are_never_blamed() {
    let queue = Queue::open().await;
    for _ in 0..2 {
        queue.enqueue(None).await;
    }
    for _ in 0..10 {
        let jobs = queue.claim_together(2).await;
        queue.store.rescue_all(1).await.unwrap();
        for job in jobs {
            assert_eq!(queue.state(job).await, JobState::Queued);
        }
    }
}

#[tokio::test]
async fn job_whose_neighbor_was_rescued_before_is_not_blamed() {
    let queue = Queue::open().await;
    for _ in 0..2 {
        queue.enqueue(None).await;
    }
    for _ in 0..4 {
        let jobs = queue.claim_together(2).await;
        for (job, now_ms) in jobs.iter().zip(LEASE_MS + 1..) {
            let rescued = queue.rescue(now_ms).await;
            assert_eq!(rescued, [(*job, JobState::Queued)]);
        }
    }
}

#[tokio::test]
async fn jobs_of_two_processes_are_not_beside_each_other() {
    let queue = Queue::open().await;
    let jobs = [queue.enqueue(None).await, queue.enqueue(None).await];
    for _ in 0..3 {
        queue.claim(0).await.unwrap();
        queue.claim(0).await.unwrap();
        queue.rescue(LEASE_MS + 1).await;
    }
    for job in jobs {
        assert_eq!(queue.state(job).await, JobState::Failed);
    }
}

#[tokio::test]
async fn lost_lease_of_the_living_process_is_no_crash() {
    let queue = Queue::open().await;
    let job = queue.enqueue(None).await;
    for _ in 0..4 {
        queue.store.claim(ALIVE, 0, LEASE_MS).await.unwrap();
        queue.rescue(LEASE_MS + 1).await;
        assert_eq!(queue.state(job).await, JobState::Queued);
    }
}

#[tokio::test]
async fn rescue_cancels_a_job_with_a_cancel_request() {
    let queue = Queue::open().await;
    let job = queue.enqueue(None).await;
    queue.claim(0).await.unwrap();
    assert_eq!(
        queue.store.cancel(job, &OwnerFilter::All, 1).await.unwrap(),
        Cancel::Requested
    );
    queue.store.rescue_all(2).await.unwrap();
    assert_eq!(queue.state(job).await, JobState::Cancelled);
}
