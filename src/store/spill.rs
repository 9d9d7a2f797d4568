//! Temporary storage that bounds memory: the first bytes stay in memory, and the rest goes to an unnamed
//! file. The system removes such a file when the process ends, whatever the reason
//! (docs/explanation/promises.md, "No orphans").

use std::fs::File;
use std::io;
use std::os::unix::fs::FileExt;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{OnceLock, PoisonError, RwLock};

use flockreel_core::scratch::{Full, Scratch};

/// Maximum number of bytes held in memory. Free choice.
const MAX_HELD_BYTES: usize = 48 << 20;

/// A temporary storage. Data beyond the limit goes to a file in `folder`, created on first use.
#[derive(Debug)]
pub struct Spill {
    folder: PathBuf,
    held: RwLock<Vec<u8>>,
    max_held_bytes: usize,
    file: OnceLock<File>,
    /// Bytes assigned to the file, including those still being written.
    spilled: AtomicU64,
}

impl Spill {
    /// Returns an empty storage with a file in `folder`. The folder must exist once the limit is used up.
    pub fn into(folder: &Path) -> Spill {
        Spill::with_limit(folder, MAX_HELD_BYTES)
    }

    fn with_limit(folder: &Path, max_held_bytes: usize) -> Spill {
        Spill {
            folder: folder.to_owned(),
            held: RwLock::default(),
            max_held_bytes,
            file: OnceLock::new(),
            spilled: AtomicU64::new(0),
        }
    }

    /// Stores the bytes in memory and returns their offset; `None` if the limit is used up.
    fn hold(&self, bytes: &[u8]) -> Option<u64> {
        let mut held = self.held.write().unwrap_or_else(PoisonError::into_inner);
        if held.len() + bytes.len() > self.max_held_bytes {
            return None;
        }
        let at = held.len() as u64;
        held.extend_from_slice(bytes);
        Some(at)
    }

    fn file(&self) -> io::Result<&File> {
        if let Some(file) = self.file.get() {
            return Ok(file);
        }
        let file = tempfile::tempfile_in(&self.folder)?;
        // If two threads create a file at the same time, the second file is dropped.
        Ok(self.file.get_or_init(|| file))
    }
}

impl Scratch for Spill {
    fn put(&self, bytes: &[u8]) -> Result<u64, Full> {
        if let Some(at) = self.hold(bytes) {
            return Ok(at);
        }
        let at = self
            .spilled
            .fetch_add(bytes.len() as u64, Ordering::Relaxed);
        self.file()?.write_all_at(bytes, at)?;
        Ok(self.max_held_bytes as u64 + at)
    }

    fn get(&self, at: u64, bytes: &mut [u8]) {
        let Some(at_in_file) = at.checked_sub(self.max_held_bytes as u64) else {
            let held = self.held.read().unwrap_or_else(PoisonError::into_inner);
            return bytes.copy_from_slice(&held[at as usize..][..bytes.len()]);
        };
        self.file()
            .and_then(|file| file.read_exact_at(bytes, at_in_file))
            .expect("stored bytes can be read back");
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bytes_are_read_back_from_memory_and_from_the_unnamed_file() {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let spill = Spill::with_limit(folder.path(), 10);
        let pieces: Vec<Vec<u8>> = (0..9u8).map(|k| vec![k; usize::from(k)]).collect();
        let offsets: Vec<u64> = pieces
            .iter()
            .map(|piece| spill.put(piece).expect("the bytes are stored"))
            .collect();
        for (piece, at) in pieces.iter().zip(offsets) {
            let mut back = vec![99; piece.len()];
            spill.get(at, &mut back);
            assert_eq!(&back, piece);
        }
        assert!(spill.spilled.load(Ordering::Relaxed) > 20);
        let names = std::fs::read_dir(folder.path()).expect("the folder is readable");
        assert_eq!(names.count(), 0);
    }

    #[test]
    fn missing_folder_is_an_error() {
        let spill = Spill::with_limit(Path::new("/nowhere/at/all"), 0);
        let error = spill.put(b"bytes").expect_err("there is no folder");
        assert_eq!(error.code(), flockreel_core::code::Code::Internal);
    }
}
