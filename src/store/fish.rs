//! The table of fish: what each finished fish job left.

use sqlx::types::Uuid;

use super::flocks::Film;
use super::owners::Reach;
use super::{Error, Store};

impl Store {
    /// One fish, if it is finished, there and within reach.
    pub async fn fish(&self, id: Uuid, reach: &Reach) -> Result<Option<Film>, Error> {
        let sql = "select r.id, r.job_id, library_id, r.folder, r.params, r.summary, sample, \
                   r.size_bytes, r.created_ms \
                   from fish r join libraries l on l.id = library_id \
                   join footage f on f.id = footage_id where r.id = $1 \
                   and ($2 is null or r.owner = $2)";
        self.one_of(sql, id, reach).await
    }

    /// The newest fish, at most `limit`, older than `before`.
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

/// What a finished job adds; the parameters are those of every result (`jobs/finish`).
pub(super) const INSERT: &str = "insert into fish (id, job_id, fence, library_id, folder, params, summary, \
    size_bytes, created_ms, owner) values ($1, $2, $3, $4, $5, $6, $7, $8, $9, \
    (select owner from jobs where id = $2))";
