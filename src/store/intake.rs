//! Takes a stream of foreign bytes to disk: counted, hashed, synced, never held in memory
//! (RELIABILITY.md, store rules: upload). One door for raw bodies and multipart fields.
//!
//! While some pieces are hashed and written the next ones may come: neither is copied on the way. And while they come
//! the disk works already at what is written, so that little is left to sync at the end.

use std::fs::File;
use std::io::{self, Write};
use std::sync::Arc;

use bytes::Bytes;
use sha2::{Digest, Sha256};
use tokio::task::{JoinHandle, spawn_blocking};

use super::{BlobFile, Draft, Error};

/// Bytes gathered before a write: each write is a hop to the blocking pool.
const GATHERED_BYTES: usize = 1 << 20;
/// Bytes written before the disk is told to begin with them.
const FLUSHED_BYTES: u64 = 32 << 20;

/// One file being received into a draft.
pub struct Intake {
    name: &'static str,
    size_bytes: u64,
    limit_bytes: u64,
    pieces: Vec<Bytes>,
    n_gathered: usize,
    /// What comes back when the pieces before these are on their way to the disk; nothing once that failed.
    writer: Option<JoinHandle<io::Result<Writer>>>,
}

struct Writer {
    file: Arc<File>,
    hasher: Sha256,
    /// Written since the disk was last told to begin.
    n_unflushed: u64,
    /// What comes back when the disk is done with what it was told to begin with.
    flush: Option<JoinHandle<io::Result<()>>>,
}

impl Intake {
    /// Starts the file `name` in the draft; at most `limit_bytes` will be taken.
    pub async fn create(
        draft: &Draft,
        name: &'static str,
        limit_bytes: u64,
    ) -> Result<Intake, Error> {
        let file = tokio::fs::File::create_new(draft.path().join(name)).await?;
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

    /// Takes the next bytes; fails with [`Error::TooLarge`] before it stores one too many. What failed of bytes before
    /// is told here, or at the end.
    pub async fn take(&mut self, bytes: Bytes) -> Result<(), Error> {
        self.size_bytes += bytes.len() as u64;
        if self.size_bytes > self.limit_bytes {
            return Err(Error::TooLarge {
                limit_bytes: self.limit_bytes,
            });
        }
        self.n_gathered += bytes.len();
        self.pieces.push(bytes);
        match self.n_gathered < GATHERED_BYTES {
            true => Ok(()),
            false => self.write().await,
        }
    }

    /// Begins to write what was gathered, once what came before is written.
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

    /// Closes the file, which its draft then takes along: what is still being written keeps its room until then.
    pub async fn give_up(mut self) {
        // What failed of it does not matter any more.
        if let Ok(mut writer) = self.idle_writer().await {
            writer.flushed().await.ok();
        }
    }

    /// Syncs the file and says what it is.
    pub async fn finish(mut self) -> Result<BlobFile, Error> {
        self.write().await?;
        let mut writer = self.idle_writer().await?;
        writer.flushed().await?;
        let Writer { file, hasher, .. } = writer;
        spawn_blocking(move || file.sync_all())
            .await
            .map_err(io::Error::other)??;
        Ok(BlobFile {
            name: self.name.to_owned(),
            size_bytes: self.size_bytes as i64,
            sha256: hasher.finalize().to_vec(),
        })
    }

    async fn idle_writer(&mut self) -> Result<Writer, Error> {
        let gone = || io::Error::other("what came before could not be written");
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

    /// Tells the disk to begin when there is enough for it to do and it is done with what came before.
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

    /// What the disk was told to begin with is there; fails where it could not take it, for a later sync would not say.
    async fn flushed(&mut self) -> Result<(), Error> {
        match self.flush.take() {
            Some(flush) => Ok(flush.await.map_err(io::Error::other)??),
            None => Ok(()),
        }
    }
}
