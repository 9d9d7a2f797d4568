//! Free space on this machine's disk (docs/explanation/promises.md, "Full disk"), and whether the disk is
//! writable. `sql::reserve` keeps the space that the database needs on a full disk.

use std::io;
use std::path::PathBuf;

use super::Blobs;

impl Blobs {
    /// Returns the number of bytes that can be written for uploads and results. If they are on two disks,
    /// returns the smaller number.
    pub fn room_bytes(&self) -> io::Result<u64> {
        let mut least = u64::MAX;
        for folder in self.growing() {
            let disk = rustix::fs::statvfs(&folder)?;
            least = least.min(disk.f_bavail.saturating_mul(disk.f_frsize));
        }
        Ok(least)
    }

    /// Returns whether a local folder can be created and removed, and whether the bucket answers, if there is
    /// one; for the readiness check.
    pub async fn is_writable(&self) -> bool {
        let work = self.work.clone();
        let name = uuid::Uuid::now_v7().to_string();
        let made = tokio::task::spawn_blocking(move || work.draft(&name).is_ok());
        made.await.unwrap_or(false) && self.place.is_there().await
    }

    /// Returns the local folders that grow.
    fn growing(&self) -> [PathBuf; 2] {
        [self.uploads().to_owned(), self.tmp().to_owned()]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::config::Storage;

    #[tokio::test]
    async fn a_usual_folder_has_room_and_can_be_written() {
        let data = tempfile::tempdir().unwrap();
        let blobs = Blobs::open(&Storage::from(data.path())).await.unwrap();
        assert!(blobs.room_bytes().unwrap() > 0 && blobs.is_writable().await);
        std::fs::remove_dir_all(blobs.tmp()).unwrap();
        assert!(!blobs.is_writable().await);
    }
}
