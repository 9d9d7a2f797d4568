//! The table of flocks: what each finished flock job left. A virtual fish leaves the same, in a table of its own.

use sqlx::types::Uuid;

use super::owners::Reach;
use super::{Error, Store};

/// One flock or virtual fish as stored; its files lie in `folder`.
#[derive(Clone, Debug, PartialEq, sqlx::FromRow)]
pub struct Film {
    /// Its id.
    pub id: Uuid,
    /// The job that made it.
    pub job_id: Uuid,
    /// The library it was made of.
    pub library_id: Uuid,
    /// Its folder in the blob store.
    pub folder: String,
    /// The parameters it was made with, JSON.
    pub params: String,
    /// What is worth knowing at a glance, JSON.
    pub summary: String,
    /// Whether it came of the sample that the program made itself.
    pub sample: bool,
    /// Size of all its files, bytes.
    pub size_bytes: i64,
    /// When it was finished, milliseconds since 1970.
    pub created_ms: i64,
}

impl Store {
    /// One flock, if it is finished, there and within reach.
    pub async fn flock(&self, id: Uuid, reach: &Reach) -> Result<Option<Film>, Error> {
        let sql = "select r.id, r.job_id, library_id, r.folder, r.params, r.summary, sample, \
                   r.size_bytes, r.created_ms \
                   from flocks r join libraries l on l.id = library_id \
                   join footage f on f.id = footage_id where r.id = $1 \
                   and ($2 is null or r.owner = $2)";
        self.one_of(sql, id, reach).await
    }

    /// The newest flocks, at most `limit`, older than `before`.
    pub async fn list_flocks(
        &self,
        limit: i64,
        before: Option<Uuid>,
        reach: &Reach,
    ) -> Result<Vec<Film>, Error> {
        let sql = "select r.id, r.job_id, library_id, r.folder, r.params, r.summary, sample, \
                   r.size_bytes, r.created_ms \
                   from flocks r join libraries l on l.id = library_id \
                   join footage f on f.id = footage_id \
                   where ($1 is null or r.id < $1) and ($3 is null or r.owner = $3) \
                   order by r.id desc limit $2";
        self.newest_of(sql, limit, before, reach).await
    }
}

/// What a finished job adds; the parameters are those of every result (`jobs/finish`).
pub(super) const INSERT: &str = "insert into flocks (id, job_id, fence, library_id, folder, params, summary, \
    size_bytes, created_ms, owner) values ($1, $2, $3, $4, $5, $6, $7, $8, $9, \
    (select owner from jobs where id = $2))";
