//! Removes what a crash left behind: drafts, and folders that no row names (RELIABILITY.md, store
//! rules and R5).

use std::fs;
use std::time::{Duration, SystemTime};

use super::{Error, Store};

/// A folder without a row is younger than this while its row is being made.
pub(super) const GRACE: Duration = Duration::from_secs(3600);

/// What a sweep removed.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Swept {
    /// Drafts under `tmp/`.
    pub n_drafts: usize,
    /// Folders under `blobs/` that no row named.
    pub n_folders: usize,
}

impl Store {
    /// Sweeps at the start of the process: every draft (the store's lock is held, so nobody is
    /// writing one), and every folder that no row names and that is older than an hour.
    pub async fn sweep(&self, now: SystemTime) -> Result<Swept, Error> {
        let mut swept = Swept::default();
        for entry in fs::read_dir(self.blobs.tmp())? {
            let path = entry?.path();
            if path.is_dir() {
                fs::remove_dir_all(path)?;
            } else {
                fs::remove_file(path)?;
            }
            swept.n_drafts += 1;
        }
        self.sweep_upload_files().await?;
        for folder in self.folders_without_row().await? {
            let modified = fs::metadata(self.blobs.folder(&folder))?.modified()?;
            if now.duration_since(modified).is_ok_and(|age| age > GRACE) {
                self.blobs.discard(&folder)?;
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

    /// The folders on disk that no row names, in no special order.
    pub(super) async fn folders_without_row(&self) -> Result<Vec<String>, Error> {
        let mut strays = Vec::new();
        for kind in ["footage", "libraries", "flocks", "fish"] {
            for entry in fs::read_dir(self.blobs.root().join(kind))? {
                let folder = format!("{kind}/{}", entry?.file_name().to_string_lossy());
                if !self.is_folder_known(&folder).await? {
                    strays.push(folder);
                }
            }
        }
        Ok(strays)
    }
}
