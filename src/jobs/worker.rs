//! A worker: claims one job, runs it, ends it (STYLE.md, habit 8). [`Worker::step`] does that once
//! and says what happened; the loop around it is the supervisor's.
//!
//! The computation runs on a blocking thread with a pool of its own; beside it, this task beats
//! every third of the lease, and at most twice a second when there is progress to note.

use std::pin::pin;
use std::sync::Arc;
use std::time::Duration;

use rustix::process::{getpriority_process, setpriority_process};
use tokio::runtime::Handle;
use tokio::time::{Instant, MissedTickBehavior, interval};
use tracing::{Instrument, Span};
use uuid::Uuid;

use super::attempt::folder_of;
use super::clock::now_ms;
use super::listener::Position;
use super::{Attempt, Context, Error, Job, Listener, Product, stages};
use crate::code::Code;
use crate::ids::JobId;
use crate::store;
use crate::store::Store;
use crate::store::jobs::finish::Outcome;
use crate::store::jobs::heartbeat::Beat;
use crate::store::jobs::{Change, Lease};

const TICK: Duration = Duration::from_millis(500);
const MAX_ATTEMPTS: i64 = 3;
/// The longest wait for work to let go once the process stops; then it is abandoned.
const LET_GO: Duration = Duration::from_secs(10);
/// The wait before the second attempt; each further one waits four times as long.
const BACKOFF_MS: i64 = 2_000;

/// How much nicer a job is than the service: under load it gets a tenth of what a request gets.
const PATIENCE: i32 = 10;

/// What one step did.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Step {
    /// There was nothing to do.
    Idle,
    /// A job is done, its result linked.
    Done(JobId),
    /// A job failed for good.
    Failed(JobId, Code),
    /// A job failed and will be tried again.
    Retried(JobId),
    /// A job was cancelled while it ran.
    Cancelled(JobId),
    /// A job went back to the queue because the process stops.
    Released(JobId),
    /// A job was no longer ours when it ended: nothing of this run was kept.
    Lost(JobId),
}

/// Works on one job at a time.
pub struct Worker {
    context: Context,
    /// Random per process and worker: a restarted worker is never taken for its predecessor.
    id: Uuid,
}

impl Worker {
    /// A worker with an identity of its own.
    pub fn new(context: Context) -> Worker {
        Worker {
            context,
            id: Uuid::now_v7(),
        }
    }

    /// Claims the next job, runs it and ends it.
    pub async fn step(&self) -> Result<Step, store::Error> {
        self.step_by(|lease, attempt| Job::decode(lease)?.run(attempt))
            .await
    }

    /// The same with another way to do the work, for tests of the queue.
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

