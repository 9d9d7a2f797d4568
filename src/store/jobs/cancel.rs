//! Cancel: a user no longer wants the job.

use super::JobState;
use super::follow::cancel_followers;
use crate::store::owners::OwnerFilter;
use crate::store::{Error, Store, sql};
use flockreel_core::ids::JobId;

/// Result of [`Store::cancel`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Cancel {
    /// The job was queued. It is cancelled, with all jobs that depend on it.
    Cancelled,
    /// The job is running. Its worker learns of the request at its next heartbeat.
    Requested,
    /// The job had already ended.
    Final(JobState),
    /// No visible job has this id.
    Absent,
}

impl Store {
    /// Cancels a queued job immediately, or asks the worker of a running job to stop.
    pub async fn cancel(
        &self,
        job: JobId,
        owners: &OwnerFilter,
        now_ms: i64,
    ) -> Result<Cancel, Error> {
        let cancel = || async {
            let mut transaction = self.writer.begin().await?;
            let sql =
                "select state from jobs where id = $1 and ($2 is null or owner = $2) for update";
            let state: Option<String> = sql::query_scalar(sql)
                .bind(job.0)
                .bind(owners.parameter())
                .fetch_optional(&mut transaction)
                .await?;
            let Some(state) = state else {
                return Ok(Cancel::Absent);
            };
            let met = match JobState::try_from(state)? {
                JobState::Queued => {
                    let sql = "update jobs set state = 'cancelled', finished_ms = $2 where id = $1";
                    let update = sql::query(sql).bind(job.0).bind(now_ms);
                    update.execute(&mut transaction).await?;
                    cancel_followers(&mut transaction, job.0, now_ms).await?;
                    Cancel::Cancelled
                }
                JobState::Running => {
                    let update =
                        sql::query("update jobs set cancel_requested = true where id = $1");
                    update.bind(job.0).execute(&mut transaction).await?;
                    Cancel::Requested
                }
                ended => Cancel::Final(ended),
            };
            transaction.commit().await?;
            tracing::info!(job.id = %job, ?met, "job cancellation requested");
            Ok(met)
        };
        self.reserve.lend(cancel).await
    }
}
