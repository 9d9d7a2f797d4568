//! Files in a local folder. A draft is renamed to its final place, and its parent folder is synced, so that
//! the name survives a power loss. Reads use large pieces, because each read is a task on the blocking pool.

use std::fs::{self, File};
use std::io::{self, SeekFrom, Write};
use std::os::unix::fs::PermissionsExt;
use std::path::{Path, PathBuf};

use bytes::Bytes;
use futures_util::StreamExt;
use futures_util::stream::BoxStream;
use rustix::fs::{AtFlags, CWD, Timespec, Timestamps, UTIME_NOW, utimensat};
use tokio::io::{AsyncReadExt, AsyncSeekExt};
use tokio::task::spawn_blocking;
use tokio_util::io::ReaderStream;

use super::{Draft, Folder, MARK};
use crate::store::Error;
use crate::store::resources::ResourceKind;

/// Size of one read, bytes. Free choice.
const READ_BYTES: usize = 1 << 20;

/// The folder, with one subfolder per kind.
#[derive(Clone, Debug)]
pub(super) struct LocalFolder {
    root: PathBuf,
}

impl LocalFolder {
    pub(super) fn open(root: &Path) -> io::Result<LocalFolder> {
        for kind in ResourceKind::ALL.map(ResourceKind::plural) {
            fs::create_dir_all(root.join(kind))?;
        }
        sync_folder(root)?;
        Ok(LocalFolder {
            root: root.to_owned(),
        })
    }

    pub(super) fn folder(&self, folder: &str) -> PathBuf {
        self.root.join(folder)
    }

    pub(super) async fn adopt(&self, draft: Draft, folder: &str) -> Result<(), Error> {
        let (place, root) = (self.folder(folder), self.root.clone());
        let adopt = move || {
            touch(draft.path())?;
            sync_folder(draft.path())?;
            draft.move_to(&place)?;
            sync_folder(place.parent().unwrap_or(&root))
        };
        Ok(spawn_blocking(adopt).await.map_err(io::Error::other)??)
    }

    pub(super) async fn discard(&self, folder: &str) -> Result<(), Error> {
        let place = self.folder(folder);
        let discard = move || match fs::remove_dir_all(place) {
            Err(error) if error.kind() != io::ErrorKind::NotFound => Err(error),
            _ => Ok(()),
        };
        Ok(spawn_blocking(discard).await.map_err(io::Error::other)??)
    }

    pub(super) async fn size_bytes(&self, folder: &str, name: &str) -> io::Result<u64> {
        let file = tokio::fs::metadata(self.folder(folder).join(name));
        Ok(file.await?.len())
    }

    pub(super) async fn read(
        &self,
        folder: &str,
        name: &str,
        first: u64,
        n_bytes: u64,
    ) -> Result<BoxStream<'static, io::Result<Bytes>>, Error> {
        let mut file = tokio::fs::File::open(self.folder(folder).join(name)).await?;
        file.set_max_buf_size(READ_BYTES);
        file.seek(SeekFrom::Start(first)).await?;
        Ok(ReaderStream::with_capacity(file.take(n_bytes), READ_BYTES).boxed())
    }

    /// Returns the mark of these files, if any (`identity`).
    pub(super) fn mark(&self) -> io::Result<Option<String>> {
        match fs::read_to_string(self.root.join(MARK)) {
            Err(error) if error.kind() == io::ErrorKind::NotFound => Ok(None),
            mark => mark.map(|mark| Some(mark.trim().to_owned())),
        }
    }

    /// Marks these files permanently (`identity`).
    pub(super) fn set_mark(&self, mark: &str) -> io::Result<()> {
        // The file gets its name only when it is complete. Another process may write the same mark.
        let mut file = tempfile::Builder::new()
            .permissions(fs::Permissions::from_mode(0o666))
            .tempfile_in(&self.root)?;
        file.write_all(mark.as_bytes())?;
        file.as_file().sync_all()?;
        file.persist(self.root.join(MARK))?;
        sync_folder(&self.root)
    }

    pub(super) fn folders(&self) -> io::Result<Vec<Folder>> {
        let mut folders = Vec::new();
        for kind in ResourceKind::ALL.map(ResourceKind::plural) {
            for entry in fs::read_dir(self.root.join(kind))? {
                let entry = entry?;
                // The folder may be deleted in the meantime.
                let Ok(about) = entry.metadata() else {
                    continue;
                };
                let name = entry.file_name().to_string_lossy().into_owned();
                folders.push(Folder {
                    name: format!("{kind}/{name}"),
                    modified: about.modified()?,
                    n_bytes: size_of(&entry.path())?,
                });
            }
        }
        Ok(folders)
    }
}

/// Sets the modification time of a folder to the present. Otherwise a draft that took long could be swept
/// before its row is committed.
fn touch(path: &Path) -> io::Result<()> {
    let now = Timespec {
        tv_sec: 0,
        tv_nsec: UTIME_NOW,
    };
    let times = Timestamps {
        last_access: now,
        last_modification: now,
    };
    Ok(utimensat(CWD, path, &times, AtFlags::empty())?)
}

/// Returns the size of a file, or of all files below a folder, bytes. A missing file counts as 0.
pub(super) fn size_of(path: &Path) -> io::Result<u64> {
    let about = match fs::symlink_metadata(path) {
        Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(0),
        about => about?,
    };
    if !about.is_dir() {
        return Ok(about.len());
    }
    let mut n_bytes = 0;
    for entry in fs::read_dir(path)? {
        n_bytes += size_of(&entry?.path())?;
    }
    Ok(n_bytes)
}

/// Syncs the folder, so that the names in it survive a power loss.
pub(super) fn sync_folder(path: &Path) -> io::Result<()> {
    File::open(path)?.sync_all()
}

#[cfg(test)]
mod tests {
    use std::time::{Duration, SystemTime};

    use super::*;
    use crate::store::blobs::draft::Drafts;

    #[tokio::test]
    async fn adopted_folder_counts_as_new() {
        let data = tempfile::tempdir().unwrap();
        let drafts = Drafts::open(&data.path().join("tmp")).unwrap();
        let local = LocalFolder::open(&data.path().join("blobs")).unwrap();
        let draft = drafts.draft("x").unwrap();
        let long_ago = SystemTime::UNIX_EPOCH + Duration::from_secs(1);
        let folder = File::open(draft.path()).unwrap();
        folder.set_modified(long_ago).unwrap();
        local.adopt(draft, "flocks/x.1").await.unwrap();
        let folder = local.folders().unwrap().remove(0);
        assert!(folder.modified > long_ago + Duration::from_secs(3600));
    }
}
