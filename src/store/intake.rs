//! Writes an incoming stream of bytes to a file. The stream is counted, hashed and synced without being held
//! in memory (docs/explanation/promises.md, "No upload is lost"). Raw bodies and multipart fields both use
//! it.
//!
//! Pieces are hashed and written while the next ones arrive, and are not copied. Data is also flushed to the
//! disk during the transfer, so that the final sync is short.

use std::fs::File;
use std::io::{self, Write};
use std::sync::Arc;

use bytes::Bytes;
use sha2::{Digest, Sha256};
use tokio::task::{JoinHandle, spawn_blocking};

use super::{BlobFile, Draft, Error};

/// Bytes collected before a write. Every write is a task on the blocking pool. Free choice.
const GATHERED_BYTES: usize = 1 << 20;
/// Bytes written before a flush to the disk starts. Free choice.
const FLUSHED_BYTES: u64 = 32 << 20;

/// One file that is being received into a draft.
pub struct Intake {
    name: String,
    size_bytes: u64,
    limit_bytes: u64,
    pieces: Vec<Bytes>,
    n_gathered: usize,
    /// Returns the writer once the earlier pieces are written. `None` after a failure.
    writer: Option<JoinHandle<io::Result<Writer>>>,
}

struct Writer {
    file: Arc<File>,
    hasher: Sha256,
    /// Bytes written since the last flush started.
    n_unflushed: u64,
    /// The flush in progress, if any.
    flush: Option<JoinHandle<io::Result<()>>>,
}

impl Intake {
    /// Creates the file `name` in the draft. The file accepts at most `limit_bytes`.
    pub async fn create(
        draft: &Draft,
        name: impl Into<String>,
        limit_bytes: u64,
    ) -> Result<Intake, Error> {
        let name = name.into();
        let file = tokio::fs::File::create_new(draft.path().join(&name)).await?;
        let writer = Writer {
            file: Arc::new(file.into_std().await),
            hasher: Sha256::new(),
            n_unflushed: 0,
            flush: None,
        };
        Ok(Intake {
            name,
            size_bytes: 0,
            limit_bytes,
            pieces: Vec::new(),
            n_gathered: 0,
            writer: Some(spawn_blocking(|| Ok(writer))),
        })
    }

    /// Appends bytes. Fails with [`Error::TooLarge`] before the file exceeds its limit. An error of an
    /// earlier write is returned here or by [`Intake::finish`].
    pub async fn take(&mut self, bytes: Bytes) -> Result<(), Error> {
        self.size_bytes += bytes.len() as u64;
        if self.size_bytes > self.limit_bytes {
            return Err(Error::TooLarge {
                limit_bytes: self.limit_bytes,
            });
        }
        self.n_gathered += bytes.len();
        self.pieces.push(bytes);
        if self.n_gathered < GATHERED_BYTES {
            return Ok(());
        }
        self.write().await
    }

    /// Waits for the previous write, then starts to write the collected pieces.
    async fn write(&mut self) -> Result<(), Error> {
        let mut writer = self.idle_writer().await?;
        writer.flush_in_time().await?;
        let pieces = std::mem::take(&mut self.pieces);
        self.n_gathered = 0;
        self.writer = Some(spawn_blocking(move || {
            for piece in pieces {
                writer.take(&piece)?;
            }
            Ok(writer)
        }));
        Ok(())
    }

    /// Waits for the write in progress and closes the file. Afterwards the space is freed when the draft is
    /// dropped.
    pub async fn give_up(mut self) {
        // Errors are ignored, because the file is discarded.
        if let Ok(mut writer) = self.idle_writer().await {
            writer.flushed().await.ok();
        }
    }

    /// Writes the remaining bytes, syncs the file, and returns its size and hash.
    pub async fn finish(mut self) -> Result<BlobFile, Error> {
        self.write().await?;
        let mut writer = self.idle_writer().await?;
        writer.flushed().await?;
        let Writer { file, hasher, .. } = writer;
        spawn_blocking(move || file.sync_all())
            .await
            .map_err(io::Error::other)??;
        Ok(BlobFile {
            name: self.name,
            size_bytes: self.size_bytes as i64,
            sha256: hasher.finalize().to_vec(),
        })
    }

    async fn idle_writer(&mut self) -> Result<Writer, Error> {
        let gone = || io::Error::other("an earlier part of the upload could not be written");
        let writing = self.writer.take().ok_or_else(gone)?;
        Ok(writing.await.map_err(io::Error::other)??)
    }
}

impl Writer {
    fn take(&mut self, piece: &[u8]) -> io::Result<()> {
        self.hasher.update(piece);
        self.n_unflushed += piece.len() as u64;
        (&*self.file).write_all(piece)
    }

    /// Starts a flush if enough bytes are unflushed and no flush is in progress.
    async fn flush_in_time(&mut self) -> Result<(), Error> {
        let is_busy = (self.flush.as_ref()).is_some_and(|flush| !flush.is_finished());
        if self.n_unflushed >= FLUSHED_BYTES && !is_busy {
            self.flushed().await?;
            self.n_unflushed = 0;
            let file = self.file.clone();
            self.flush = Some(spawn_blocking(move || file.sync_data()));
        }
        Ok(())
    }

    /// Waits for the flush in progress. Returns its error, because a later sync would not report it.
    async fn flushed(&mut self) -> Result<(), Error> {
        match self.flush.take() {
            Some(flush) => Ok(flush.await.map_err(io::Error::other)??),
            None => Ok(()),
        }
    }
}
