//! Which jobs may have changed since somebody last looked: what a stream of events asks again and again.
//! Both questions meet an index (the state, the id, which begins with the time it was made); the history
//! is read once for each stream that was cut.

use sqlx::types::Uuid;

use super::read::{JobRow, Row, columns};
use crate::store::owners::Reach;
use crate::store::{Error, Store, sql};

/// The most that a stream which was cut is told of what ended meanwhile.
const MAX_ENDED: i64 = 1_000;
/// The most that any stream follows at once: the latest.
const MAX_UNDER_WAY: i64 = 10_000;

impl Store {
    /// The jobs within reach that are queued, running, or were made since, the latest ten thousand, oldest first.
    pub async fn jobs_under_way(&self, since_ms: i64, reach: &Reach) -> Result<Vec<JobRow>, Error> {
        let sql = concat!(
            "select ",
            columns!(),
            " from jobs where (state in ('queued', 'running') or id >= $1) \
             and ($2 is null or owner = $2) order by id desc limit $3"
        );
        let rows: Vec<Row> = sql::query(sql)
            .bind(first_id_of(since_ms))
            .bind(reach.owner())
            .bind(MAX_UNDER_WAY)
            .fetch_all(&self.reader)
            .await?;
        rows.into_iter().rev().map(JobRow::try_from).collect()
    }

    /// Whether anybody has a job that is queued or running.
    pub async fn has_jobs_under_way(&self) -> Result<bool, Error> {
        let sql = "select exists (select 1 from jobs where state in ('queued', 'running'))";
        Ok(sql::query_scalar(sql).fetch_one(&self.reader).await?)
    }

    /// The jobs within reach that ended since, the latest thousand of them.
    pub async fn jobs_ended(&self, since_ms: i64, reach: &Reach) -> Result<Vec<JobRow>, Error> {
        let sql = concat!(
            "select ",
            columns!(),
            " from jobs where finished_ms >= $1 and ($2 is null or owner = $2) \
             order by finished_ms desc limit $3"
        );
        let rows: Vec<Row> = sql::query(sql)
            .bind(since_ms)
            .bind(reach.owner())
            .bind(MAX_ENDED)
            .fetch_all(&self.reader)
            .await?;
        rows.into_iter().map(JobRow::try_from).collect()
    }
}

/// The least id of version 7 that can be made at that time.
fn first_id_of(ms: i64) -> Uuid {
    Uuid::from_u128(u128::from(ms.max(0).unsigned_abs()) << 80)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_id_made_later_is_not_before_the_first_of_its_time() {
        let id = Uuid::now_v7();
        let (seconds, nanos) = id.get_timestamp().unwrap().to_unix();
        let made_ms = seconds as i64 * 1000 + i64::from(nanos) / 1_000_000;
        assert!(first_id_of(made_ms) <= id && id < first_id_of(made_ms + 1));
    }
}
