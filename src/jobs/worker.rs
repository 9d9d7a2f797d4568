//! A worker: claims a job, runs it and ends it. [`Worker::step`] does this once and returns the outcome; the
//! loop is in the supervisor.
//!
//! The computation runs on a blocking thread with its own thread pool. Meanwhile the worker sends a heartbeat
//! every third of the lease, and up to twice per second if there is new progress.

use std::pin::pin;
use std::sync::Arc;
use std::time::Duration;

use rustix::process::{getpriority_process, setpriority_process};
use tokio::runtime::Handle;
use tokio::time::{Instant, MissedTickBehavior, interval};
use tracing::{Instrument, Span};
use uuid::Uuid;

use super::clock::now_ms;
use super::listener::Position;
use super::{Attempt, Context, Error, Listener, Product, run, stages};
use crate::store;
use crate::store::Store;
use crate::store::jobs::finish::Outcome;
use crate::store::jobs::heartbeat::Beat;
use crate::store::jobs::{Change, Lease};
use flockreel_core::code::Code;
use flockreel_core::ids::JobId;

/// Interval at which the worker checks a running job. Free choice.
const TICK: Duration = Duration::from_millis(500);
/// Maximum number of attempts if errors may be transient. Free choice.
const MAX_ATTEMPTS: i64 = 3;
/// Maximum wait for the computation to stop after it was cancelled. Afterwards it is abandoned. Free choice.
const STOP_GRACE: Duration = Duration::from_secs(10);
/// Wait before the second attempt, milliseconds. Every further wait is four times as long. Free choice.
const BACKOFF_MS: i64 = 2_000;

/// Increase of the nice value of a job's threads. At 10, a job gets about a tenth of the processor time of a
/// request under load.
const NICE_INCREMENT: i32 = 10;

/// Outcome of a step.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Step {
    /// No job was ready.
    Idle,
    /// The job is done and its result is linked.
    Done(JobId),
    /// The job failed permanently.
    Failed(JobId, Code),
    /// The job failed and will be tried again.
    Retried(JobId),
    /// The job was cancelled while it ran.
    Cancelled(JobId),
    /// The job returned to the queue because the process stops.
    Released(JobId),
    /// The lease was lost. Nothing of this attempt was kept.
    Lost(JobId),
}

/// A worker. It runs one job at a time.
pub struct Worker {
    context: Context,
    /// Id of the worker. Random, so that a restarted worker has another id.
    id: Uuid,
}

impl Worker {
    /// Returns a worker with a new id.
    pub fn new(context: Context) -> Worker {
        Worker {
            context,
            id: Uuid::now_v7(),
        }
    }

    /// Claims the next job, runs it and ends it.
    pub async fn step(&self) -> Result<Step, store::Error> {
        self.step_by(run).await
    }

    /// Does the same as [`Worker::step`], but with `run` as the computation. For tests of the queue.
    pub async fn step_by<Run>(&self, run: Run) -> Result<Step, store::Error>
    where
        Run: FnOnce(&Lease, &Attempt) -> Result<Product, Error> + Send + 'static,
    {
        let lease_ms = self.lease_ms();
        let claimed = self
            .context
            .store
            .claim(self.id, self.context.now_ms().await?, lease_ms)
            .await?;
        let Some(lease) = claimed else {
            return Ok(Step::Idle);
        };
        let span = tracing::info_span!(
            "job",
            job.id = %lease.job_id,
            job.kind = lease.kind.name(),
            attempt = lease.attempt
        );
        self.attempt(lease, run).instrument(span).await
    }

    async fn attempt<Run>(&self, lease: Lease, run: Run) -> Result<Step, store::Error>
    where
        Run: FnOnce(&Lease, &Attempt) -> Result<Product, Error> + Send + 'static,
    {
        let listener = Arc::new(Listener::new(stages(lease.kind)));
        let work = begin(&self.context, lease.clone(), listener.clone(), run);
        let result = self.beat_until_done(&lease, &listener, work).await;
        let step = self.end(&lease, &listener, result).await?;
        self.context.meters.count(lease.kind, &step, &listener);
        Ok(step)
    }

