//! The supervisor of a process: starts the workers, rescues jobs whose workers have stopped, sweeps expired
//! data, and stops the workers at the end (docs/explanation/promises.md, "No job is lost", "Graceful stop"
//! and "No orphans").

mod lease_watch;

use std::convert::Infallible;
use std::time::{Duration, Instant, SystemTime};

use tokio::task::JoinSet;
use tokio::time::{sleep, timeout};

use self::lease_watch::LeaseWatch;
use super::worker::{Step, Worker};
use super::{Context, clock};
use crate::store::jobs::JobState;
use crate::store::jobs::claim::Lane;
use crate::store::{self, Store};
use flockreel_core::ids::JobId;

/// Interval at which idle workers look for jobs, even without a notification. Free choice.
const POLL_INTERVAL: Duration = Duration::from_secs(1);
/// Maximum wait for running jobs when the process stops. Free choice.
const DRAIN_TIMEOUT: Duration = Duration::from_secs(15);

/// The running workers of a process.
pub struct Supervisor {
    context: Context,
    tasks: JoinSet<()>,
}

impl Supervisor {
    /// Starts `n_workers` workers, the rescue, the notifications, and the sweeps if this process serves the
    /// data folder. With two workers or more, one of them runs only small jobs.
    pub fn start(context: Context, n_workers: usize) -> Supervisor {
        let mut tasks = JoinSet::new();
        for idx in 0..n_workers {
            let is_for_small_jobs = idx > 0 && idx + 1 == n_workers;
            let lane = if is_for_small_jobs {
                Lane::Short
            } else {
                Lane::All
            };
            let worker = Worker::in_lane(context.clone(), lane);
            tasks.spawn(work(worker, context.clone()));
        }
        tasks.spawn(rescue(context.clone()));
        tasks.spawn(listen(context.clone()));
        if context.store.serves() {
            tasks.spawn(sweep(context.clone()));
        }
        Supervisor { context, tasks }
    }

    /// Stops claiming, returns running jobs to the queue, and waits until all workers have stopped, at most
    /// 15 s. A job that still runs then is rescued at the next start.
    pub async fn drain(mut self) {
        self.context.draining.cancel();
        let all = async { while self.tasks.join_next().await.is_some() {} };
        if timeout(DRAIN_TIMEOUT, all).await.is_err() {
            tracing::warn!("a job did not stop within 15 s; it is rescued at the next start");
        }
    }
}

async fn work(worker: Worker, context: Context) {
    let mut lacked_space = false;
    while !context.draining.is_cancelled() {
        let lacks_space = context.lacks_disk_space();
        if lacks_space && !lacked_space {
            tracing::warn!(
                "the free disk space is below the reserve: jobs wait until there is more"
            );
        }
        lacked_space = lacks_space;
        // Created before the step, so that it also hears of a job that is queued during the step.
        let woken = context.wake.notified();
        match worker.step().await {
            Ok(Step::Idle) => {
                tokio::select! {
                    () = woken => {}
                    () = sleep(POLL_INTERVAL) => {}
                    () = context.draining.cancelled() => {}
                }
            }
            // Other jobs may depend on the job that ended.
            Ok(_) => context.wake.notify_waiters(),
            Err(error) => {
                tracing::error!(%error, "the queue returned an error to a worker");
                sleep(POLL_INTERVAL).await;
            }
        }
    }
}

async fn rescue(context: Context) {
    let mut watch = LeaseWatch::default();
    while !context.draining.is_cancelled() {
        match rescue_ended(&context, &mut watch).await {
            Ok(rescued) if rescued.is_empty() => {}
            Ok(_) => context.wake.notify_waiters(),
            Err(error) => tracing::error!(%error, "the search for ended leases failed"),
        }
        tokio::select! {
            () = sleep(POLL_INTERVAL) => {}
            () = context.draining.cancelled() => {}
        }
    }
}

async fn rescue_ended(
    context: &Context,
    watch: &mut LeaseWatch,
) -> Result<Vec<(JobId, JobState)>, store::Error> {
    let held = context.store.held_leases().await?;
    let ended = watch.ended(held, context.lease, Instant::now());
    let now_ms = context.now_ms().await?;
    context.store.rescue(context.process, &ended, now_ms).await
}

/// Wakes the workers when any process has queued a job.
async fn listen(context: Context) {
    while !context.draining.is_cancelled() {
        let heard = async {
            let mut queued = context.store.listen().await?;
            loop {
                queued.next().await?;
                context.wake.notify_waiters();
            }
        };
        let lost: Result<Infallible, store::Error> = tokio::select! {
            lost = heard => lost,
            () = context.draining.cancelled() => return,
        };
        let Err(error) = lost;
        tracing::warn!(%error, "notifications of new jobs are interrupted; workers poll the queue until they are back");
        sleep(POLL_INTERVAL).await;
    }
}

/// Sweeps expired and old data at regular intervals, for services that run for months.
async fn sweep(context: Context) {
    loop {
        tokio::select! {
            () = sleep(context.sweep_every) => {}
            () = context.draining.cancelled() => return,
        }
        if let Err(error) = sweep_expired(&context.store).await {
            tracing::error!(%error, "the sweep of expired data failed");
        }
        if let Err(error) = retire(&context).await {
            tracing::error!(%error, "the deletion of old data failed");
        }
    }
}

/// Deletes data that is older than the settings allow. This does not happen at the start, so that an operator who starts
/// the service on an old backup has time to change the settings.
async fn retire(context: &Context) -> Result<(), store::Error> {
    let now_ms = context.now_ms().await?;
    let retired = context.store.retire(context.retention, now_ms).await?;
    context.meters.count_retired(&retired);
    Ok(())
}

/// Removes expired uploads and idempotency keys, drafts of processes that have ended, and folders that no row
/// names.
async fn sweep_expired(store: &Store) -> Result<(), store::Error> {
    store.sweep_uploads(clock::now_ms()).await?;
    store.forget_old_answers(clock::now_ms()).await?;
    store.sweep(SystemTime::now()).await?;
    Ok(())
}

/// Repairs the state after a crash, before the first worker starts: leases, idempotency keys, drafts and
/// folders. If other processes share the database, their jobs may run, so the rescue of ended leases waits.
pub async fn recover(context: &Context) -> Result<(), store::Error> {
    if context.store.is_alone() {
        context.store.rescue_all(context.now_ms().await?).await?;
        context.store.interrupt_all_keys().await?;
    }
    if context.store.serves() {
        context.store.sweep_upload_files().await?;
    }
    sweep_expired(&context.store).await
}