    /// Keeps the lease, notes progress, and passes on the wish to stop, until the work ends.
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
        let mut noted = listener.position();
        let (mut told_to_stop, mut lacks_room) = (None, false);
        loop {
            tokio::select! {
                ended = &mut work => return self.unless_stopped(start, lacks_room, ended),
                _ = tick.tick() => {}
            }
            lacks_room |= self.context.lacks_room();
            let is_late = start.elapsed() > self.context.budget;
            if is_late || lacks_room || self.context.draining.is_cancelled() {
                listener.cancel();
                let let_go = LET_GO.min(self.context.lease);
                if told_to_stop.get_or_insert_with(Instant::now).elapsed() > let_go {
                    // A thread cannot be ended from outside: it runs on, and its result is thrown away.
                    return self.unless_stopped(start, lacks_room, Err(Error::Cancelled));
                }
            }
            let position = listener.position();
            if position != noted || last_beat.elapsed() >= self.context.lease / 3 {
                self.beat(lease, listener, position).await;
                (noted, last_beat) = (position, Instant::now());
            }
        }
    }

    /// Work that was told to stop because its time was up, or the room, failed for that reason, whatever it says.
    fn unless_stopped(
        &self,
        start: Instant,
        lacks_room: bool,
        result: Result<Outcome, Error>,
    ) -> Result<Outcome, Error> {
        match start.elapsed() > self.context.budget {
            _ if lacks_room => result.map_err(|error| {
                tracing::warn!(%error, "a job was stopped for want of room");
                Error::NoRoom
            }),
            true => result.map_err(|error| {
                tracing::warn!(%error, "a job took too long");
                Error::OverTime
            }),
            false => result,
        }
    }

    async fn beat(&self, lease: &Lease, listener: &Listener, at: Position) {
        match self.renew(lease, at).await {
            Ok(Beat::Held) => {}
            Ok(Beat::CancelRequested | Beat::Lost) => listener.cancel(),
            // The lease may run out; the fence keeps the books right whatever happens then.
            Err(error) => tracing::warn!(job.id = %lease.job_id, %error, "a heartbeat failed"),
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
                tracing::debug!(job.id = %job, %error, "the work let go");
                if self.context.draining.is_cancelled() {
                    (store.release(lease).await?, Step::Released(job))
                } else {
                    (store.stop(lease, now_ms()).await?, Step::Cancelled(job))
                }
            }
            Err(error) if error.may_pass() && lease.attempt < MAX_ATTEMPTS => {
                tracing::warn!(job.id = %job, %error, "the work failed, perhaps for a moment");
                let wait_ms = BACKOFF_MS << (2 * (lease.attempt - 1));
                let run_at_ms = self.context.now_ms().await? + wait_ms;
                let change = store.retry(lease, run_at_ms).await?;
                (change, Step::Retried(job))
            }
            Err(error) => {
                let code = error.code();
                let (said, picture) = (said(&error), error.picture());
                let change = store.fail(lease, code, &said, picture, now_ms()).await?;
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

/// Begins the work on a blocking thread; what is returned waits for it and puts what it made into place. Who drops
/// that has given the work up: its thread runs on, and what it makes goes with its draft.
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
    let (blobs, result_id, fence) = (store.blobs().clone(), lease.result_id, lease.fence);
    let span = Span::current();
    let work = tokio::task::spawn_blocking(move || {
        let _within = span.enter();
        let draft = store
            .blobs()
            .draft(&format!("{}.{}", lease.job_id, lease.fence))?;
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(threads)
            .start_handler(|_| step_back())
            .build()
            .map_err(std::io::Error::other)?;
        let attempt = Attempt::new(&store, &draft, &listener, threads, &runtime);
        let made = pool.install(|| {
            let product = run(&lease, &attempt)?;
            Ok::<_, Error>((product, store.blobs().seal(&draft)?))
        });
        let (product, files) = made?;
        Ok::<_, Error>((draft, product, files))
    });
    async move {
        let (draft, product, files) = work.await.unwrap_or(Err(Error::Panicked))?;
        let folder = folder_of(product.made, result_id, fence);
        blobs.adopt(draft, &folder).await?;
        Ok(Outcome {
            made: product.made,
            folder,
            files,
            params: product.params,
            summary: product.summary,
        })
    }
}

/// Lets those who answer requests go first: a job takes minutes and has time, a request has not. Threads and
/// processes that the calling thread starts from now on are as patient.
fn step_back() {
    let usual = getpriority_process(None).unwrap_or(0);
    if let Err(error) = setpriority_process(None, usual + PATIENCE) {
        tracing::debug!(%error, "a job runs with the priority of the service");
    }
}

/// Links the result; one that came too late is thrown away.
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

/// Whether the work ended because somebody wanted it to, and not because it failed.
fn was_stopped(error: &Error, listener: &Listener) -> bool {
    crate::progress::Progress::cancelled(listener)
        && !matches!(error, Error::OverTime | Error::NoRoom)
}

/// What a person is told: the reason, where it is one of theirs; what failed inside stays in the log.
fn said(error: &Error) -> String {
    match error.code() {
        Code::Internal | Code::DecoderCrashed => {
            tracing::error!(%error, "a job failed inside");
            error.code().meaning().to_owned()
        }
        _ => error.to_string(),
    }
}
