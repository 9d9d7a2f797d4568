//! Rescue: jobs whose worker has stopped sending heartbeats return to the queue or end
//! (docs/explanation/promises.md, "No job is lost" and "Poison jobs"). The lease decides, never the age of
//! the job: a job may run for hours while its worker sends heartbeats.
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

/// A job whose lease has ended.
#[derive(sqlx::FromRow)]
struct Expired {
    id: Uuid,
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
    /// Rescues every job whose lease expired before `now_ms`. The job is cancelled if that was requested, fails as
    /// `crashed_worker` if it was alone in three processes that stopped, and otherwise returns to the queue. A stop of
    /// the calling process `process`, which is alive, is no crash. Returns the new states.
    pub async fn rescue(
        &self,
        process: Uuid,
        now_ms: i64,
    ) -> Result<Vec<(JobId, JobState)>, Error> {
        let rescue = || self.rescue_leases_before(now_ms, process, now_ms);
        self.reserve.lend(rescue).await
    }

    /// Rescues all running jobs, at the start of a process. Call it only if [`Store::is_alone`]: the workers
    /// that hold their leases have then ended.
    pub async fn rescue_all(&self, now_ms: i64) -> Result<Vec<(JobId, JobState)>, Error> {
        let rescue = || self.rescue_leases_before(i64::MAX, Uuid::nil(), now_ms);
        self.reserve.lend(rescue).await
    }

    async fn rescue_leases_before(
        &self,
        lease_end_ms: i64,
        process: Uuid,
        now_ms: i64,
    ) -> Result<Vec<(JobId, JobState)>, Error> {
        let mut transaction = self.writer.begin().await?;
        let expired: Vec<Expired> = sql::query(
            "select id, worker, beside_crash, lone_crashes, cancel_requested, \
             (select count(*) from jobs o where o.state = 'running' and o.worker = j.worker) as n_of_process \
             from jobs j where state = 'running' and lease_until_ms < $1 order by id for update skip locked",
        )
        .bind(lease_end_ms)
        .fetch_all(&mut transaction)
        .await?;
        let mut rescued = Vec::with_capacity(expired.len());
        for job in &expired {
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
            settle(&mut transaction, job.id, lone_crashes, state, now_ms).await?;
            rescued.push((JobId(job.id), state));
        }
        for job in &expired {
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
