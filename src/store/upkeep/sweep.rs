//! Removes what a crash left behind: drafts, and folders that no row names (RELIABILITY.md, store
//! rules and R5).

use std::time::{Duration, SystemTime};

use crate::store::blobs::Folder;
use crate::store::{Error, Store};

/// A folder without a row is younger than this while its row is being made.
pub(in crate::store) const GRACE: Duration = Duration::from_secs(3600);

/// What a sweep removed.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Swept {
    /// What processes that are gone were making.
    pub n_drafts: usize,
    /// Folders in place that no row named.
    pub n_folders: usize,
}

impl Store {
    /// Sweeps what processes that are gone were making, and every folder that no row names and that is
    /// older than an hour.
    pub async fn sweep(&self, now: SystemTime) -> Result<Swept, Error> {
        let mut swept = Swept {
            n_drafts: self.blobs.work().sweep()?,
            n_folders: 0,
        };
        for folder in self.old_strays(now).await? {
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

    /// The folders that no row has named for an hour.
    pub(in crate::store) async fn old_strays(&self, now: SystemTime) -> Result<Vec<Folder>, Error> {
        let mut strays = self.folders_without_row().await?;
        let is_old = |age: Duration| age > GRACE;
        strays.retain(|stray| now.duration_since(stray.modified).is_ok_and(is_old));
        Ok(strays)
    }

    /// The folders in place that no row names.
    pub(in crate::store) async fn folders_without_row(&self) -> Result<Vec<Folder>, Error> {
        let mut strays = Vec::new();
        for folder in self.blobs.folders().await? {
            if !self.is_folder_known(&folder.name).await? {
                strays.push(folder);
            }
        }
        Ok(strays)
    }
}
