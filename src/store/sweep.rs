//! Removes what a crash left behind: drafts, and folders that no row names (RELIABILITY.md, store
//! rules and R5).

use std::time::{Duration, SystemTime};

use super::{Error, Store};

/// A folder without a row is younger than this while its row is being made.
const GRACE: Duration = Duration::from_secs(3600);

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
        for (folder, modified) in self.folders_without_row().await? {
            if now.duration_since(modified).is_ok_and(|age| age > GRACE) {
                self.blobs.discard(&folder).await?;
                swept.n_folders += 1;
            }
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

    /// The folders in place that no row names, each with the time of its youngest file.
    pub(super) async fn folders_without_row(&self) -> Result<Vec<(String, SystemTime)>, Error> {
        let mut strays = Vec::new();
        for (folder, modified) in self.blobs.folders().await? {
            if !self.is_folder_known(&folder).await? {
                strays.push((folder, modified));
            }
        }
        Ok(strays)
    }
}
