//! Drafts: folders in which a process makes files before they are stored. Every process has a folder of its
//! own and locks it while it lives. Processes that share a disk recognize an unlocked folder as a leftover
//! and remove it (docs/explanation/promises.md, "No orphans").

use std::fs::{self, File};
use std::io;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};

use sqlx::types::Uuid;

use super::local::size_of;

/// The folder in which the processes of a machine keep their drafts.
#[derive(Debug)]
pub(in crate::store) struct Drafts {
    folder: PathBuf,
    /// Folder of this process and its lock; created on first use.
    own: Mutex<Option<(PathBuf, File)>>,
}

/// A temporary folder. Dropping it removes it with its content, unless it was moved to its final place.
#[derive(Debug)]
pub struct Draft {
    path: PathBuf,
    adopted: bool,
}

impl Drafts {
    pub(super) fn open(folder: &Path) -> io::Result<Drafts> {
        fs::create_dir_all(folder)?;
        Ok(Drafts {
            folder: folder.to_owned(),
            own: Mutex::new(None),
        })
    }

    /// Returns the folder that all processes share.
    pub(super) fn folder(&self) -> &Path {
        &self.folder
    }

    pub(super) fn draft(&self, name: &str) -> io::Result<Draft> {
        let mut own = self.own.lock().unwrap_or_else(PoisonError::into_inner);
        let (folder, _lock) = match own.take() {
            Some(own) => own,
            None => create_own_folder(&self.folder)?,
        };
        let path = folder.join(name);
        let made = fs::create_dir(&path);
        *own = Some((folder, _lock));
        made?;
        Ok(Draft {
            path,
            adopted: false,
        })
    }

    /// Removes the folders of processes that have ended. Returns their number.
    pub(in crate::store) fn sweep(&self) -> io::Result<usize> {
        let abandoned = self.abandoned()?;
        for (path, _lock) in &abandoned {
            if path.is_dir() {
                fs::remove_dir_all(path)?;
            } else {
                fs::remove_file(path)?;
            }
        }
        Ok(abandoned.len())
    }

    /// Returns the number of folders of processes that have ended, and their total size in bytes.
    pub(in crate::store) fn n_abandoned(&self) -> io::Result<(usize, u64)> {
        let abandoned = self.abandoned()?;
        let sizes = abandoned.iter().map(|(path, _lock)| size_of(path));
        Ok((abandoned.len(), sizes.sum::<io::Result<u64>>()?))
    }

    /// Returns the folders of processes that have ended, locked by this process.
    fn abandoned(&self) -> io::Result<Vec<(PathBuf, File)>> {
        let mut abandoned = Vec::new();
        for entry in fs::read_dir(&self.folder)? {
            let path = entry?.path();
            if let Ok(folder) = File::open(&path)
                && folder.try_lock().is_ok()
            {
                abandoned.push((path, folder));
            }
        }
        Ok(abandoned)
    }

    /// Removes this process's folder if it is empty.
    pub(in crate::store) fn close(&self) {
        let mut own = self.own.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some((folder, _)) = own.as_ref()
            && fs::remove_dir(folder).is_ok()
        {
            *own = None;
        }
    }
}

/// Creates and locks a folder for this process. Another process may remove the folder before it is locked;
/// then another one is created.
fn create_own_folder(tmp: &Path) -> io::Result<(PathBuf, File)> {
    loop {
        let path = tmp.join(Uuid::now_v7().to_string());
        fs::create_dir(&path)?;
        let Ok(folder) = File::open(&path) else {
            continue;
        };
        folder.lock()?;
        if path.is_dir() {
            return Ok((path, folder));
        }
    }
}

impl Draft {
    /// Returns the path of the draft.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Returns a folder in the draft as a draft of its own.
    pub fn part(&self, name: &str) -> Draft {
        Draft {
            path: self.path.join(name),
            adopted: false,
        }
    }

    /// Moves the draft to its final place. It is then no longer removed on drop.
    pub(super) fn move_to(mut self, place: &Path) -> io::Result<()> {
        fs::rename(&self.path, place)?;
        self.adopted = true;
        Ok(())
    }
}

impl Drop for Draft {
    fn drop(&mut self) {
        if !self.adopted
            && let Err(error) = fs::remove_dir_all(&self.path)
        {
            tracing::warn!(%error, "a draft could not be removed; the next start sweeps it");
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn n_entries(folder: &Path) -> usize {
        fs::read_dir(folder).unwrap().count()
    }

    #[test]
    fn dropped_draft_leaves_nothing_behind() {
        let tmp = tempfile::tempdir().unwrap();
        let drafts = Drafts::open(tmp.path()).unwrap();
        let draft = drafts.draft("x").unwrap();
        fs::write(draft.path().join("video"), b"abc").unwrap();
        drop(draft);
        drafts.close();
        assert_eq!(n_entries(tmp.path()), 0);
    }

    #[test]
    fn sweep_removes_drafts_of_ended_processes_only() {
        let tmp = tempfile::tempdir().unwrap();
        let running = Drafts::open(tmp.path()).unwrap();
        let draft = running.draft("x").unwrap();
        let ended = Drafts::open(tmp.path()).unwrap();
        std::mem::forget(ended.draft("y").unwrap());
        assert_eq!(ended.sweep().unwrap(), 0);
        drop(ended);
        assert_eq!(n_entries(tmp.path()), 2);
        assert_eq!(running.sweep().unwrap(), 1);
        assert!(draft.path().is_dir());
    }
}
