//! The table of virtual fish: one row per finished fish job.

use sqlx::types::Uuid;

use super::flocks::Film;
use super::owners::Reach;
use super::{Error, Store};

impl Store {
    /// Returns the virtual fish if it exists and is visible to the caller.
    pub async fn fish(&self, id: Uuid, reach: &Reach) -> Result<Option<Film>, Error> {
        let sql = "select r.id, r.job_id, library_id, r.folder, r.params, r.summary, sample, \
                   r.size_bytes, r.created_ms \
                   from fish r join libraries l on l.id = library_id \
                   join footage f on f.id = footage_id where r.id = $1 \
                   and ($2 is null or r.owner = $2)";
        self.one_of(sql, id, reach).await
    }

    /// Returns the newest virtual fish with ids less than `before`, at most `limit`.
    pub async fn list_fish(
        &self,
        limit: i64,
        before: Option<Uuid>,
        reach: &Reach,
    ) -> Result<Vec<Film>, Error> {
        let sql = "select r.id, r.job_id, library_id, r.folder, r.params, r.summary, sample, \
                   r.size_bytes, r.created_ms \
                   from fish r join libraries l on l.id = library_id \
                   join footage f on f.id = footage_id \
                   where ($1 is null or r.id < $1) and ($3 is null or r.owner = $3) \
                   order by r.id desc limit $2";
        self.newest_of(sql, limit, before, reach).await
    }
}

/// Insert statement for a finished job. The parameters are the same for every kind of result (`jobs/finish`).
pub(super) const INSERT: &str = "insert into fish (id, job_id, fence, library_id, folder, params, summary, \
    size_bytes, created_ms, owner) values ($1, $2, $3, $4, $5, $6, $7, $8, $9, \
    (select owner from jobs where id = $2))";
