//! Room on this machine's disk (RELIABILITY.md, R7): how much is left, and whether it can be written at
//! all. A reserve is kept, so that rows can still be written and things deleted.

use std::io;
use std::path::PathBuf;

use super::Blobs;

impl Blobs {
    /// Bytes that we can still write where uploads and results grow: on the fuller one, where they grow
    /// on two disks.
    pub fn room_bytes(&self) -> io::Result<u64> {
        let mut least = u64::MAX;
        for folder in self.growing() {
            let disk = rustix::fs::statvfs(&folder)?;
            least = least.min(disk.f_bavail.saturating_mul(disk.f_frsize));
        }
        Ok(least)
    }

    /// Whether a folder of this machine can be made and removed again, and a bucket, where the files are in
    /// one, answers in time: for readiness.
    pub async fn is_writable(&self) -> bool {
        let work = self.work.clone();
        let name = uuid::Uuid::now_v7().to_string();
        let made = tokio::task::spawn_blocking(move || work.draft(&name).is_ok());
        made.await.unwrap_or(false) && self.place.is_there().await
    }

    /// The folders of this machine that grow.
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
