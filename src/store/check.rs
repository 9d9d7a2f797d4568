//! The invariants of the store, verified (RELIABILITY.md, store rules, I1 to I6). Run after every
//! test that breaks something on purpose.

use super::{Error, Store, blobs};

/// One thing that is wrong, in words that name the row or file.
pub type Fault = String;

impl Store {
    /// Every fault found; none is what is promised. Reads and hashes every file.
    pub async fn check(&self, now_ms: i64) -> Result<Vec<Fault>, Error> {
        let mut faults = self.missing_or_altered_blobs().await?;
        for folder in self.folders_without_row().await? {
            faults.push(format!("I2: no row names the folder: {folder}"));
        }
        for (name, sql) in RULES {
            let found: Vec<String> = sqlx::query_scalar(*sql)
                .bind(now_ms)
                .fetch_all(&self.reader)
                .await?;
            faults.extend(found.into_iter().map(|row| format!("{name}: {row}")));
        }
        Ok(faults)
    }

    /// I1: each row's file exists, with its size and hash.
    async fn missing_or_altered_blobs(&self) -> Result<Vec<Fault>, Error> {
        let sql = "select folder, name, size_bytes, sha256 from blobs order by folder, name";
        let rows: Vec<(String, String, i64, Vec<u8>)> =
            sqlx::query_as(sql).fetch_all(&self.reader).await?;
        let mut faults = Vec::new();
        for (folder, name, size_bytes, sha256) in rows {
            match blobs::hash_file(&self.blobs.path(&folder, &name)) {
                Ok(found) if found == (size_bytes, sha256) => {}
                Ok(_) => faults.push(format!("I1: altered: {folder}/{name}")),
                Err(error) => faults.push(format!("I1: {error}: {folder}/{name}")),
            }
        }
        Ok(faults)
    }
}

/// Queries that return one line for each row that breaks a rule; $1 is the time.
/// I3 (one legal state) is held by the table's own constraints.
const RULES: &[(&str, &str)] = &[
    (
        "I4: done without exactly one result of its fence, or a result without done",
        "select hex(j.id) from jobs j where $1 is not null and (j.state = 'done') != ( \
         (select count(*) from libraries r where r.job_id = j.id and r.fence = j.fence) \
         + (select count(*) from flocks r where r.job_id = j.id and r.fence = j.fence) \
         + (select count(*) from fish r where r.job_id = j.id and r.fence = j.fence))",
    ),
    (
        "I5: a lease ended more than a minute ago",
        "select hex(id) from jobs where state = 'running' and lease_until_ms < $1 - 60000",
    ),
    (
        "I6: sizes do not add up",
        "select r.folder from ( \
         select folder, size_bytes from footage union all \
         select folder, size_bytes from libraries union all \
         select folder, size_bytes from flocks union all \
         select folder, size_bytes from fish) r \
         where $1 is not null and r.size_bytes != ( \
         select coalesce(sum(b.size_bytes), -1) from blobs b where b.folder = r.folder)",
    ),
];
