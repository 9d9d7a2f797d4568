//! Disk space reserved for the database (docs/explanation/promises.md, "Full disk"): a file beside it. On a
//! full disk the file is removed, so that transactions that remove or end things have space. Transactions
//! that add rows are refused until the file is complete again, so that they cannot use up this space.

use std::fs::{self, File};
use std::io::{self, ErrorKind, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};
use std::sync::Arc;

use rustix::fs::{FallocateFlags, fallocate};
use rustix::io::Errno;
use tokio::sync::Mutex;
use tokio::task::spawn_blocking;

use crate::store::Error;
use flockreel_core::code::Code;

/// Size of the reserve, bytes: twice the size that SQLite's write-ahead log reaches between two checkpoints
/// (1000 pages of 4 KiB). One half is for the log, the other for the pages that it moves into the database.
const RESERVE_BYTES: u64 = 8 << 20;
/// Allocation step for an incomplete reserve, bytes: the block size of most file systems.
const BLOCK_BYTES: u64 = 4096;

/// The reserve of one database. Clones share it.
#[derive(Clone, Debug)]
pub(in crate::store) struct Reserve(Option<Arc<ReserveFile>>);

#[derive(Debug)]
struct ReserveFile {
    path: PathBuf,
    /// Held while the space is released for use, and while the file is made complete.
    lent: Mutex<()>,
}

impl Reserve {
    /// Returns the reserve of a database file. The file is made by the first [`Reserve::require`].
    pub(in crate::store) fn beside(database: &Path) -> Reserve {
        Reserve(Some(Arc::new(ReserveFile {
            path: database.with_extension("reserve"),
            lent: Mutex::new(()),
        })))
    }

    /// Returns the reserve of a database server: none, because the server's disk belongs to another machine.
    pub(in crate::store) fn none() -> Reserve {
        Reserve(None)
    }

    /// Succeeds if the reserve is complete, and completes it if there is space. Fails with
    /// [`ErrorKind::StorageFull`] otherwise.
    pub(in crate::store) async fn require(&self) -> io::Result<()> {
        match &self.0 {
            Some(file) if !file.is_complete() => {
                let _lent = file.lent.lock().await;
                file.complete().await
            }
            _ => Ok(()),
        }
    }

    /// Runs `work`. If it fails because the disk is full, removes the reserve, runs `work` once more and
    /// restores the reserve.
    ///
    /// `work` must leave nothing behind when it fails. Returns the result of the last run.
    pub(in crate::store) async fn lend<T, Run>(&self, work: impl Fn() -> Run) -> Result<T, Error>
    where
        Run: Future<Output = Result<T, Error>>,
    {
        let full = match work().await {
            Err(error) if error.code() == Code::StorageFull => error,
            ended => return ended,
        };
        let Some(file) = &self.0 else {
            return Err(full);
        };
        let _lent = file.lent.lock().await;
        file.remove()?;
        let ended = work().await;
        if let Err(error) = file.complete().await {
            tracing::warn!(%error, "the disk is full: new data is refused until space is free");
        }
        ended
    }
}

impl ReserveFile {
    fn is_complete(&self) -> bool {
        fs::metadata(&self.path).is_ok_and(|file| file.len() >= RESERVE_BYTES)
    }

    fn remove(&self) -> io::Result<()> {
        match fs::remove_file(&self.path) {
            Err(error) if error.kind() == ErrorKind::NotFound => Ok(()),
            removed => removed,
        }
    }

    /// Makes the file complete. If there is too little space, fails, and the file takes the space that there
    /// is.
    async fn complete(&self) -> io::Result<()> {
        if self.is_complete() {
            return Ok(());
        }
        let path = self.path.clone();
        let complete = move || {
            let mut file = File::options();
            let file = file.create(true).truncate(false).write(true).open(path)?;
            allocate(&file, RESERVE_BYTES).inspect_err(|_| {
                // A smaller reserve still serves for a few deletions. Failure is ignored: the first error is
                // reported anyway.
                allocate_rest(&file).ok();
            })
        };
        spawn_blocking(complete).await.map_err(io::Error::other)?
    }
}