    /// Renews the lease, stores progress and passes on cancellation until the computation ends. Cancels it at
    /// the time limit, if disk space is short, or if the process stops.
    async fn beat_until_done(
        &self,
        lease: &Lease,
        listener: &Listener,
        work: impl Future<Output = Result<Outcome, Error>>,
    ) -> Result<Outcome, Error> {
        let mut work = pin!(work);
        let mut tick = interval(TICK.min(self.context.lease / 3));
        tick.set_missed_tick_behavior(MissedTickBehavior::Delay);
        let (start, mut last_beat) = (Instant::now(), Instant::now());
        let mut stored_position = listener.position();
        let (mut stop_requested_at, mut lacks_disk_space) = (None, false);
        loop {
            tokio::select! {
                ended = &mut work => return self.with_stop_reason(start, lacks_disk_space, ended),
                _ = tick.tick() => {}
            }
            lacks_disk_space |= self.context.lacks_disk_space();
            let is_late = start.elapsed() > self.context.budget;
            if is_late || lacks_disk_space || self.context.draining.is_cancelled() {
                listener.cancel();
                let grace = STOP_GRACE.min(self.context.lease);
                if stop_requested_at.get_or_insert_with(Instant::now).elapsed() > grace {
                    // A thread cannot be stopped from outside. It continues, and its result is discarded.
                    return self.with_stop_reason(start, lacks_disk_space, Err(Error::Cancelled));
                }
            }
            let position = listener.position();
            if position != stored_position || last_beat.elapsed() >= self.context.lease / 3 {
                self.beat(lease, listener, position).await;
                (stored_position, last_beat) = (position, Instant::now());
            }
        }
    }

    /// Replaces the error of a computation that was stopped for its time limit or for lack of disk space. The
    /// error then states that reason.
    fn with_stop_reason(
        &self,
        start: Instant,
        lacks_disk_space: bool,
        result: Result<Outcome, Error>,
    ) -> Result<Outcome, Error> {
        let reason = if lacks_disk_space {
            Error::DiskFull
        } else if start.elapsed() > self.context.budget {
            Error::TimeLimit
        } else {
            return result;
        };
        result.map_err(|error| {
            tracing::warn!(%error, %reason, "a job was stopped");
            reason
        })
    }

    async fn beat(&self, lease: &Lease, listener: &Listener, at: Position) {
        match self.renew(lease, at).await {
            Ok(Beat::Held) => {}
            Ok(Beat::CancelRequested | Beat::Lost) => listener.cancel(),
            // If the lease expires, the fence still prevents a second result.
            Err(error) => {
                tracing::warn!(job.id = %lease.job_id, %error, "the heartbeat of a job failed")
            }
        }
    }

    async fn renew(&self, lease: &Lease, at: Position) -> Result<Beat, store::Error> {
        let until_ms = self.context.now_ms().await? + self.lease_ms();
        let store = &self.context.store;
        store
            .heartbeat(lease, until_ms, at.stage, at.progress)
            .await
    }

    async fn end(
        &self,
        lease: &Lease,
        listener: &Listener,
        result: Result<Outcome, Error>,
    ) -> Result<Step, store::Error> {
        let (store, job) = (&self.context.store, lease.job_id);
        let result = match result {
            Ok(outcome) => finish(store, lease, &outcome).await.map_err(Error::from),
            Err(error) => Err(error),
        };
        let (change, step) = match result {
            Ok(change) => (change, Step::Done(job)),
            Err(error) if was_stopped(&error, listener) => {
                tracing::debug!(job.id = %job, %error, "the computation of a job ended as requested");
                if self.context.draining.is_cancelled() {
                    (store.release(lease).await?, Step::Released(job))
                } else {
                    (store.stop(lease, now_ms()).await?, Step::Cancelled(job))
                }
            }
            Err(error) if error.is_transient() && lease.attempt < MAX_ATTEMPTS => {
                tracing::warn!(job.id = %job, %error, "transient error in a job; it is retried");
                let wait_ms = BACKOFF_MS << (2 * (lease.attempt - 1));
                let run_at_ms = self.context.now_ms().await? + wait_ms;
                let change = store.retry(lease, run_at_ms).await?;
                (change, Step::Retried(job))
            }
            Err(error) => {
                let code = error.code();
                let (message, picture) = (user_message(&error), error.picture());
                let change = store.fail(lease, code, &message, picture, now_ms()).await?;
                (change, Step::Failed(job, code))
            }
        };
        Ok(match change {
            Change::Made => step,
            Change::Lost => Step::Lost(job),
        })
    }

