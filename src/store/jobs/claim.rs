//! Claim: a worker takes the next queued job with a lease and a new fence. Owners take turns, so that one
//! owner's many jobs do not delay another owner's job (docs/explanation/promises.md, "Fair queue"). The claim names
//! the process of the worker, so that a rescue knows which jobs ran beside each other.

use sqlx::types::Uuid;

use super::Lease;
use crate::store::{Error, Store, sql};

/// Time in the queue after which a job is late, milliseconds. Free choice.
const LATE_MS: i64 = 600_000;

/// Time for which a job must have been ready before one of low priority gives way to it, milliseconds. An idle worker takes
/// it sooner. Free choice.
const GIVE_WAY_MS: i64 = 1_000;

/// The jobs that a worker runs.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Lane {
    /// All jobs.
    All,
    /// Small jobs only.
    Short,
}

impl Store {
    /// Claims the next of all jobs for a process, as [`Store::claim_in`] does.
    pub async fn claim(
        &self,
        process: Uuid,
        now_ms: i64,
        lease_ms: i64,
    ) -> Result<Option<Lease>, Error> {
        self.claim_in(Lane::All, process, now_ms, lease_ms).await
    }

    /// Claims the next job of a lane for a process. Returns `None` if no job is ready. A job that depends on another
    /// one is ready when that one is done.
    ///
    /// Order of the jobs: higher priority first, then owners with fewer running jobs, then owners whose last job
    /// started longer ago. A job of low priority gets the usual one when it is late. Among the jobs of one owner small films go first, since a person waits for them,
    /// then small measurements, then the others, then those of low priority; older ones before later ones. Every second start goes to the
    /// oldest job, if that is late, so that no job waits for ever.
    ///
    /// The counts of the owners are materialized, or SQLite would take them again for each queued job.
    pub async fn claim_in(
        &self,
        lane: Lane,
        process: Uuid,
        now_ms: i64,
        lease_ms: i64,
    ) -> Result<Option<Lease>, Error> {
        let lease: Option<Lease> = sql::query(
            "with turns (owner, n_running, last_ms, n_started) as materialized ( \
                 select owner, (select count(*) from jobs r \
                                where r.owner = q.owner and r.state = 'running'), \
                        (select max(started_ms) from jobs s where s.owner = q.owner), \
                        (select count(started_ms) from jobs s where s.owner = q.owner) \
                 from (select distinct owner from jobs where state = 'queued') q) \
             update jobs set state = 'running', fence = fence + 1, attempt = attempt + 1, \
             worker = $1, lease_until_ms = $3, started_ms = coalesce(started_ms, $2), \
             beside_crash = false, stage = null, progress = 0 \
             where state = 'queued' and id = ( \
                 select j.id from jobs j join turns t on t.owner = j.owner \
                 where j.state = 'queued' and j.run_at_ms <= $2 and (j.small or not $4) \
                 and (j.after_job is null \
                      or exists (select 1 from jobs a where a.id = j.after_job and a.state = 'done')) \
                 order by case when j.priority < 0 and j.created_ms <= $5 then 0 else j.priority end desc, \
                 t.n_running, coalesce(t.last_ms, 0), \
                 case when t.n_started % 2 = 1 and j.created_ms <= $5 then 0 when j.priority < 0 then 4 \
                      when j.small and j.kind <> 'analysis' then 1 when j.small then 2 else 3 end, \
                 j.id limit 1 for update of j skip locked) \
             returning id as job_id, kind, input, result_id, attempt, fence, own_crashes, transient_ends, \
             traceparent",
        )
        .bind(process)
        .bind(now_ms)
        .bind(now_ms + lease_ms)
        .bind(lane == Lane::Short)
        .bind(now_ms - LATE_MS)
        .fetch_optional(&self.writer)
        .await?;
        if let Some(lease) = &lease {
            tracing::info!(job.id = %lease.job_id, job.kind = lease.kind.name(), attempt = lease.attempt, fence = lease.fence, "job claimed");
        }
        Ok(lease)
    }

    /// Returns whether a running job must give way: it has a low priority, is not late, and no worker takes a job of
    /// higher priority that is ready.
    pub async fn must_give_way(&self, lease: &Lease, now_ms: i64) -> Result<bool, Error> {
        let sql = "select exists (select 1 from jobs r join jobs j on j.priority > r.priority \
                   where r.id = $1 and r.priority < 0 and r.created_ms > $2 \
                   and j.state = 'queued' and j.run_at_ms <= $3 and (j.after_job is null or exists ( \
                   select 1 from jobs a where a.id = j.after_job and a.state = 'done' and a.finished_ms <= $3)))";
        let exists = sql::query_scalar(sql)
            .bind(lease.job_id.0)
            .bind(now_ms - LATE_MS)
            .bind(now_ms - GIVE_WAY_MS);
        Ok(exists.fetch_one(&self.reader).await?)
    }
}
