//! A worker: claims a job, has a child process compute it, and ends it. [`Worker::step`] does this once and returns
//! the outcome; the loop is in the supervisor.
//!
//! While the child computes, the worker sends a heartbeat every third of the lease, and up to twice per second if
//! there is new progress.

use std::convert::Infallible;
use std::sync::OnceLock;
use std::time::Duration;

use tokio::time::{Instant, MissedTickBehavior, interval};
use tracing::Instrument;

use super::clock::now_ms;
use super::listener::Position;
use super::{Context, Error, Listener, attempt, stages};
use crate::store;
use crate::store::Store;
use crate::store::jobs::claim::Lane;
use crate::store::jobs::fail::Shown;
use crate::store::jobs::finish::Outcome;
use crate::store::jobs::heartbeat::Beat;
use crate::store::jobs::requeue::End;
use crate::store::jobs::retry::may_pass;
use crate::store::jobs::{Change, Lease};
use crate::traces;
use flockreel_core::code::Code;
use flockreel_core::ids::JobId;

/// Interval at which the worker checks a running job. Free choice.
const TICK: Duration = Duration::from_millis(500);
/// Number of crashes of its own process, and of ends for transient reasons, after which a job fails. Free choice.
const MAX_BAD_ENDS: i64 = 3;
/// Wait after the first bad end, milliseconds. Every further wait is four times as long. Free choice.
const BACKOFF_MS: i64 = 2_000;

/// Outcome of a step.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Step {
    /// No job was ready, or the disk has too little free space for one.
    Idle,
    /// The job is done and its result is linked.
    Done(JobId),
    /// The job failed permanently.
    Failed(JobId, Code),
    /// The job failed and will be tried again.
    Retried(JobId),
    /// The job was cancelled while it ran.
    Cancelled(JobId),
    /// The job returned to the queue because the process stops, or because a job of higher priority waits.
    Released(JobId),
    /// The lease was lost. Nothing of this attempt was kept.
    Lost(JobId),
}

/// A worker. It runs one job at a time.
pub struct Worker {
    context: Context,
    lane: Lane,
}

impl Worker {
    /// Returns a worker that runs all jobs.
    pub fn new(context: Context) -> Worker {
        Worker::in_lane(context, Lane::All)
    }

    /// Returns a worker that runs the jobs of a lane.
    pub fn in_lane(context: Context, lane: Lane) -> Worker {
        Worker { context, lane }
    }

    /// Claims the next job, runs it and ends it. While disk space is short, jobs stay in the queue.
    pub async fn step(&self) -> Result<Step, store::Error> {
        if self.context.lacks_disk_space() {
            return Ok(Step::Idle);
        }
        let (process, now_ms) = (self.context.process, self.context.now_ms().await?);
        let store = &self.context.store;
        let claimed = store.claim_in(self.lane, process, now_ms, self.lease_ms());
        let Some(lease) = claimed.await? else {
            return Ok(Step::Idle);
        };
        let span = tracing::info_span!(
            "job",
            job.id = %lease.job_id,
            job.kind = lease.kind.name(),
            attempt = lease.attempt,
            trace_id = lease.trace_id()
        );
        if let Some(header) = &lease.traceparent {
            traces::set_parent(&span, header);
        }
        let step = self.attempt(lease).instrument(span.clone()).await;
        if let Ok(Step::Failed(_, code)) = &step {
            traces::set_failure(&span, code.name());
        }
        step
    }

    async fn attempt(&self, lease: Lease) -> Result<Step, store::Error> {
        let listener = Listener::new(stages(lease.kind));
        let work = attempt::compute(&self.context, &lease, &listener);
        let result = self.beat_until_done(&lease, &listener, work).await;
        let step = self.end(&lease, &listener, result).await?;
        self.context.meters.count(lease.kind, &step, &listener);
        Ok(step)
    }

    /// Renews the lease, stores progress and passes on cancellation until the computation ends. Cancels it at
    /// the time limit, if disk space is short, to give way, or if the process stops.
    async fn beat_until_done(
        &self,
        lease: &Lease,
        listener: &Listener,
        work: impl Future<Output = Result<Outcome, Error>>,
    ) -> Result<Outcome, Error> {
        let reason = OnceLock::new();
        // Both go on while the other waits: the computation may hold the row of the job that a heartbeat changes.
        let result = tokio::select! {
            result = work => result,
            never = self.watch(lease, listener, &reason) => match never {},
        };
        with_stop_reason(reason.into_inner(), result)
    }

