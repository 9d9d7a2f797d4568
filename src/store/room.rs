//! Room on the disk that holds the files (RELIABILITY.md, R7): how much is left, and whether it can
//! be written at all. A reserve is kept, so that rows can still be written and things deleted.

use std::fs::File;
use std::io;

use super::Blobs;

impl Blobs {
    /// Bytes that can still be written by us.
    pub fn room_bytes(&self) -> io::Result<u64> {
        let disk = rustix::fs::statvfs(self.root())?;
        Ok(disk.f_bavail.saturating_mul(disk.f_frsize))
    }

    /// Whether a file can be made and removed again. Blocks.
    pub fn is_writable(&self) -> bool {
        let path = self.tmp().join(".writable");
        let made = File::create(&path).is_ok();
        // What is not there need not be removed.
        std::fs::remove_file(&path).is_ok() && made
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_usual_folder_has_room_and_can_be_written() {
        let data = tempfile::tempdir().unwrap();
        let blobs = Blobs::open(data.path()).unwrap();
        assert!(blobs.room_bytes().unwrap() > 0 && blobs.is_writable());
        std::fs::remove_dir(blobs.tmp()).unwrap();
        assert!(!blobs.is_writable());
    }
}