    fn lease_ms(&self) -> i64 {
        i64::try_from(self.context.lease.as_millis()).unwrap_or(i64::MAX)
    }
}

/// Starts the computation on a blocking thread. The returned future waits for it and stores its files. If the
/// future is dropped, the thread continues, and its files are removed with its draft.
fn begin<Run>(
    context: &Context,
    lease: Lease,
    listener: Arc<Listener>,
    run: Run,
) -> impl Future<Output = Result<Outcome, Error>> + use<Run>
where
    Run: FnOnce(&Lease, &Attempt) -> Result<Product, Error> + Send + 'static,
{
    let (store, threads, runtime) = (context.store.clone(), context.threads, Handle::current());
    let blobs = store.blobs().clone();
    // The fence in the name prevents two attempts from sharing a folder.
    let (kind, result_id, fence) = (lease.kind.result_kind(), lease.result_id, lease.fence);
    let folder = format!("{}/{result_id}.{fence}", kind.plural());
    let span = Span::current();
    let work = tokio::task::spawn_blocking(move || {
        let _within = span.enter();
        let draft = store
            .blobs()
            .draft(&format!("{}.{}", lease.job_id, lease.fence))?;
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(threads)
            .start_handler(|_| lower_priority())
            .build()
            .map_err(std::io::Error::other)?;
        let attempt = Attempt::new(&store, &draft, &listener, threads, &runtime);
        let (product, files) = pool.install(|| {
            let product = run(&lease, &attempt)?;
            Ok::<_, Error>((product, store.blobs().seal(&draft)?))
        })?;
        Ok::<_, Error>((draft, product, files))
    });
    async move {
        let (draft, product, files) = work.await.unwrap_or(Err(Error::Panicked))?;
        blobs.adopt(draft, &folder).await?;
        Ok(Outcome {
            source: product.source,
            folder,
            files,
            params: product.params,
            summary: product.summary,
        })
    }
}

/// Lowers the priority of the calling thread, and of all threads and processes that it starts later, so that
/// requests are answered first. Failure is ignored: the job then runs at normal priority.
fn lower_priority() {
    let usual = getpriority_process(None).unwrap_or(0);
    if let Err(error) = setpriority_process(None, usual + NICE_INCREMENT) {
        tracing::debug!(%error, "the priority of a job could not be lowered");
    }
}

/// Links the result. Removes the files if the lease was lost.
async fn finish(store: &Store, lease: &Lease, outcome: &Outcome) -> Result<Change, store::Error> {
    match store.finish(lease, outcome, now_ms()).await {
        Ok(Change::Lost) => {
            store.blobs().discard(&outcome.folder).await?;
            Ok(Change::Lost)
        }
        Err(error) if store.is_linked_after(&outcome.folder, &error).await? => Ok(Change::Made),
        change => change,
    }
}

/// Returns whether the computation ended because it was cancelled, and not because of an error.
fn was_stopped(error: &Error, listener: &Listener) -> bool {
    flockreel_core::progress::Progress::cancelled(listener)
        && !matches!(error, Error::TimeLimit | Error::DiskFull)
}

/// Returns the message for the user. For internal errors this is only the meaning of the code; the details go
/// to the log.
fn user_message(error: &Error) -> String {
    match error.code() {
        Code::Internal | Code::DecoderCrashed => {
            tracing::error!(%error, "internal error in a job");
            error.code().meaning().to_owned()
        }
        _ => error.to_string(),
    }
}
