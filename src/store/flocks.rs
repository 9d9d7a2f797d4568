//! The table of flocks: one row per finished flock job. Virtual fish have the same columns in a table of
//! their own.

use sqlx::types::Uuid;

use super::owners::Reach;
use super::{Error, Store};

/// One stored flock or virtual fish. Its files are in `folder`.
#[derive(Clone, Debug, PartialEq, sqlx::FromRow)]
pub struct Film {
    /// Id of the flock or fish.
    pub id: Uuid,
    /// The job that made it.
    pub job_id: Uuid,
    /// The library that it was made from.
    pub library_id: Uuid,
    /// Folder in the blob store.
    pub folder: String,
    /// Parameters of the job, JSON.
    pub params: String,
    /// Summary for overviews, JSON.
    pub summary: String,
    /// Whether it derives from the sample made by the program.
    pub sample: bool,
    /// Total size of the files, bytes.
    pub size_bytes: i64,
    /// Time at which the job finished, milliseconds since 1970.
    pub created_ms: i64,
}

impl Store {
    /// Returns the flock if it exists and is visible to the caller.
    pub async fn flock(&self, id: Uuid, reach: &Reach) -> Result<Option<Film>, Error> {
        let sql = "select r.id, r.job_id, library_id, r.folder, r.params, r.summary, sample, \
                   r.size_bytes, r.created_ms \
                   from flocks r join libraries l on l.id = library_id \
                   join footage f on f.id = footage_id where r.id = $1 \
                   and ($2 is null or r.owner = $2)";
        self.one_of(sql, id, reach).await
    }

    /// Returns the newest flocks with ids less than `before`, at most `limit`.
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

/// Insert statement for a finished job. The parameters are the same for every kind of result (`jobs/finish`).
pub(super) const INSERT: &str = "insert into flocks (id, job_id, fence, library_id, folder, params, summary, \
    size_bytes, created_ms, owner) values ($1, $2, $3, $4, $5, $6, $7, $8, $9, \
    (select owner from jobs where id = $2))";
