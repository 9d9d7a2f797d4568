//! Verification of the store's invariants I1 to I6 (docs/explanation/promises.md). `flockreel check` runs it,
//! and so does every test that injects a fault.

use std::fs;
use std::time::{Duration, SystemTime};

use sqlx::types::Uuid;

use super::upkeep::sweep::GRACE;
use super::{BlobFile, Error, Store, sql};

/// One violation. The sentence names the row or file.
pub type Fault = String;

impl Store {
    /// Returns all violations of an idle store; an intact store has none. Reads and hashes every file.
    pub async fn check(&self, now_ms: i64) -> Result<Vec<Fault>, Error> {
        self.check_with_grace(Duration::ZERO, now_ms).await
    }

    /// Returns all violations of a store that is in use or was interrupted by a crash. A folder without a row
    /// counts only after an hour, because its row may still follow.
    pub async fn check_after_crash(&self, now_ms: i64) -> Result<Vec<Fault>, Error> {
        self.check_with_grace(GRACE, now_ms).await
    }

    /// Folders without a row count as violations from the age `grace`.
    async fn check_with_grace(&self, grace: Duration, now_ms: i64) -> Result<Vec<Fault>, Error> {
        let mut faults = self.broken_rows().await?;
        faults.extend(self.missing_or_altered_blobs().await?);
        faults.extend(self.short_uploads().await?);
        for folder in self.folders_without_row().await? {
            let age = SystemTime::now().duration_since(folder.modified);
            if age.is_ok_and(|age| age >= grace) {
                faults.push(format!("I2: the folder has no row: {}", folder.name));
            }
        }
        for &(name, sql) in JOB_RULES {
            let broken = sql::query_scalar(sql).bind(now_ms);
            let jobs: Vec<Uuid> = broken.fetch_all(&self.reader).await?;
            faults.extend(jobs.into_iter().map(|job| format!("{name}: {job}")));
        }
        let broken = sql::query_scalar(WRONG_SIZES);
        let folders: Vec<String> = broken.fetch_all(&self.reader).await?;
        let said =
            |folder| format!("I6: the recorded size differs from the sum of the files: {folder}");
        faults.extend(folders.into_iter().map(said));
        Ok(faults)
    }

    /// Checks I3: the database is intact, and every reference points to an existing row.
    async fn broken_rows(&self) -> Result<Vec<Fault>, Error> {
        if !self.reader.is_file() {
            // A database server verifies itself.
            return Ok(Vec::new());
        }
        let sql = "select * from pragma_integrity_check";
        let said: Vec<String> = sql::query_scalar(sql).fetch_all(&self.reader).await?;
        let sql = "select distinct \"table\" from pragma_foreign_key_check";
        let lost: Vec<String> = sql::query_scalar(sql).fetch_all(&self.reader).await?;
        let broken = said.into_iter().filter(|line| line != "ok");
        let broken = broken.map(|line| format!("I3: the database is damaged: {line}"));
        let lost = lost.into_iter();
        let lost =
            lost.map(|table| format!("I3: references to missing rows in the table: {table}"));
        Ok(broken.chain(lost).collect())
    }

    /// Checks I1 for unfinished uploads: the file holds all bytes that were confirmed to the sender, or the parts
    /// in the bucket do. Skipped for files beside a shared database, which may be on other machines.
    async fn short_uploads(&self) -> Result<Vec<Fault>, Error> {
        if self.blobs.are_in_bucket() {
            let differing = sql::query_scalar(WRONG_OFFSETS).fetch_all(&self.reader);
            let uploads: Vec<Uuid> = differing.await?;
            let said = |id| {
                format!("I1: the recorded offset differs from the sum of the parts: uploads/{id}")
            };
            return Ok(uploads.into_iter().map(said).collect());
        }
        if !self.reader.is_file() {
            return Ok(Vec::new());
        }
        let sql = "select id, offset_bytes from uploads where footage_id is null order by id";
        let rows: Vec<(Uuid, i64)> = sql::query(sql).fetch_all(&self.reader).await?;
        let rows = rows.into_iter().filter(|(id, offset_bytes)| {
            let file = fs::metadata(self.upload_path(*id));
            file.map_or(0, |file| file.len()) < offset_bytes.unsigned_abs()
        });
        Ok(rows
            .map(|(id, _)| {
                format!("I1: the upload file is shorter than its recorded offset: uploads/{id}")
            })
            .collect())
    }

