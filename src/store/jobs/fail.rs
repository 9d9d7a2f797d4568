//! Fail and stop: the job ends without a result, because of an error or because a user cancelled it.

use super::follow::{cancel_followers, fail_followers};
use super::{Change, Lease};
use crate::store::{Error, Store, sql};
use flockreel_core::code::Code;

/// Explanation of a failure besides its code and description.
#[derive(Clone, Copy, Debug, Default)]
pub struct Shown<'a> {
    /// Frames that show the reason, JPEG.
    pub picture: Option<&'a [u8]>,
    /// List of changes of the request that may mend it, JSON.
    pub mends: Option<&'a str>,
}

impl Store {
    /// Ends the job as failed, for an error that another attempt would repeat.
    pub async fn fail(
        &self,
        lease: &Lease,
        code: Code,
        detail: &str,
        shown: Shown<'_>,
        now_ms: i64,
    ) -> Result<Change, Error> {
        let fail = || async {
            let mut transaction = self.writer.begin().await?;
            let n_rows = sql::query(
                "update jobs set state = 'failed', worker = null, lease_until_ms = null, stage = null, \
                 code = $3, detail = $4, refused_jpeg = $5, finished_ms = $6, mends = $7 \
                 where id = $1 and fence = $2 and state = 'running'",
            )
            .bind(lease.job_id.0)
            .bind(lease.fence)
            .bind(code.name())
            .bind(detail)
            .bind(shown.picture)
            .bind(now_ms)
            .bind(shown.mends)
            .execute(&mut transaction)
            .await?;
            if Change::from_rows(n_rows) == Change::Made {
                fail_followers(&mut transaction, lease.job_id.0, now_ms).await?;
            }
            transaction.commit().await?;
            tracing::info!(job.id = %lease.job_id, %code, n_rows, "job failed");
            Ok(Change::from_rows(n_rows))
        };
        self.reserve.lend(fail).await
    }

    /// Ends a running job as cancelled, after its worker has stopped the work.
    pub async fn stop(&self, lease: &Lease, now_ms: i64) -> Result<Change, Error> {
        let stop = || async {
            let mut transaction = self.writer.begin().await?;
            let n_rows = sql::query(
                "update jobs set state = 'cancelled', worker = null, lease_until_ms = null, stage = null, \
                 finished_ms = $3 where id = $1 and fence = $2 and state = 'running'",
            )
            .bind(lease.job_id.0)
            .bind(lease.fence)
            .bind(now_ms)
            .execute(&mut transaction)
            .await?;
            if Change::from_rows(n_rows) == Change::Made {
                cancel_followers(&mut transaction, lease.job_id.0, now_ms).await?;
            }
            transaction.commit().await?;
            tracing::info!(job.id = %lease.job_id, n_rows, "job stopped");
            Ok(Change::from_rows(n_rows))
        };
        self.reserve.lend(stop).await
    }
}
