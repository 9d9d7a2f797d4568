//! Tests of the queue with several owners: the fair queue, small jobs and quotas (docs/explanation/promises.md, "Fair queue").

use super::claim::Lane;
use super::fail::Shown;
use super::*;

fn of(owner: &str, quota: i64) -> Account {
    Account {
        owner: Owner(owner.to_owned()),
        quota: Some(quota),
    }
}

/// Returns the number of jobs that start before the job of the owner who queued last, if `n_workers` jobs run
/// at once.
async fn n_before_the_other(n_workers: usize) -> usize {
    let queue = Queue::open().await;
    for _ in 0..500 {
        let charged = queue.charge(of("many", 500), None, 0).await;
        charged.unwrap();
    }
    let mut running = std::collections::VecDeque::new();
    for now_ms in 1..=n_workers {
        running.extend(queue.claim(now_ms as i64).await);
    }
    let one = queue.charge(of("one", 1), None, 0).await.unwrap();
    for n_begun in 0..500 {
        let ended = running.pop_front().unwrap();
        assert_eq!(queue.finish(&ended).await, Change::Made);
        let lease = queue.claim(100 + n_begun as i64).await.unwrap();
        if lease.job_id == one {
            return n_begun;
        }
        running.push_back(lease);
    }
    500
}

#[tokio::test]
async fn one_job_does_not_wait_for_five_hundred_of_another_owner() {
    assert_eq!(n_before_the_other(1).await, 0);
    assert_eq!(n_before_the_other(3).await, 0);
}

#[tokio::test]
async fn owners_take_turns() {
    let queue = Queue::open().await;
    let mut jobs = Vec::new();
    for owner in ["a", "a", "a", "b", "b"] {
        jobs.push(queue.charge(of(owner, 9), None, 0).await.unwrap());
    }
    let mut turns = Vec::new();
    for now_ms in 1..=5 {
        let lease = queue.claim(now_ms).await.unwrap();
        turns.push(jobs.iter().position(|job| *job == lease.job_id).unwrap());
        assert_eq!(queue.finish(&lease).await, Change::Made);
    }
    assert_eq!(turns, [0, 3, 1, 4, 2]);
}

#[tokio::test]
async fn quota_limits_queued_and_running_jobs() {
    let queue = Queue::open().await;
    let charge = async || queue.charge(of("a", 2), None, 0).await;
    charge().await.unwrap();
    charge().await.unwrap();
    let refused = charge().await;
    assert!(matches!(refused, Err(Error::QuotaExceeded { quota: 2 })));
    let lease = queue.claim(1).await.unwrap();
    assert!(charge().await.is_err(), "a running job counts");
    queue.charge(of("b", 1), None, 0).await.unwrap();
    assert_eq!(queue.finish(&lease).await, Change::Made);
    charge().await.unwrap();
}

impl Queue {
    async fn enqueue_small(&self, owner: &str) -> JobId {
        self.enqueue_as(owner, Kind::Fish, true, 0).await
    }

    async fn enqueue_as(&self, owner: &str, kind: Kind, is_small: bool, now_ms: i64) -> JobId {
        let job = NewJob {
            is_small,
            kind,
            ..new_job(of(owner, 99))
        };
        self.store.enqueue(&job, now_ms).await.unwrap();
        job.job_id
    }

    /// Claims and ends the next job.
    async fn run_next(&self, now_ms: i64) -> JobId {
        let lease = self.claim(now_ms).await.unwrap();
        let end = self.store.fail(
            &lease,
            Code::NotAVideo,
            "it is no film",
            Shown::default(),
            now_ms,
        );
        assert_eq!(end.await.unwrap(), Change::Made);
        lease.job_id
    }
}

#[tokio::test]
async fn a_film_goes_before_ten_measurements_of_its_owner() {
    let queue = Queue::open().await;
    for _ in 0..10 {
        queue.enqueue_as("a", Kind::Analysis, true, 0).await;
    }
    for now_ms in [1, 2] {
        let film = queue.enqueue_as("a", Kind::Flock, true, now_ms).await;
        assert_eq!(queue.run_next(now_ms).await, film);
    }
}

#[tokio::test]
async fn late_jobs_get_every_second_start() {
    let queue = Queue::open().await;
    let large = queue.enqueue_as("a", Kind::Flock, false, 0).await;
    let measurement = queue.enqueue_as("a", Kind::Analysis, true, 1).await;
    let mut turns = Vec::new();
    for start in 0..4 {
        let now_ms = 700_000 + start;
        queue.enqueue_as("a", Kind::Flock, true, now_ms).await;
        turns.push(queue.run_next(now_ms).await);
    }
    assert_eq!([turns[1], turns[3]], [large, measurement]);
}