/// Allocates the first `n_bytes` of the file. Part of them may be allocated already.
fn allocate(mut file: &File, n_bytes: u64) -> io::Result<()> {
    match fallocate(file, FallocateFlags::empty(), 0, n_bytes) {
        // The file system cannot allocate in advance, so zeros are written.
        Err(Errno::OPNOTSUPP) => {
            let mut n_written = file.seek(SeekFrom::End(0))?;
            while n_written < n_bytes {
                n_written += file.write(&vec![0; BLOCK_BYTES as usize])? as u64;
            }
            file.sync_all()
        }
        allocated => Ok(allocated?),
    }
}

/// Allocates the remaining space of the disk to the file, in whole blocks, up to the size of the reserve.
fn allocate_rest(file: &File) -> io::Result<()> {
    let disk = rustix::fs::fstatvfs(file)?;
    let n_free = disk.f_bavail.saturating_mul(disk.f_frsize);
    let n_bytes = (file.metadata()?.len() + n_free).min(RESERVE_BYTES) / BLOCK_BYTES * BLOCK_BYTES;
    match n_bytes {
        0 => Ok(()),
        _ => allocate(file, n_bytes),
    }
}

#[cfg(test)]
mod tests {
    use std::sync::atomic::{AtomicUsize, Ordering};

    use super::*;

    fn full() -> Error {
        Error::Io(ErrorKind::StorageFull.into())
    }

    #[tokio::test]
    async fn reserve_is_released_for_the_second_run_and_restored() {
        let data = tempfile::tempdir().unwrap();
        let reserve = Reserve::beside(&data.path().join("rows.db"));
        reserve.require().await.unwrap();
        let file = data.path().join("rows.reserve");
        let blocks = || std::os::unix::fs::MetadataExt::blocks(&fs::metadata(&file).unwrap());
        assert!(blocks() * 512 >= RESERVE_BYTES, "{} blocks", blocks());
        let n_runs = AtomicUsize::new(0);
        let work = || async {
            match n_runs.fetch_add(1, Ordering::Relaxed) {
                0 => Err(full()),
                _ => Ok(file.exists()),
            }
        };
        assert!(!reserve.lend(work).await.unwrap(), "the reserve was kept");
        assert_eq!(n_runs.load(Ordering::Relaxed), 2);
        assert!(blocks() * 512 >= RESERVE_BYTES);
    }

    #[tokio::test]
    async fn other_failures_run_once_and_keep_the_reserve() {
        let data = tempfile::tempdir().unwrap();
        let reserve = Reserve::beside(&data.path().join("rows.db"));
        reserve.require().await.unwrap();
        let n_runs = AtomicUsize::new(0);
        let work = || async {
            n_runs.fetch_add(1, Ordering::Relaxed);
            Err::<(), _>(Error::DatabaseOnServer)
        };
        reserve.lend(work).await.unwrap_err();
        assert_eq!(n_runs.load(Ordering::Relaxed), 1);
        assert!(data.path().join("rows.reserve").exists());
    }

    #[tokio::test]
    async fn require_waits_while_the_reserve_is_lent() {
        let data = tempfile::tempdir().unwrap();
        let reserve = Reserve::beside(&data.path().join("rows.db"));
        reserve.require().await.unwrap();
        let was_taken = AtomicUsize::new(0);
        let n_runs = AtomicUsize::new(0);
        let work = || async {
            if n_runs.fetch_add(1, Ordering::Relaxed) == 0 {
                return Err(full());
            }
            let wanted = reserve.require();
            let max_wait = std::time::Duration::from_millis(50);
            let taken = tokio::time::timeout(max_wait, wanted).await.is_ok();
            was_taken.store(usize::from(taken), Ordering::Relaxed);
            Ok(())
        };
        reserve.lend(work).await.unwrap();
        assert_eq!(was_taken.load(Ordering::Relaxed), 0);
        reserve.require().await.unwrap();
    }
}
