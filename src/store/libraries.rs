//! The table of libraries: what each finished analysis left.

use sqlx::types::Uuid;

use super::owners::Reach;
use super::{Error, Store};

/// One library as stored; its files lie in `folder`.
#[derive(Clone, Debug, PartialEq, sqlx::FromRow)]
pub struct Library {
    /// Its id.
    pub id: Uuid,
    /// The job that made it.
    pub job_id: Uuid,
    /// The footage it was measured in.
    pub footage_id: Uuid,
    /// Its folder in the blob store.
    pub folder: String,
    /// What the footage is called.
    pub name: String,
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
    /// One library, if it is finished, there and within reach.
    pub async fn library(&self, id: Uuid, reach: &Reach) -> Result<Option<Library>, Error> {
        let sql = "select l.id, l.job_id, footage_id, l.folder, params, summary, f.name, sample, \
                   l.size_bytes, l.created_ms \
                   from libraries l join footage f on f.id = footage_id where l.id = $1 \
                   and ($2 is null or l.owner = $2)";
        self.one_of(sql, id, reach).await
    }

    /// The newest libraries, at most `limit`, older than `before`.
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

/// What a finished analysis adds; the parameters are those of every result (`jobs/finish`).
pub(super) const INSERT: &str = "insert into libraries (id, job_id, fence, footage_id, folder, params, \
    summary, size_bytes, created_ms, owner) values ($1, $2, $3, $4, $5, $6, $7, $8, $9, \
    (select owner from jobs where id = $2))";