    /// Checks I1: each row's file exists and has the recorded size and hash.
    async fn missing_or_altered_blobs(&self) -> Result<Vec<Fault>, Error> {
        let sql = "select folder, name, size_bytes, sha256 from blobs order by folder, name";
        let rows: Vec<(String, String, i64, Vec<u8>)> =
            sql::query(sql).fetch_all(&self.reader).await?;
        let mut faults = Vec::new();
        for (folder, name, size_bytes, sha256) in rows {
            let file = BlobFile {
                name,
                size_bytes,
                sha256,
            };
            let fault = match self.blobs.is_intact(&file, &folder).await {
                Ok(true) => continue,
                Ok(false) => format!("I1: altered: {folder}/{}", file.name),
                Err(error) => format!("I1: {error}: {folder}/{}", file.name),
            };
            // Another process may have deleted it, or made footage of an upload and removed its parts.
            if self.blob(&folder, &file.name).await?.is_some() {
                faults.push(fault);
            }
        }
        Ok(faults)
    }
}

/// Queries that return the job of each row that violates a rule. $1 is the time, milliseconds since 1970.
/// Constraints of the table ensure that every job is in a legal state (I3).
const JOB_RULES: &[(&str, &str)] = &[
    (
        "I4: a done job must have exactly one result with its fence, and any other job none",
        "select j.id from jobs j where $1 is not null and (case when j.state = 'done' then 1 else 0 end) != ( \
         (select count(*) from footage r where r.job_id = j.id and r.fence = j.fence) \
         + (select count(*) from libraries r where r.job_id = j.id and r.fence = j.fence) \
         + (select count(*) from views r where r.job_id = j.id and r.fence = j.fence) \
         + (select count(*) from flocks r where r.job_id = j.id and r.fence = j.fence) \
         + (select count(*) from fish r where r.job_id = j.id and r.fence = j.fence) \
         + (select count(*) from datasets r where r.job_id = j.id and r.fence = j.fence))",
    ),
    (
        "I5: a lease ended more than a minute ago",
        "select id from jobs where state = 'running' and lease_until_ms < $1 - 60000",
    ),
];

/// Query for I6: folders whose recorded size differs from the sum of their files' sizes.
const WRONG_SIZES: &str = "select r.folder from ( \
         select folder, size_bytes from footage union all \
         select folder, size_bytes from libraries union all \
         select folder, size_bytes from views union all \
         select folder, size_bytes from flocks union all \
         select folder, size_bytes from fish union all \
         select folder, size_bytes from datasets union all \
         select folder, size_bytes from job_parts) r \
         where r.size_bytes != ( \
         select coalesce(sum(b.size_bytes), -1) from blobs b where b.folder = r.folder)";

/// Query for I1: unfinished uploads whose offset differs from the sum of their parts' sizes.
const WRONG_OFFSETS: &str = "select id from uploads u where footage_id is null and offset_bytes != ( \
         select coalesce(sum(b.size_bytes), 0) from blobs b where b.folder = 'uploads/' || lower(hex(u.id)))";

#[cfg(test)]
mod tests {
    use std::io::Write;

    use super::*;
    use crate::store::blobs;

    #[tokio::test]
    async fn bytes_appended_to_a_stored_file_are_reported() {
        let data = tempfile::tempdir().unwrap();
        let store = Store::open(data.path()).await.unwrap();
        let draft = store.blobs().draft("film").unwrap();
        fs::write(draft.path().join("video"), b"12345").unwrap();
        let files = store.blobs().seal(&draft).unwrap();
        store.blobs().adopt(draft, "footage/a").await.unwrap();
        let mut transaction = store.begin().await.unwrap();
        let added = blobs::insert(&mut transaction, "footage/a", &files);
        added.await.unwrap();
        transaction.commit().await.unwrap();
        assert_eq!(store.check(0).await.unwrap(), Vec::<Fault>::new());
        let path = data.path().join("blobs/footage/a/video");
        let mut file = fs::File::options().append(true).open(path).unwrap();
        file.write_all(b"6").unwrap();
        let faults = store.check(0).await.unwrap();
        assert_eq!(faults, ["I1: altered: footage/a/video"]);
    }
}
