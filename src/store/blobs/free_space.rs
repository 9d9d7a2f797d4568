//! Free space on this machine's disk (docs/explanation/promises.md, "Full disk"), and whether the disk is
//! writable. `sql::reserve` keeps the space that the database needs on a full disk.

use std::io;

use super::{Backend, Blobs};

impl Blobs {
    /// Returns the number of bytes that can be written for uploads and results. If they are on two disks,
    /// returns the smaller number.
    pub fn free_bytes(&self) -> io::Result<u64> {
        let mut free_bytes = u64::MAX;
        for folder in [self.uploads(), self.tmp()] {
            let disk = rustix::fs::statvfs(folder)?;
            free_bytes = free_bytes.min(disk.f_bavail.saturating_mul(disk.f_frsize));
        }
        Ok(free_bytes)
    }

    /// Returns whether a local folder can be created and removed; for the readiness check.
    pub async fn is_writable(&self) -> bool {
        let drafts = self.drafts.clone();
        let name = uuid::Uuid::now_v7().to_string();
        let made = tokio::task::spawn_blocking(move || drafts.draft(&name).is_ok());
        made.await.unwrap_or(false)
    }

    /// Returns whether the bucket answers, if there is one; for the readiness check.
    pub async fn is_reached(&self) -> bool {
        match &self.backend {
            Backend::Local(_) => true,
            Backend::Bucket(bucket) => bucket.answers().await,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::config::Storage;

    #[tokio::test]
    async fn ordinary_folder_has_free_space_and_is_writable() {
        let data = tempfile::tempdir().unwrap();
        let blobs = Blobs::open(&Storage::from(data.path())).await.unwrap();
        assert!(blobs.free_bytes().unwrap() > 0 && blobs.is_writable().await);
        std::fs::remove_dir_all(blobs.tmp()).unwrap();
        assert!(!blobs.is_writable().await);
    }
}
