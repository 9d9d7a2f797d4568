//! The supervisor: a pool of workers, the rescue of jobs whose workers fell silent, the sweeps while the service
//! runs (R5), and the drain at the end (RELIABILITY.md, R2 and R4).

use std::convert::Infallible;
use std::time::{Duration, SystemTime};

use tokio::task::JoinSet;
use tokio::time::{sleep, timeout};

use super::worker::{Step, Worker};
use super::{Context, clock};
use crate::ids::JobId;
use crate::store::{self, Store, jobs::JobState};

/// Idle workers look for jobs this often even if nobody wakes them.
const POLL: Duration = Duration::from_secs(1);
/// The longest wait for running jobs to let go.
const DRAIN: Duration = Duration::from_secs(15);

/// The running pool.
pub struct Supervisor {
    context: Context,
    tasks: JoinSet<()>,
}

impl Supervisor {
    /// Starts `n_workers` workers and the rescue.
    pub fn start(context: Context, n_workers: usize) -> Supervisor {
        let mut tasks = JoinSet::new();
        for _ in 0..n_workers {
            tasks.spawn(work(context.clone()));
        }
        tasks.spawn(rescue(context.clone()));
        tasks.spawn(listen(context.clone()));
        if context.store.serves() {
            tasks.spawn(sweep(context.clone()));
        }
        Supervisor { context, tasks }
    }

    /// Stops claiming, sends running jobs back to the queue, and returns when all have let go or
    /// time is up; whatever still runs then is rescued at the next start.
    pub async fn drain(mut self) {
        self.context.draining.cancel();
        let all = async { while self.tasks.join_next().await.is_some() {} };
        if timeout(DRAIN, all).await.is_err() {
            tracing::warn!("a job did not let go in time; it is rescued at the next start");
        }
    }
}

async fn work(context: Context) {
    let worker = Worker::new(context.clone());
    while !context.draining.is_cancelled() {
        match worker.step().await {
            Ok(Step::Idle) => {
                tokio::select! {
                    () = context.wake.notified() => {}
                    () = sleep(POLL) => {}
                    () = context.draining.cancelled() => {}
                }
            }
            // A job that ended may be what others waited for.
            Ok(_) => context.wake.notify_one(),
            Err(error) => {
                tracing::error!(%error, "a worker could not reach its queue");
                sleep(POLL).await;
            }
        }
    }
}

async fn rescue(context: Context) {
    while !context.draining.is_cancelled() {
        match rescue_silent(&context).await {
            Ok(rescued) if rescued.is_empty() => {}
            Ok(_) => context.wake.notify_one(),
            Err(error) => tracing::error!(%error, "silent workers could not be looked for"),
        }
        tokio::select! {
            () = sleep(POLL) => {}
            () = context.draining.cancelled() => {}
        }
    }
}

async fn rescue_silent(context: &Context) -> Result<Vec<(JobId, JobState)>, store::Error> {
    context.store.rescue(context.now_ms().await?).await
}

/// Wakes a worker when another process has queued a job.
async fn listen(context: Context) {
    while !context.draining.is_cancelled() {
        let heard = async {
            let mut queued = context.store.listen().await?;
            loop {
                queued.next().await?;
                context.wake.notify_one();
            }
        };
        let lost: Result<Infallible, store::Error> = tokio::select! {
            lost = heard => lost,
            () = context.draining.cancelled() => return,
        };
        let Err(error) = lost;
        tracing::warn!(%error, "jobs of other processes are looked for, not heard of");
        sleep(POLL).await;
    }
}

/// Sweeps again and again what a start would, for a service that runs for months.
async fn sweep(context: Context) {
    loop {
        tokio::select! {
            () = sleep(context.sweep_every) => {}
            () = context.draining.cancelled() => return,
        }
        if let Err(error) = sweep_expired(&context.store).await {
            tracing::error!(%error, "what has expired could not be swept");
        }
    }
}

/// Removes expired uploads, answers kept for their day, what the dead were making, and folders that no row names.
async fn sweep_expired(store: &Store) -> Result<(), store::Error> {
    store.sweep_uploads(clock::now_ms()).await?;
    store.forget_old_answers(clock::now_ms()).await?;
    store.sweep(SystemTime::now()).await?;
    Ok(())
}

/// Mends what a crash left, before the first worker starts: leases of the dead, drafts, strays. Where
/// other processes share the rows only what has run out is of the dead.
pub async fn recover(context: &Context) -> Result<(), store::Error> {
    let now_ms = context.now_ms().await?;
    if context.store.is_alone() {
        context.store.rescue_all(now_ms).await?;
        context.store.interrupt_all_keys().await?;
    } else {
        context.store.rescue(now_ms).await?;
    }
    if context.store.serves() {
        context.store.sweep_upload_files().await?;
    }
    sweep_expired(&context.store).await
}
