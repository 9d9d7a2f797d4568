//! Jobs that may have changed since a given time. Event streams run these queries repeatedly.
//!
//! Both queries use an index: by state, or by id, which begins with the creation time. A stream reads ended
//! jobs only once, when it resumes after an interruption.

use sqlx::types::Uuid;

use super::read::{JobRow, SELECT};
use crate::store::owners::OwnerFilter;
use crate::store::{Error, Store, sql};

/// Maximum number of ended jobs that a resumed stream reports. Free choice.
const MAX_ENDED: i64 = 1_000;
/// Maximum number of jobs that a stream follows; the newest ones. Free choice.
const MAX_UNDER_WAY: i64 = 10_000;

impl Store {
    /// Returns the visible jobs that are queued, running, or were created since `since_ms`. At most the
    /// 10,000 newest, oldest first.
    pub async fn jobs_under_way(
        &self,
        since_ms: i64,
        owners: &OwnerFilter,
    ) -> Result<Vec<JobRow>, Error> {
        let filter = "where (state in ('queued', 'running') or id >= $1) \
                      and ($2 is null or owner = $2) order by id desc limit $3";
        let mut rows: Vec<JobRow> = sql::query(format!("{SELECT} {filter}"))
            .bind(first_id_of(since_ms))
            .bind(owners.parameter())
            .bind(MAX_UNDER_WAY)
            .fetch_all(&self.reader)
            .await?;
        rows.reverse();
        Ok(rows)
    }

    /// Returns whether any owner has a queued or running job.
    pub async fn has_jobs_under_way(&self) -> Result<bool, Error> {
        let sql = "select exists (select 1 from jobs where state in ('queued', 'running'))";
        Ok(sql::query_scalar(sql).fetch_one(&self.reader).await?)
    }

    /// Returns the visible jobs that ended since `since_ms`. At most the 1000 that ended last, latest first.
    pub async fn jobs_ended(
        &self,
        since_ms: i64,
        owners: &OwnerFilter,
    ) -> Result<Vec<JobRow>, Error> {
        let filter = "where finished_ms >= $1 and ($2 is null or owner = $2) \
                      order by finished_ms desc limit $3";
        let rows = sql::query(format!("{SELECT} {filter}"))
            .bind(since_ms)
            .bind(owners.parameter())
            .bind(MAX_ENDED);
        Ok(rows.fetch_all(&self.reader).await?)
    }
}

/// Returns the smallest UUID of version 7 with this creation time (milliseconds since 1970).
fn first_id_of(ms: i64) -> Uuid {
    Uuid::from_u128(u128::from(ms.max(0).unsigned_abs()) << 80)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn first_id_of_a_time_precedes_ids_made_then() {
        let id = Uuid::now_v7();
        let (seconds, nanos) = id.get_timestamp().unwrap().to_unix();
        let made_ms = seconds as i64 * 1000 + i64::from(nanos) / 1_000_000;
        assert!(first_id_of(made_ms) <= id && id < first_id_of(made_ms + 1));
    }
}
