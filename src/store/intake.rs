//! Takes a stream of foreign bytes to disk: counted, hashed, synced, never held in memory
//! (RELIABILITY.md, store rules: upload). One door for raw bodies, multipart fields and, later,
//! resumable uploads.

use sha2::{Digest, Sha256};
use tokio::fs::File;
use tokio::io::{AsyncWriteExt, BufWriter};

use super::{BlobFile, Draft, Error};

/// Bytes gathered before a write: each write is a hop to the blocking pool.
const BUFFER_BYTES: usize = 1 << 20;

/// One file being received into a draft.
pub struct Intake {
    file: BufWriter<File>,
    hasher: Sha256,
    name: &'static str,
    size_bytes: u64,
    limit_bytes: u64,
}

impl Intake {
    /// Starts the file `name` in the draft; at most `limit_bytes` will be taken.
    pub async fn create(
        draft: &Draft,
        name: &'static str,
        limit_bytes: u64,
    ) -> Result<Intake, Error> {
        let file = File::create_new(draft.path().join(name)).await?;
        Ok(Intake {
            file: BufWriter::with_capacity(BUFFER_BYTES, file),
            hasher: Sha256::new(),
            name,
            size_bytes: 0,
            limit_bytes,
        })
    }

    /// Takes the next bytes; fails with [`Error::TooLarge`] before it stores one too many.
    pub async fn take(&mut self, bytes: &[u8]) -> Result<(), Error> {
        self.size_bytes += bytes.len() as u64;
        if self.size_bytes > self.limit_bytes {
            return Err(Error::TooLarge {
                limit_bytes: self.limit_bytes,
            });
        }
        self.hasher.update(bytes);
        self.file.write_all(bytes).await?;
        Ok(())
    }

    /// Syncs the file and says what it is.
    pub async fn finish(mut self) -> Result<BlobFile, Error> {
        self.file.flush().await?;
        self.file.get_ref().sync_all().await?;
        Ok(BlobFile {
            name: self.name.to_owned(),
            size_bytes: self.size_bytes as i64,
            sha256: self.hasher.finalize().to_vec(),
        })
    }
}
