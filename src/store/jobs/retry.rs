//! Retry: a job that failed may succeed later. The attempt counts.

use super::{Change, Lease};
use crate::store::{Error, Store, sql};

impl Store {
    /// Returns the job to the queue. It is not claimed before `run_at_ms`.
    pub async fn retry(&self, lease: &Lease, run_at_ms: i64) -> Result<Change, Error> {
        let retry = || async {
            let n_rows = sql::query(
                "update jobs set state = 'queued', worker = null, lease_until_ms = null, \
                 stage = null, progress = 0, run_at_ms = $3 \
                 where id = $1 and fence = $2 and state = 'running'",
            )
            .bind(lease.job_id.0)
            .bind(lease.fence)
            .bind(run_at_ms)
            .execute(&self.writer)
            .await?;
            tracing::warn!(job.id = %lease.job_id, lease.attempt, n_rows, "job will be retried");
            Ok(Change::from_rows(n_rows))
        };
        self.reserve.lend(retry).await
    }
}
