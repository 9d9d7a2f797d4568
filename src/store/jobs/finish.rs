//! Finish: the job is done. The same transaction links its single result
//! (docs/explanation/promises.md, "No job is lost" and "Stalled workers cannot overwrite").

use sqlx::types::Uuid;

use super::{Change, Lease};
use crate::store::footage::{self, Filmed};
use crate::store::{BlobFile, Error, Store, Transaction, blobs, fish, flocks, libraries, sql};

/// Output of a finished job: files that are already stored, and the values of the result's row.
#[derive(Clone, Debug)]
pub struct Outcome {
    /// Kind of the result, and its source.
    pub made: Made,
    /// Folder in the blob store.
    pub folder: String,
    /// Files in the folder.
    pub files: Vec<BlobFile>,
    /// All parameters, JSON; not stored for a sample.
    pub params: String,
    /// Summary for overviews, JSON; not stored for a sample.
    pub summary: String,
}

/// Kind of a result, with the id of the footage or library that it was made from.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Made {
    /// The sample footage; made from nothing.
    Sample(Filmed),
    /// A library made from this footage.
    Library(Uuid),
    /// A flock made from this library.
    Flock(Uuid),
    /// A virtual fish made from this library.
    Fish(Uuid),
}

impl Store {
    /// Links the result and ends the job if the fence is still valid. [`Change::Lost`] means that the caller
    /// must discard its output. A pending cancel request is ignored.
    pub async fn finish(
        &self,
        lease: &Lease,
        outcome: &Outcome,
        now_ms: i64,
    ) -> Result<Change, Error> {
        let finish = || self.finish_now(lease, outcome, now_ms);
        self.reserve.lend(finish).await
    }

    async fn finish_now(
        &self,
        lease: &Lease,
        outcome: &Outcome,
        now_ms: i64,
    ) -> Result<Change, Error> {
        let mut transaction = self.writer.begin().await?;
        let n_rows = sql::query(
            "update jobs set state = 'done', worker = null, lease_until_ms = null, stage = null, \
             progress = 1, finished_ms = $3 where id = $1 and fence = $2 and state = 'running'",
        )
        .bind(lease.job_id.0)
        .bind(lease.fence)
        .bind(now_ms)
        .execute(&mut transaction)
        .await?;
        if Change::of_rows(n_rows) == Change::Lost {
            tracing::warn!(job.id = %lease.job_id, fence = lease.fence, "job result discarded: its lease was lost");
            return Ok(Change::Lost);
        }
        blobs::insert(&mut transaction, &outcome.folder, &outcome.files).await?;
        insert(&mut transaction, lease, outcome, now_ms).await?;
        transaction.commit().await?;
        tracing::info!(job.id = %lease.job_id, fence = lease.fence, "job done");
        Ok(Change::Made)
    }
}

impl Outcome {
    /// Returns the total size of the files, bytes.
    pub fn size_bytes(&self) -> i64 {
        self.files.iter().map(|file| file.size_bytes).sum()
    }
}

/// Adds the row of the result. Its owner is the owner of the job.
async fn insert(
    transaction: &mut Transaction,
    lease: &Lease,
    outcome: &Outcome,
    now_ms: i64,
) -> Result<(), Error> {
    let (sql, made_of) = match outcome.made {
        Made::Sample(filmed) => {
            let film = (&filmed, outcome.folder.as_str(), &outcome.files[..]);
            return footage::insert_filmed(transaction, lease, film, now_ms).await;
        }
        Made::Library(footage_id) => (libraries::INSERT, footage_id),
        Made::Flock(library_id) => (flocks::INSERT, library_id),
        Made::Fish(library_id) => (fish::INSERT, library_id),
    };
    sql::query(sql)
        .bind(lease.result_id)
        .bind(lease.job_id.0)
        .bind(lease.fence)
        .bind(made_of)
        .bind(&outcome.folder)
        .bind(&outcome.params)
        .bind(&outcome.summary)
        .bind(outcome.size_bytes())
        .bind(now_ms)
        .execute(transaction)
        .await?;
    Ok(())
}
