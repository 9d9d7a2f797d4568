//! Retry: a user wants another attempt at a job that failed or was cancelled
//! (docs/explanation/promises.md, "No job is lost"). The job returns to the queue with its parameters, its input and a
//! fresh budget, and with the jobs that ended because it did.

use super::enqueue::QUEUED;
use super::{JobState, enqueue};
use crate::store::owners::{Account, OwnerFilter};
use crate::store::{Error, Store, sql};
use flockreel_core::code::Code;
use flockreel_core::ids::JobId;

/// Returns whether another attempt may avoid a failure with this code: it came from a crash or a stop, from a machine
/// that was busy or full, from a limit that an operator can raise, or from a full quota.
pub fn may_pass(code: Code) -> bool {
    matches!(
        code,
        Code::CrashedWorker
            | Code::Internal
            | Code::StorageFull
            | Code::OwnerStorageFull
            | Code::TimeLimit
            | Code::MemoryLimit
            | Code::DecoderCrashed
    )
}

/// Result of [`Store::retry`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Retry {
    /// The job is queued.
    Queued,
    /// The job stays as it is, for this reason.
    Refused(Refusal),
    /// No visible job has this id.
    Absent,
}

/// Reason why a job cannot be tried again.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum Refusal {
    /// It is queued or running.
    #[error("the job has not ended")]
    NotEnded,
    /// It has a result.
    #[error("the job is done: its result exists")]
    Done,
    /// It failed for a reason in its input or its parameters.
    #[error(
        "another attempt would fail for the same reason: send a new request with another film or other parameters"
    )]
    SameReason,
    /// The job that makes its input failed or was cancelled.
    #[error("the job that makes its input is not done: retry that job")]
    NoInput,
}

impl Refusal {
    /// Returns why a job in this state, with this code and with a predecessor in this state, cannot be tried again;
    /// `None` if it can.
    pub(super) fn of(
        state: JobState,
        code: Option<Code>,
        before: Option<JobState>,
    ) -> Option<Refusal> {
        match state {
            JobState::Queued | JobState::Running => Some(Refusal::NotEnded),
            JobState::Done => Some(Refusal::Done),
            _ if matches!(before, Some(JobState::Failed | JobState::Cancelled)) => {
                Some(Refusal::NoInput)
            }
            JobState::Failed if !code.is_some_and(may_pass) => Some(Refusal::SameReason),
            JobState::Failed | JobState::Cancelled => None,
        }
    }
}

impl Store {
    /// Returns a job that failed or was cancelled to the queue, and with it all jobs that ended because it did.
    ///
    /// Fails with [`Error::QuotaExceeded`] and [`Error::QueueFull`] as [`Store::enqueue`] does. The quota is that of
    /// the caller's account.
    pub async fn retry(
        &self,
        job: JobId,
        owners: &OwnerFilter,
        account: &Account,
        max_queued: i64,
        now_ms: i64,
    ) -> Result<Retry, Error> {
        let mut transaction = self.begin().await?;
        transaction.lock("queue").await?;
        let sql = "select j.state, j.code, b.state from jobs j left join jobs b on b.id = j.after_job \
                   where j.id = $1 and ($2 is null or j.owner = $2)";
        let found = sql::query(sql).bind(job.0).bind(owners.parameter());
        let found: Option<(String, Option<String>, Option<String>)> =
            found.fetch_optional(&mut transaction).await?;
        let Some((state, code, before)) = found else {
            return Ok(Retry::Absent);
        };
        let before = before.map(JobState::try_from).transpose()?;
        let code = code.as_deref().and_then(Code::from_name);
        if let Some(refusal) = Refusal::of(state.try_into()?, code, before) {
            return Ok(Retry::Refused(refusal));
        }
        let n_rows = sql::query(
            "with recursive family (id) as ( \
                 select id from jobs where id = $1 \
                 union select j.id from jobs j join family f on j.after_job = f.id) \
             update jobs set state = 'queued', code = null, detail = null, refused_jpeg = null, mends = null, \
             finished_ms = null, run_at_ms = $2, cancel_requested = false, progress = 0, \
             own_crashes = 0, lone_crashes = 0, transient_ends = 0 \
             where id in (select id from family) and state in ('failed', 'cancelled') and (id = $1 \
             or code = 'input_failed' \
             or code is null and finished_ms = (select finished_ms from jobs where id = $1))",
        )
        .bind(job.0)
        .bind(now_ms)
        .execute(&mut transaction)
        .await?;
        enqueue::check_limits(&mut transaction, account, max_queued).await?;
        transaction.notify(QUEUED).await?;
        transaction.commit().await?;
        tracing::info!(job.id = %job, n_rows, "job retried");
        Ok(Retry::Queued)
    }
}
