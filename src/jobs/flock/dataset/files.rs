//! Files of a data set with their hashes, which are computed while the files are written.

use std::fs::{self, File};
use std::io::{self, BufWriter, Write};
use std::path::Path;

use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};

use crate::store::blobs::hex;

/// Folder of what is needed to go on after a stop.
pub(super) const WORK: &str = ".work";

/// A file of a data set.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Record {
    /// Path below the folder of the data set, with `/`.
    pub path: String,
    /// Size, bytes.
    pub bytes: u64,
    /// SHA-256, hexadecimal.
    pub sha256: String,
}

impl Record {
    /// Returns the record of a file in a folder.
    pub(super) fn of(folder: &Path, path: &str) -> io::Result<Record> {
        let bytes = fs::read(folder.join(path))?;
        Ok(Record {
            path: path.to_owned(),
            bytes: bytes.len() as u64,
            sha256: hex(&Sha256::digest(&bytes)),
        })
    }

    /// Returns whether the file is in a folder, with its size.
    pub(super) fn is_in(&self, folder: &Path) -> bool {
        let file = fs::metadata(folder.join(&self.path));
        file.is_ok_and(|file| file.len() == self.bytes)
    }
}

/// A file whose hash is computed while it is written.
pub(super) struct HashedFile {
    path: String,
    file: BufWriter<File>,
    hasher: Sha256,
    n_bytes: u64,
}

impl HashedFile {
    /// Creates a file and its folder below the folder of the data set.
    pub(super) fn create(root: &Path, path: String) -> io::Result<HashedFile> {
        let whole = root.join(&path);
        fs::create_dir_all(whole.parent().unwrap_or(root))?;
        Ok(HashedFile {
            path,
            file: BufWriter::new(File::create(whole)?),
            hasher: Sha256::new(),
            n_bytes: 0,
        })
    }

    pub(super) fn write(&mut self, bytes: &[u8]) -> io::Result<()> {
        self.hasher.update(bytes);
        self.n_bytes += bytes.len() as u64;
        self.file.write_all(bytes)
    }

    /// Completes the file and returns its record.
    pub(super) fn finish(mut self) -> io::Result<Record> {
        self.file.flush()?;
        Ok(Record {
            path: self.path,
            bytes: self.n_bytes,
            sha256: hex(&self.hasher.finalize()),
        })
    }
}

/// Writes a file below the folder of the data set and returns its record.
pub(super) fn write_hashed(root: &Path, path: &str, bytes: &[u8]) -> io::Result<Record> {
    let mut file = HashedFile::create(root, path.to_owned())?;
    file.write(bytes)?;
    file.finish()
}