#[tokio::test]
async fn small_jobs_go_before_the_others_of_their_owner_only() {
    let queue = Queue::open().await;
    let large = queue.charge(of("a", 9), None, 0).await.unwrap();
    let small = queue.enqueue_small("a").await;
    let other = queue.charge(of("b", 9), None, 0).await.unwrap();
    let mut turns = Vec::new();
    for now_ms in 1..=3 {
        let lease = queue.claim(now_ms).await.unwrap();
        turns.push(lease.job_id);
        assert_eq!(queue.finish(&lease).await, Change::Made);
    }
    assert_eq!(turns, [small, other, large]);
}

#[tokio::test]
async fn short_lane_is_for_small_jobs() {
    let queue = Queue::open().await;
    let large = queue.charge(of("a", 9), None, 0).await.unwrap();
    let claim = async |lane| {
        let claimed = queue.store.claim_in(lane, Uuid::now_v7(), 1, LEASE_MS);
        claimed.await.unwrap().map(|lease| lease.job_id)
    };
    assert_eq!(claim(Lane::Short).await, None);
    let small = queue.enqueue_small("b").await;
    assert_eq!(claim(Lane::Short).await, Some(small));
    assert_eq!(claim(Lane::All).await, Some(large));
}

impl Queue {
    /// Queues a job that nobody waits for.
    async fn enqueue_in_background(&self, owner: &str, now_ms: i64) -> JobId {
        let job = NewJob {
            kind: Kind::Views,
            priority: -1,
            ..new_job(of(owner, 99))
        };
        self.store.enqueue(&job, now_ms).await.unwrap();
        job.job_id
    }
}

#[tokio::test]
async fn background_jobs_wait_for_the_jobs_of_all_owners() {
    let queue = Queue::open().await;
    let views = queue.enqueue_in_background("a", 0).await;
    let mut turns = Vec::new();
    for owner in ["b", "b", "c"] {
        queue.enqueue_as(owner, Kind::Analysis, false, 1).await;
    }
    for now_ms in 1..=4 {
        turns.push(queue.run_next(now_ms).await);
    }
    assert_eq!(turns[3], views);
}

#[tokio::test]
async fn late_background_jobs_take_turns_with_the_jobs_of_other_owners() {
    let queue = Queue::open().await;
    let views = queue.enqueue_in_background("a", 0).await;
    let mut turns = Vec::new();
    for start in 0..2 {
        let now_ms = 700_000 + start;
        for _ in 0..2 {
            queue.enqueue_as("b", Kind::Flock, true, now_ms).await;
        }
        turns.push(queue.run_next(now_ms).await);
    }
    assert!(turns.contains(&views));
}

#[tokio::test]
async fn background_jobs_do_not_count_against_limits() {
    let queue = Queue::open().await;
    queue.enqueue_in_background("a", 0).await;
    let job = queue.charge(of("a", 1), None, 0).await.unwrap();
    let charge = async |max_queued| {
        let job = NewJob {
            max_queued,
            ..new_job(of("b", 9))
        };
        queue.store.enqueue(&job, 0).await
    };
    assert!(matches!(
        charge(1).await,
        Err(Error::QueueFull { max_queued: 1 })
    ));
    charge(2).await.unwrap();
    let cancel = queue.store.cancel(job, &OwnerFilter::All, 1);
    assert_eq!(cancel.await.unwrap(), Cancel::Cancelled);
    let account = of("a", 1);
    let retry = (queue.store).retry(job, &OwnerFilter::All, &account, 2, 2);
    assert_eq!(retry.await.unwrap(), retry::Retry::Queued);
}

#[tokio::test]
async fn background_job_gives_way_to_a_ready_job_until_it_is_late() {
    let queue = Queue::open().await;
    queue.enqueue_in_background("a", 0).await;
    let views = queue.claim(0).await.unwrap();
    let gives_way = async |now_ms| queue.store.must_give_way(&views, now_ms).await.unwrap();
    assert!(!gives_way(5_000).await, "nobody waits");
    queue.enqueue_in_background("b", 5_000).await;
    assert!(!gives_way(9_000).await, "only another background job waits");
    let before = queue.enqueue_as("c", Kind::Analysis, false, 10_000).await;
    assert!(!gives_way(10_500).await, "another worker may take it");
    assert!(gives_way(11_000).await);
    assert!(!gives_way(600_000).await, "it is late");
    let flock = queue.claim(11_000).await.unwrap();
    assert_eq!(flock.job_id, before);
    queue.charge(of("c", 9), Some(before), 0).await.unwrap();
    assert!(!gives_way(12_000).await, "its predecessor is not done");
    let way = queue.store.must_give_way(&flock, 12_000).await.unwrap();
    assert!(!way, "a job of usual priority");
}
