//! The invariants of the store, verified (RELIABILITY.md, store rules, I1 to I6). Run after every
//! test that breaks something on purpose, and by `flockreel check`.

use std::fs;
use std::time::{Duration, SystemTime};

use sqlx::types::Uuid;

use super::sweep::GRACE;
use super::{Error, Store, blobs};

/// One thing that is wrong, in words that name the row or file.
pub type Fault = String;

impl Store {
    /// Every fault found where nothing was broken; none is what is promised. Reads and hashes every file.
    pub async fn check(&self, now_ms: i64) -> Result<Vec<Fault>, Error> {
        self.check_strays_from(Duration::ZERO, now_ms).await
    }

    /// The same where something may have been broken off, or is under way: a folder whose row is not there
    /// (yet) is no fault for an hour.
    pub async fn check_after_crash(&self, now_ms: i64) -> Result<Vec<Fault>, Error> {
        self.check_strays_from(GRACE, now_ms).await
    }

    async fn check_strays_from(&self, age: Duration, now_ms: i64) -> Result<Vec<Fault>, Error> {
        let mut faults = self.broken_rows().await?;
        faults.extend(self.missing_or_altered_blobs().await?);
        faults.extend(self.short_uploads().await?);
        for folder in self.folders_without_row().await? {
            let modified = fs::metadata(self.blobs.folder(&folder))?.modified()?;
            let is_old = SystemTime::now().duration_since(modified);
            if is_old.is_ok_and(|found| found >= age) {
                faults.push(format!("I2: no row names the folder: {folder}"));
            }
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

    /// I3: the database itself is whole, and its rows refer to rows that are there.
    async fn broken_rows(&self) -> Result<Vec<Fault>, Error> {
        let said: Vec<String> = sqlx::query_scalar("select * from pragma_integrity_check")
            .fetch_all(&self.reader)
            .await?;
        let sql = "select distinct \"table\" from pragma_foreign_key_check";
        let lost: Vec<String> = sqlx::query_scalar(sql).fetch_all(&self.reader).await?;
        let broken = said.into_iter().filter(|line| line != "ok");
        let broken = broken.map(|line| format!("I3: the database is broken: {line}"));
        let lost = lost.into_iter();
        let lost = lost.map(|table| format!("I3: rows refer to rows that are not there: {table}"));
        Ok(broken.chain(lost).collect())
    }

    /// I1: of an upload under way all bytes are there that its sender was told are safe.
    async fn short_uploads(&self) -> Result<Vec<Fault>, Error> {
        let sql = "select id, offset_bytes from uploads where footage_id is null order by id";
        let rows: Vec<(Uuid, i64)> = sqlx::query_as(sql).fetch_all(&self.reader).await?;
        let rows = rows.into_iter().filter(|(id, offset_bytes)| {
            let file = fs::metadata(self.upload_path(*id));
            file.map_or(0, |file| file.len()) < offset_bytes.unsigned_abs()
        });
        Ok(rows
            .map(|(id, _)| format!("I1: too short: uploads/{id}"))
            .collect())
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
/// That a job has one legal state (I3) is held by the table's own constraints.
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
