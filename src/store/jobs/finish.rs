//! Finish: the job is done. The same transaction links its single result
//! (docs/explanation/promises.md, "No job is lost" and "Stalled workers cannot overwrite"), and queues the job that
//! makes the views of a new library.

use sqlx::types::Uuid;

use super::enqueue::enqueue_views;
use super::{Change, Kind, Lease};
use crate::store::footage::{self, SampleFootage};
use crate::store::owners::Owner;
use crate::store::resources::ResourceKind;
use crate::store::{BlobFile, Error, Store, Transaction, blobs, sql};

/// Output of a finished job: files that are already stored, and the values of the result's row.
#[derive(Clone, Debug)]
pub struct Outcome {
    /// Input of the job.
    pub source: Source,
    /// Folder in the blob store.
    pub folder: String,
    /// Files in the folder.
    pub files: Vec<BlobFile>,
    /// All parameters, JSON; not stored for a sample.
    pub params: String,
    /// Summary for overviews, JSON; not stored for a sample.
    pub summary: String,
}

/// Input from which a job made its result.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Source {
    /// None: a sample job made this footage.
    Sample(SampleFootage),
    /// Footage or library with this id.
    Resource(Uuid),
}

impl Store {
    /// Links the result and ends the job if the fence is still valid. [`Change::Lost`] means that the caller
    /// must discard its output. A pending cancel request is ignored. Fails with [`Error::OwnerStorageFull`] if the
    /// owner of the job has no space for the files.
    pub async fn finish(
        &self,
        lease: &Lease,
        outcome: &Outcome,
        now_ms: i64,
    ) -> Result<Change, Error> {
        let finish = || async {
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
            if Change::from_rows(n_rows) == Change::Lost {
                tracing::warn!(job.id = %lease.job_id, fence = lease.fence, "job result discarded: its lease was lost");
                return Ok(Change::Lost);
            }
            let owner = owner_of(&mut transaction, lease).await?;
            self.require_owner_space(&mut transaction, &owner, outcome.size_bytes(), None)
                .await?;
            blobs::insert(&mut transaction, &outcome.folder, &outcome.files).await?;
            insert(&mut transaction, lease, outcome, now_ms).await?;
            if lease.kind == Kind::Analysis {
                enqueue_views(&mut transaction, lease, now_ms).await?;
            }
            transaction.commit().await?;
            tracing::info!(job.id = %lease.job_id, fence = lease.fence, "job done");
            Ok(Change::Made)
        };
        self.reserve.lend(finish).await
    }
}

impl Outcome {
    /// Returns the total size of the files, bytes.
    pub fn size_bytes(&self) -> i64 {
        self.files.iter().map(|file| file.size_bytes).sum()
    }
}

pub(super) async fn owner_of(
    transaction: &mut Transaction,
    lease: &Lease,
) -> Result<Owner, sqlx::Error> {
    let owner = sql::query_scalar("select owner from jobs where id = $1").bind(lease.job_id.0);
    Ok(Owner(owner.fetch_one(transaction).await?))
}

/// Adds the row of the result. Its owner is the owner of the job.
async fn insert(
    transaction: &mut Transaction,
    lease: &Lease,
    outcome: &Outcome,
    now_ms: i64,
) -> Result<(), Error> {
    let source_id = match &outcome.source {
        Source::Resource(id) => *id,
        Source::Sample(sample) => {
            return footage::insert_sample(transaction, lease, outcome, sample, now_ms).await;
        }
    };
    let kind = lease.kind.result_kind();
    let source_column = match kind {
        ResourceKind::Library => "footage_id",
        _ => "library_id",
    };
    sql::query(format!(
        "insert into {} (id, job_id, fence, {source_column}, folder, params, summary, size_bytes, \
         created_ms, used_ms, owner) values ($1, $2, $3, $4, $5, $6, $7, $8, $9, $9, \
         (select owner from jobs where id = $2))",
        kind.plural()
    ))
    .bind(lease.result_id)
    .bind(lease.job_id.0)
    .bind(lease.fence)
    .bind(source_id)
    .bind(&outcome.folder)
    .bind(&outcome.params)
    .bind(&outcome.summary)
    .bind(outcome.size_bytes())
    .bind(now_ms)
    .execute(transaction)
    .await?;
    Ok(())
}
