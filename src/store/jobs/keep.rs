//! Keep: stores a finished part of a running job, so that a later attempt need not make it again
//! (docs/explanation/promises.md, "No job is lost"). A part is a stored folder. Its rows appear in one transaction that
//! checks the fence, as those of a result do.

use sqlx::types::Uuid;

use super::finish::owner_of;
use super::{Change, Lease};
use crate::store::{BlobFile, Error, Store, blobs, sql};

/// A part that a job has kept.
#[derive(Clone, Debug, PartialEq, Eq, sqlx::FromRow)]
pub struct KeptPart {
    /// Number of the part in its job.
    pub number: i64,
    /// Folder in the blob store.
    pub folder: String,
}

impl Store {
    /// Links a stored folder as a part of the job if the fence is still valid, and forgets the crashes of earlier attempts,
    /// because the job has advanced. A part that the job already has with this number is replaced.
    ///
    /// [`Change::Lost`] means that the caller must discard the folder. Fails with [`Error::OwnerStorageFull`] if the owner
    /// of the job has no space for the files.
    pub async fn keep(
        &self,
        lease: &Lease,
        part: &KeptPart,
        files: &[BlobFile],
    ) -> Result<Change, Error> {
        let keep = || async {
            let mut transaction = self.writer.begin().await?;
            let sql = "update jobs set own_crashes = 0, lone_crashes = 0, transient_ends = 0 \
                       where id = $1 and fence = $2 and state = 'running'";
            let advance = sql::query(sql).bind(lease.job_id.0).bind(lease.fence);
            let change = Change::from_rows(advance.execute(&mut transaction).await?);
            if change == Change::Lost {
                return Ok(change);
            }
            let owner = owner_of(&mut transaction, lease).await?;
            let n_bytes: i64 = files.iter().map(|file| file.size_bytes).sum();
            self.require_owner_space(&mut transaction, &owner, n_bytes, None)
                .await?;
            // The sweep removes the folder of a replaced part.
            for sql in [
                "delete from blobs where folder in (select folder from job_parts where job_id = $1 and number = $2)",
                "delete from job_parts where job_id = $1 and number = $2",
            ] {
                let delete = sql::query(sql).bind(lease.job_id.0).bind(part.number);
                delete.execute(&mut transaction).await?;
            }
            blobs::insert(&mut transaction, &part.folder, files).await?;
            let sql = "insert into job_parts (job_id, number, folder, size_bytes, owner) \
                       values ($1, $2, $3, $4, $5)";
            let insert = sql::query(sql).bind(lease.job_id.0).bind(part.number);
            let insert = insert.bind(&part.folder).bind(n_bytes).bind(&owner);
            insert.execute(&mut transaction).await?;
            transaction.commit().await?;
            tracing::info!(job.id = %lease.job_id, fence = lease.fence, part = part.number, "part of a job kept");
            Ok(change)
        };
        self.reserve.lend(keep).await
    }

    /// Returns the parts that a job has kept, in the order of their numbers.
    pub async fn kept_parts(&self, job: Uuid) -> Result<Vec<KeptPart>, Error> {
        let sql = "select number, folder from job_parts where job_id = $1 order by number";
        let parts = sql::query(sql).bind(job);
        Ok(parts.fetch_all(&self.reader).await?)
    }

    /// Returns a file of each part that a job has kept, with the folder of the part, in the order of the parts.
    pub async fn files_of_parts(
        &self,
        job: Uuid,
        name: &str,
    ) -> Result<Vec<(String, BlobFile)>, Error> {
        let sql = "select p.folder, b.name, b.size_bytes, b.sha256 from job_parts p \
                   join blobs b on b.folder = p.folder where p.job_id = $1 and b.name = $2 order by p.number";
        let files = sql::query(sql).bind(job).bind(name);
        let rows: Vec<(String, String, i64, Vec<u8>)> = files.fetch_all(&self.reader).await?;
        let file = |(folder, name, size_bytes, sha256)| {
            let file = BlobFile {
                name,
                size_bytes,
                sha256,
            };
            (folder, file)
        };
        Ok(rows.into_iter().map(file).collect())
    }
}
