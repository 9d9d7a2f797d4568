//! Removal of data that nothing refers to and of data that is too old, counted first, for `flockreel gc`
//! (docs/explanation/promises.md, "No orphans" and "Limited space"). Unfinished work of running processes is kept.

use std::time::SystemTime;

use crate::config::Retention;
use crate::store::idempotency::ANSWER_LIFETIME_MS;
use crate::store::{Error, Store, sql};

/// Amount of removable data.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Waste {
    /// Number of working folders left by processes that have ended.
    pub n_drafts: usize,
    /// Number of folders, older than an hour, that no row names.
    pub n_folders: usize,
    /// Number of expired uploads.
    pub n_uploads: usize,
    /// Number of expired sessions and idempotency keys.
    pub n_rows: usize,
    /// Number of resources that nobody used for `keep_days`.
    pub n_unused: usize,
    /// Number of jobs that failed or were cancelled more than `keep_jobs_days` ago.
    pub n_jobs: usize,
    /// Total size of the files of all of these, bytes.
    pub n_bytes: u64,
}

impl Store {
    /// Counts the removable data. Changes nothing.
    pub async fn waste(
        &self,
        retention: Retention,
        now: SystemTime,
        now_ms: i64,
    ) -> Result<Waste, Error> {
        let mut waste = Waste::default();
        (waste.n_drafts, waste.n_bytes) = self.blobs.drafts().n_abandoned()?;
        for folder in self.old_folders_without_row(now).await? {
            waste.n_folders += 1;
            waste.n_bytes += folder.n_bytes;
        }
        let sql = "select case when footage_id is null then offset_bytes else 0 end from uploads \
                   where expires_ms <= $1";
        let expired = sql::query_scalar(sql).bind(now_ms);
        let expired: Vec<i64> = expired.fetch_all(&self.reader).await?;
        waste.n_uploads = expired.len();
        waste.n_bytes += expired.iter().sum::<i64>().unsigned_abs();
        for (sql, until_ms) in [
            (
                "select count(*) from sessions where expires_ms <= $1",
                now_ms,
            ),
            (
                "select count(*) from idempotency where created_ms <= $1",
                now_ms - ANSWER_LIFETIME_MS,
            ),
        ] {
            let count: i64 = sql::query_scalar(sql)
                .bind(until_ms)
                .fetch_one(&self.reader)
                .await?;
            waste.n_rows += usize::try_from(count).unwrap_or(0);
        }
        let retirable = self.retirable(retention, now_ms).await?;
        waste.n_unused = usize::try_from(retirable.total().n).unwrap_or(0);
        waste.n_jobs = usize::try_from(retirable.n_jobs).unwrap_or(0);
        waste.n_bytes += retirable.total().n_bytes.unsigned_abs();
        Ok(waste)
    }

    /// Removes the data and returns the amounts counted before.
    pub async fn collect_waste(
        &self,
        retention: Retention,
        now: SystemTime,
        now_ms: i64,
    ) -> Result<Waste, Error> {
        let waste = self.waste(retention, now, now_ms).await?;
        self.retire(retention, now_ms).await?;
        self.sweep(now).await?;
        if self.serves() {
            self.sweep_upload_files().await?;
        }
        self.sweep_uploads(now_ms).await?;
        for (sql, until_ms) in [
            ("delete from sessions where expires_ms <= $1", now_ms),
            (
                "delete from idempotency where created_ms <= $1",
                now_ms - ANSWER_LIFETIME_MS,
            ),
        ] {
            let delete = || async {
                let delete = sql::query(sql).bind(until_ms);
                Ok(delete.execute(&self.writer).await?)
            };
            self.reserve.lend(delete).await?;
        }
        Ok(waste)
    }
}

#[cfg(test)]
mod tests {
    use std::fs;
    use std::time::Duration;

    use super::*;
    use crate::store::upkeep::sweep::GRACE;
    use crate::store::{blobs, fresh};

    /// Settings that delete nothing because of its age.
    const KEEP: Retention = Retention {
        keep_days: 0,
        keep_jobs_days: 0,
    };

    #[tokio::test]
    async fn unreferenced_data_is_counted_and_removed() {
        let data = tempfile::tempdir().unwrap();
        let store = Store::open(data.path()).await.unwrap();
        for folder in ["tmp/draft", "blobs/flocks/folder.1"] {
            fs::create_dir_all(data.path().join(folder)).unwrap();
            fs::write(data.path().join(folder).join("video"), b"12345").unwrap();
        }
        let later = SystemTime::now() + 2 * GRACE;
        let now = store.waste(KEEP, SystemTime::now(), 0).await.unwrap();
        assert_eq!(
            (now.n_drafts, now.n_folders),
            (1, 0),
            "a young folder may get its row later"
        );
        let found = store.waste(KEEP, later, 0).await.unwrap();
        assert_eq!((found.n_drafts, found.n_folders, found.n_bytes), (1, 1, 10));
        assert_eq!(store.collect_waste(KEEP, later, 0).await.unwrap(), found);
        assert_eq!(store.waste(KEEP, later, 0).await.unwrap(), Waste::default());
    }

    #[tokio::test]
    async fn old_folders_with_rows_are_kept() {
        let data = tempfile::tempdir().unwrap();
        let store = fresh::open(data.path()).await;
        let draft = store.blobs().draft("film").unwrap();
        fs::write(draft.path().join("video"), b"12345").unwrap();
        let files = store.blobs().seal(&draft).unwrap();
        store.blobs().adopt(draft, "footage/kept").await.unwrap();
        let mut transaction = store.begin().await.unwrap();
        blobs::insert(&mut transaction, "footage/kept", &files)
            .await
            .unwrap();
        transaction.commit().await.unwrap();
        let later = SystemTime::now() + 2 * GRACE;
        let removed = store.collect_waste(KEEP, later, 0).await.unwrap();
        assert_eq!(removed, Waste::default());
        assert_eq!(store.blobs().folders().await.unwrap().len(), 1);
    }

    #[tokio::test]
    async fn drafts_of_a_running_service_are_kept() {
        let data = tempfile::tempdir().unwrap();
        let service = Store::open(data.path()).await.unwrap();
        let draft = service.blobs().draft("under way").unwrap();
        let beside = Store::open_beside(data.path()).await.unwrap();
        let later = SystemTime::now() + GRACE + Duration::from_secs(1);
        assert_eq!(
            beside.collect_waste(KEEP, later, 0).await.unwrap(),
            Waste::default()
        );
        assert!(draft.path().is_dir());
    }
}
