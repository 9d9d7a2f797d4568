//! The table of libraries: one row per finished analysis.

use sqlx::types::Uuid;

use super::owners::Reach;
use super::{Error, Store};

/// One stored library. Its files are in `folder`.
#[derive(Clone, Debug, PartialEq, sqlx::FromRow)]
pub struct Library {
    /// Id of the library.
    pub id: Uuid,
    /// The job that made it.
    pub job_id: Uuid,
    /// The footage that was analyzed.
    pub footage_id: Uuid,
    /// Folder in the blob store.
    pub folder: String,
    /// Label of the footage.
    pub name: String,
    /// Parameters of the analysis, JSON.
    pub params: String,
    /// Summary for overviews, JSON.
    pub summary: String,
    /// Whether the footage is the sample made by the program.
    pub sample: bool,
    /// Total size of the files, bytes.
    pub size_bytes: i64,
    /// Time at which the analysis finished, milliseconds since 1970.
    pub created_ms: i64,
}

impl Store {
    /// Returns the library if it exists and is visible to the caller.
    pub async fn library(&self, id: Uuid, reach: &Reach) -> Result<Option<Library>, Error> {
        let sql = "select l.id, l.job_id, footage_id, l.folder, params, summary, f.name, sample, \
                   l.size_bytes, l.created_ms \
                   from libraries l join footage f on f.id = footage_id where l.id = $1 \
                   and ($2 is null or l.owner = $2)";
        self.one_of(sql, id, reach).await
    }

    /// Returns the newest libraries with ids less than `before`, at most `limit`.
    pub async fn list_libraries(
        &self,
        limit: i64,
        before: Option<Uuid>,
        reach: &Reach,
    ) -> Result<Vec<Library>, Error> {
        let sql = "select l.id, l.job_id, footage_id, l.folder, params, summary, f.name, sample, \
                   l.size_bytes, l.created_ms \
                   from libraries l join footage f on f.id = footage_id \
                   where ($1 is null or l.id < $1) and ($3 is null or l.owner = $3) \
                   order by l.id desc limit $2";
        self.newest_of(sql, limit, before, reach).await
    }
}

/// Insert statement for a finished analysis. The parameters are the same for every kind of result
/// (`jobs/finish`).
pub(super) const INSERT: &str = "insert into libraries (id, job_id, fence, footage_id, folder, params, \
    summary, size_bytes, created_ms, owner) values ($1, $2, $3, $4, $5, $6, $7, $8, $9, \
    (select owner from jobs where id = $2))";
