//! Removal of what a crash left behind: unfinished drafts, and folders that no row names
//! (docs/explanation/promises.md, "No orphans").

use std::time::{Duration, SystemTime};

use crate::store::blobs::Folder;
use crate::store::{Error, Store};

/// Minimum age at which a folder without a row is removed. The row of a younger folder may not be committed yet.
/// Free choice.
pub(in crate::store) const GRACE: Duration = Duration::from_secs(3600);

/// Result of a sweep.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Swept {
    /// Number of working folders left by processes that have ended.
    pub n_drafts: usize,
    /// Number of stored folders without a row.
    pub n_folders: usize,
}

impl Store {
    /// Removes unfinished drafts of processes that have ended, and folders older than an hour that no row
    /// names. Returns their numbers.
    pub async fn sweep(&self, now: SystemTime) -> Result<Swept, Error> {
        let mut swept = Swept {
            n_drafts: self.blobs.drafts().sweep()?,
            n_folders: 0,
        };
        for folder in self.old_folders_without_row(now).await? {
            self.blobs.discard(&folder.name).await?;
            swept.n_folders += 1;
        }
        if swept != Swept::default() {
            tracing::warn!(
                swept.n_drafts,
                swept.n_folders,
                "leftovers of a crash swept"
            );
        }
        Ok(swept)
    }

    /// Returns the stored folders without a row that are older than [`GRACE`].
    pub(in crate::store) async fn old_folders_without_row(
        &self,
        now: SystemTime,
    ) -> Result<Vec<Folder>, Error> {
        let mut folders = self.folders_without_row().await?;
        let is_old = |age: Duration| age > GRACE;
        folders.retain(|folder| now.duration_since(folder.modified).is_ok_and(is_old));
        Ok(folders)
    }

    /// Returns the stored folders that no row names.
    pub(in crate::store) async fn folders_without_row(&self) -> Result<Vec<Folder>, Error> {
        let mut folders = Vec::new();
        for folder in self.blobs.folders().await? {
            if !self.is_folder_known(&folder.name).await? {
                folders.push(folder);
            }
        }
        Ok(folders)
    }
}
