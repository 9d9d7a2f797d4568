//! Claim: a worker takes the next queued job under a lease with a fresh fence. Owners take turns, so
//! that nobody waits for all that another has queued (RELIABILITY.md, R9).

use sqlx::types::Uuid;

use super::{Kind, Lease};
use crate::ids::JobId;
use crate::store::{Error, Store, sql};

impl Store {
    /// The next job whose turn it is: of the owner with the fewest running jobs; highest priority
    /// first; of the owner who waited longest since a job of theirs began; the oldest. `None` when
    /// there is none. A job that follows another waits until that one is done.
    pub async fn claim(
        &self,
        worker: Uuid,
        now_ms: i64,
        lease_ms: i64,
    ) -> Result<Option<Lease>, Error> {
        let row: Option<(Uuid, String, String, Uuid, i64, i64)> = sql::query(
            "with turns (owner, n_running, last_ms) as ( \
                 select owner, (select count(*) from jobs r \
                                where r.owner = q.owner and r.state = 'running'), \
                        (select max(started_ms) from jobs s where s.owner = q.owner) \
                 from (select distinct owner from jobs where state = 'queued') q) \
             update jobs set state = 'running', fence = fence + 1, attempt = attempt + 1, \
             worker = $1, lease_until_ms = $3, started_ms = coalesce(started_ms, $2), \
             stage = null, progress = 0 \
             where state = 'queued' and id = ( \
                 select j.id from jobs j join turns t on t.owner = j.owner \
                 where j.state = 'queued' and j.run_at_ms <= $2 \
                 and (j.after_job is null \
                      or exists (select 1 from jobs a where a.id = j.after_job and a.state = 'done')) \
                 order by t.n_running, j.priority desc, coalesce(t.last_ms, 0), j.id limit 1 for update of j skip locked) \
             returning id, kind, input, result_id, attempt, fence",
        )
        .bind(worker)
        .bind(now_ms)
        .bind(now_ms + lease_ms)
        .fetch_optional(&self.writer)
        .await?;
        let Some((id, kind, input, result_id, attempt, fence)) = row else {
            return Ok(None);
        };
        tracing::info!(job.id = %id, job.kind = kind, attempt, fence, "job claimed");
        Ok(Some(Lease {
            job_id: JobId(id),
            kind: Kind::from_name(&kind)?,
            input,
            result_id,
            attempt,
            fence,
        }))
    }
}
