//! Takes a stream of foreign bytes to disk: counted, hashed, synced, never held in memory
//! (RELIABILITY.md, store rules: upload). One door for raw bodies and multipart fields.
//!
//! While some pieces are hashed and written the next ones may come: neither is copied on the way.

use std::fs::File;
use std::io::{self, Write};

use bytes::Bytes;
use sha2::{Digest, Sha256};
use tokio::task::{JoinHandle, spawn_blocking};

use super::{BlobFile, Draft, Error};

/// Bytes gathered before a write: each write is a hop to the blocking pool.
const GATHERED_BYTES: usize = 1 << 20;

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
    file: File,
    hasher: Sha256,
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
            file: file.into_std().await,
            hasher: Sha256::new(),
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
        let pieces = std::mem::take(&mut self.pieces);
        self.n_gathered = 0;
        self.writer = Some(spawn_blocking(move || {
            for piece in pieces {
                writer.hasher.update(&piece);
                writer.file.write_all(&piece)?;
            }
            Ok(writer)
        }));
        Ok(())
    }

    /// Closes the file, which its draft then takes along: what is still being written keeps its room until then.
    pub async fn give_up(mut self) {
        // What failed of it does not matter any more.
        self.idle_writer().await.ok();
    }

    /// Syncs the file and says what it is.
    pub async fn finish(mut self) -> Result<BlobFile, Error> {
        self.write().await?;
        let Writer { file, hasher } = self.idle_writer().await?;
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
