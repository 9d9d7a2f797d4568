//! Release: a stopping worker returns its job to the queue. The attempt does not count
//! (docs/explanation/promises.md, "Graceful stop").

use super::{Change, Lease};
use crate::store::{Error, Store, sql};

impl Store {
    /// Returns the job to the queue as if it had not been claimed, except for its fence.
    pub async fn release(&self, lease: &Lease) -> Result<Change, Error> {
        let release = || async {
            let n_rows = sql::query(
                "update jobs set state = 'queued', worker = null, lease_until_ms = null, \
                 stage = null, progress = 0, attempt = attempt - 1 \
                 where id = $1 and fence = $2 and state = 'running'",
            )
            .bind(lease.job_id.0)
            .bind(lease.fence)
            .execute(&self.writer)
            .await?;
            tracing::info!(job.id = %lease.job_id, n_rows, "job released");
            Ok(Change::from_rows(n_rows))
        };
        self.reserve.lend(release).await
    }
}
