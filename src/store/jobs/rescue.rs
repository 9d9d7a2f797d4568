//! Rescue: jobs whose worker has stopped sending heartbeats return to the queue or end
//! (docs/explanation/promises.md, "No job is lost" and "Poison jobs"). The lease decides, never the age of
//! the job: a job may run for hours while its worker sends heartbeats.

use sqlx::types::Uuid;

use super::JobState;
use super::follow::{cancel_followers, fail_followers};
use crate::store::{Error, Store, Transaction, sql};
use flockreel_core::code::Code;
use flockreel_core::ids::JobId;

/// Number of crashes after which a job is quarantined. Free choice.
const MAX_CRASHES: i64 = 2;

impl Store {
    /// Rescues every job whose lease expired before `now_ms`. The job is cancelled if that was requested,
    /// fails as `crashed_worker` at its second crash, and otherwise returns to the queue. Returns the new
    /// states.
    pub async fn rescue(&self, now_ms: i64) -> Result<Vec<(JobId, JobState)>, Error> {
        let rescue = || self.rescue_leases_before(now_ms, now_ms);
        self.reserve.lend(rescue).await
    }

    /// Rescues all running jobs, at the start of a process. Call it only if [`Store::is_alone`]: the workers
    /// that hold their leases have then ended.
    pub async fn rescue_all(&self, now_ms: i64) -> Result<Vec<(JobId, JobState)>, Error> {
        let rescue = || self.rescue_leases_before(i64::MAX, now_ms);
        self.reserve.lend(rescue).await
    }

    async fn rescue_leases_before(
        &self,
        lease_end_ms: i64,
        now_ms: i64,
    ) -> Result<Vec<(JobId, JobState)>, Error> {
        let mut transaction = self.writer.begin().await?;
        let expired: Vec<(Uuid, i64, bool)> = sql::query(
            "select id, crashes + 1, cancel_requested from jobs \
             where state = 'running' and lease_until_ms < $1 order by id for update skip locked",
        )
        .bind(lease_end_ms)
        .fetch_all(&mut transaction)
        .await?;
        let mut rescued = Vec::with_capacity(expired.len());
        for (job, crashes, cancel_requested) in expired {
            let state = if cancel_requested {
                JobState::Cancelled
            } else if crashes >= MAX_CRASHES {
                JobState::Failed
            } else {
                JobState::Queued
            };
            settle(&mut transaction, job, state, now_ms).await?;
            rescued.push((JobId(job), state));
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
    state: JobState,
    now_ms: i64,
) -> Result<(), sqlx::Error> {
    let failed = state == JobState::Failed;
    sql::query(
        "update jobs set state = $2, worker = null, lease_until_ms = null, crashes = crashes + 1, \
         stage = null, progress = 0, finished_ms = $3, code = $4, detail = $5 where id = $1",
    )
    .bind(job)
    .bind(state.name())
    .bind(state.is_final().then_some(now_ms))
    .bind(failed.then_some(Code::CrashedWorker.name()))
    .bind(failed.then_some(Code::CrashedWorker.meaning()))
    .execute(&mut *transaction)
    .await?;
    match state {
        JobState::Cancelled => cancel_followers(transaction, job, now_ms).await,
        JobState::Failed => fail_followers(transaction, job, now_ms).await,
        _ => Ok(()),
    }
}