    /// Renews the lease and stores progress for ever. Cancels the computation if it must stop, and stores the `reason`.
    async fn watch(
        &self,
        lease: &Lease,
        listener: &Listener,
        reason: &OnceLock<Error>,
    ) -> Infallible {
        let mut tick = interval(TICK.min(self.context.lease / 3));
        tick.set_missed_tick_behavior(MissedTickBehavior::Delay);
        let (start, mut last_beat) = (Instant::now(), Instant::now());
        let mut stored_position = listener.position();
        loop {
            tick.tick().await;
            if reason.get().is_none() {
                // A job that keeps parts has the time for each of them.
                let since = listener.advanced_at().map_or(start, Instant::from_std);
                if let Some(found) = self.reason_to_stop(lease, since).await {
                    reason.get_or_init(|| found);
                }
            }
            if reason.get().is_some() || self.context.draining.is_cancelled() {
                listener.cancel();
            }
            let position = listener.position();
            if position != stored_position || last_beat.elapsed() >= self.context.lease / 3 {
                self.beat(lease, listener, position).await;
                (stored_position, last_beat) = (position, Instant::now());
            }
        }
    }

    /// Returns why a computation must stop, if it must. It began, or kept the last part of its result, at `since`.
    async fn reason_to_stop(&self, lease: &Lease, since: Instant) -> Option<Error> {
        let lacks_space = self.context.lacks_disk_space();
        if lacks_space {
            return Some(Error::DiskFull);
        }
        let is_late = since.elapsed() > self.context.budget;
        if is_late {
            return Some(Error::TimeLimit);
        }
        let gives_way = async {
            let now_ms = self.context.now_ms().await?;
            self.context.store.must_give_way(lease, now_ms).await
        };
        // Without an answer of the database, the job goes on.
        gives_way.await.unwrap_or(false).then_some(Error::GaveWay)
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
        let is_draining = self.context.draining.is_cancelled();
        let result = match result {
            Ok(outcome) => finish(store, lease, &outcome).await.map_err(Error::from),
            Err(error) => Err(error),
        };
        let (change, step) = match result {
            Ok(change) => (change, Step::Done(job)),
            Err(Error::GaveWay) => (store.release(lease).await?, Step::Released(job)),
            // Who stops the service may stop the processes of its jobs, too.
            Err(error)
                if is_draining && (was_stopped(&error, listener) || may_pass(error.code())) =>
            {
                tracing::debug!(job.id = %job, %error, "the computation of a job ended as the service stops");
                (store.release(lease).await?, Step::Released(job))
            }
            Err(error) if was_stopped(&error, listener) => {
                tracing::debug!(job.id = %job, %error, "the computation of a job ended as requested");
                (store.stop(lease, now_ms()).await?, Step::Cancelled(job))
            }
            Err(error) if let Some((end, n_earlier)) = bad_end(&error, lease, listener) => {
                tracing::warn!(job.id = %job, %error, n_earlier, "a job ended badly; it is tried again");
                let run_at_ms = self.context.now_ms().await? + (BACKOFF_MS << (2 * n_earlier));
                let change = store.requeue(lease, end, run_at_ms).await?;
                (change, Step::Retried(job))
            }
            Err(error) => {
                let code = error.code();
                let mends = serde_json::to_string(&error.mends()).ok();
                let shown = Shown {
                    picture: error.picture(),
                    mends: mends.as_deref(),
                };
                let message = user_message(&error);
                let change = store.fail(lease, code, &message, shown, now_ms()).await?;
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

/// Replaces the error of a computation that was stopped for this reason.
fn with_stop_reason(
    reason: Option<Error>,
    result: Result<Outcome, Error>,
) -> Result<Outcome, Error> {
    match (result, reason) {
        (Err(error), Some(reason)) => {
            tracing::info!(%error, %reason, "a job was stopped");
            Err(reason)
        }
        (result, _) => result,
    }
}

/// Returns whether the computation ended because it was cancelled, and not because of an error.
fn was_stopped(error: &Error, listener: &Listener) -> bool {
    listener.is_cancelled() && !matches!(error, Error::TimeLimit | Error::DiskFull)
}

/// Returns how an attempt ended if the job is to be tried again, and the number of earlier ends of this kind since the
/// job last kept a part of its result.
fn bad_end(error: &Error, lease: &Lease, listener: &Listener) -> Option<(End, i64)> {
    let (end, n_earlier) = match error {
        Error::Crashed(_) => (End::Crash, lease.own_crashes),
        error if error.is_transient() => (End::Transient, lease.transient_ends),
        _ => return None,
    };
    let n_earlier = match listener.advanced_at() {
        Some(_) => 0,
        None => n_earlier,
    };
    (n_earlier + 1 < MAX_BAD_ENDS).then_some((end, n_earlier))
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
