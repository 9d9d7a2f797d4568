//! Heartbeat: a running worker renews its lease and reports its progress.

use super::Lease;
use crate::store::{Error, Store, sql};

/// Result of a heartbeat.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Beat {
    /// The lease is renewed.
    Held,
    /// The lease is renewed, but a user wants the job cancelled.
    CancelRequested,
    /// The lease is lost. The worker must discard its output.
    Lost,
}

impl Store {
    /// Renews the lease until `lease_until_ms` and stores stage and progress (0..=1).
    pub async fn heartbeat(
        &self,
        lease: &Lease,
        lease_until_ms: i64,
        stage: &str,
        progress: f64,
    ) -> Result<Beat, Error> {
        let beat = || async {
            let cancel_requested: Option<bool> = sql::query_scalar(
                "update jobs set lease_until_ms = $3, stage = $4, progress = $5 \
                 where id = $1 and fence = $2 and state = 'running' returning cancel_requested",
            )
            .bind(lease.job_id.0)
            .bind(lease.fence)
            .bind(lease_until_ms)
            .bind(stage)
            .bind(progress.clamp(0.0, 1.0))
            .fetch_optional(&self.writer)
            .await?;
            tracing::debug!(job.id = %lease.job_id, stage, progress, "job heartbeat");
            Ok(match cancel_requested {
                Some(false) => Beat::Held,
                Some(true) => Beat::CancelRequested,
                None => Beat::Lost,
            })
        };
        self.reserve.lend(beat).await
    }
}
