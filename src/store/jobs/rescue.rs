//! Rescue: jobs whose worker has stopped sending heartbeats return to the queue or end
//! (docs/explanation/promises.md, "No job is lost" and "Poison jobs"). The lease decides, never the age of
//! the job: a job may run for hours while its worker sends heartbeats. The caller decides which leases have ended,
//! because clocks may jump.
//!
//! A crash of a process is blamed on a job only if no other job ran in it. The leases of one process end some seconds
//! apart, so the first rescue marks the jobs beside it.

use sqlx::types::Uuid;

use super::JobState;
use super::follow::{cancel_followers, fail_followers};
use crate::store::{Error, Store, Transaction, sql};
use flockreel_core::code::Code;
use flockreel_core::ids::JobId;

/// Number of crashes of a process that a job may be the only one in. Free choice.
const MAX_LONE_CRASHES: i64 = 3;

/// The lease of a running job. Every heartbeat changes it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, sqlx::FromRow)]
pub struct HeldLease {
    /// Id of the job.
    pub job_id: Uuid,
    /// Number of the claim.
    pub fence: i64,
    /// End of the lease by the clock of its worker, milliseconds since 1970.
    pub until_ms: i64,
}

/// A running job.
#[derive(sqlx::FromRow)]
struct Running {
    #[sqlx(flatten)]
    lease: HeldLease,
    /// The process that held the lease.
    worker: Uuid,
    /// Number of running jobs of that process, with this one.
    n_of_process: i64,
    /// Whether another job of that process was rescued before.
    beside_crash: bool,
    lone_crashes: i64,
    cancel_requested: bool,
}

impl Store {
    /// Returns the leases of all running jobs.
    pub async fn held_leases(&self) -> Result<Vec<HeldLease>, Error> {
        let sql = "select id as job_id, fence, lease_until_ms as until_ms from jobs where state = 'running'";
        Ok(sql::query(sql).fetch_all(&self.reader).await?)
    }

    /// Rescues the jobs whose leases have `ended`, unless a heartbeat has changed them since. A job is cancelled if
    /// that was requested, fails as `crashed_worker` if it was alone in three processes that stopped, and otherwise
    /// returns to the queue. A stop of the calling process `process`, which is alive, is no crash. Returns the new
    /// states.
    pub async fn rescue(
        &self,
        process: Uuid,
        ended: &[HeldLease],
        now_ms: i64,
    ) -> Result<Vec<(JobId, JobState)>, Error> {
        if ended.is_empty() {
            return Ok(Vec::new());
        }
        let rescue = || self.rescue_where(|lease| ended.contains(lease), process, now_ms);
        self.reserve.lend(rescue).await
    }

    /// Rescues all running jobs, at the start of a process. Call it only if [`Store::is_alone`]: the workers
    /// that hold their leases have then ended.
    pub async fn rescue_all(&self, now_ms: i64) -> Result<Vec<(JobId, JobState)>, Error> {
        let rescue = || self.rescue_where(|_| true, Uuid::nil(), now_ms);
        self.reserve.lend(rescue).await
    }

    async fn rescue_where(
        &self,
        has_ended: impl Fn(&HeldLease) -> bool,
        process: Uuid,
        now_ms: i64,
    ) -> Result<Vec<(JobId, JobState)>, Error> {
        let mut transaction = self.writer.begin().await?;
        let running: Vec<Running> = sql::query(
            "select id as job_id, fence, lease_until_ms as until_ms, worker, beside_crash, lone_crashes, cancel_requested, \
             (select count(*) from jobs o where o.state = 'running' and o.worker = j.worker) as n_of_process \
             from jobs j where state = 'running' order by id for update skip locked",
        )
        .fetch_all(&mut transaction)
        .await?;
        let expired = running.iter().filter(|job| has_ended(&job.lease));
        let mut rescued = Vec::new();
        for job in expired.clone() {
            let was_alone = job.n_of_process == 1 && !job.beside_crash;
            let is_blamed = was_alone && job.worker != process;
            let lone_crashes = job.lone_crashes + i64::from(is_blamed);
            let state = if job.cancel_requested {
                JobState::Cancelled
            } else if lone_crashes >= MAX_LONE_CRASHES {
                JobState::Failed
            } else {
                JobState::Queued
            };
            settle(
                &mut transaction,
                job.lease.job_id,
                lone_crashes,
                state,
                now_ms,
            )
            .await?;
            rescued.push((JobId(job.lease.job_id), state));
        }
        for job in expired {
            let sql = "update jobs set beside_crash = true where state = 'running' and worker = $1";
            let mark = sql::query(sql).bind(job.worker);
            mark.execute(&mut transaction).await?;
        }
        transaction.commit().await?;
        for (job, state) in &rescued {
            tracing::warn!(job.id = %job, state = state.name(), "job rescued: its worker stopped or its lease ended");
        }
        Ok(rescued)
    }
}

async fn settle(
    transaction: &mut Transaction,
    job: Uuid,
    lone_crashes: i64,
    state: JobState,
    now_ms: i64,
) -> Result<(), sqlx::Error> {
    let failed = state == JobState::Failed;
    sql::query(
        "update jobs set state = $2, worker = null, lease_until_ms = null, lone_crashes = $6, \
         stage = null, progress = 0, finished_ms = $3, code = $4, detail = $5 where id = $1",
    )
    .bind(job)
    .bind(state.name())
    .bind(state.is_final().then_some(now_ms))
    .bind(failed.then_some(Code::CrashedWorker.name()))
    .bind(failed.then_some(Code::CrashedWorker.meaning()))
    .bind(lone_crashes)
    .execute(&mut *transaction)
    .await?;
    match state {
        JobState::Cancelled => cancel_followers(transaction, job, now_ms).await,
        JobState::Failed => fail_followers(transaction, job, now_ms).await,
        _ => Ok(()),
    }
}
