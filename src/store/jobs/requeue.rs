//! Requeue: a job whose attempt ended badly may be done by another attempt
//! (docs/explanation/promises.md, "Poison jobs"). Each kind of bad end is counted by itself.

use super::{Change, Lease};
use crate::store::{Error, Store, sql};

/// How an attempt ended badly.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum End {
    /// Its own process crashed.
    Crash,
    /// For a transient reason, such as a media tool that was killed from outside.
    Transient,
}

impl Store {
    /// Returns the job to the queue and counts the end of its attempt. It is not claimed before `run_at_ms`.
    pub async fn requeue(&self, lease: &Lease, end: End, run_at_ms: i64) -> Result<Change, Error> {
        let requeue = || async {
            let n_rows = sql::query(
                "update jobs set state = 'queued', worker = null, lease_until_ms = null, \
                 stage = null, progress = 0, run_at_ms = $3, own_crashes = own_crashes + $4, \
                 transient_ends = transient_ends + $5 \
                 where id = $1 and fence = $2 and state = 'running'",
            )
            .bind(lease.job_id.0)
            .bind(lease.fence)
            .bind(run_at_ms)
            .bind(i64::from(end == End::Crash))
            .bind(i64::from(end == End::Transient))
            .execute(&self.writer)
            .await?;
            tracing::warn!(job.id = %lease.job_id, lease.attempt, ?end, n_rows, "job requeued");
            Ok(Change::from_rows(n_rows))
        };
        self.reserve.lend(requeue).await
    }
}
