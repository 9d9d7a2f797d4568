//! What outlives the process: rows in a database, files in a folder (RELIABILITY.md, store and queue
//! rules). SQL exists in this folder only, a file per table, one text for both engines (`sql`).
//!
//! No transaction awaits anything but SQL. Times come in as arguments, milliseconds since 1970 (UTC);
//! where several machines share the database they are to be its own ([`Store::clock_ms`]).

pub mod blobs;
pub mod check;
pub mod delete;
pub mod error;
pub mod fish;
pub mod flocks;
pub mod footage;
pub mod idempotency;
pub mod intake;
pub mod jobs;
pub mod libraries;
pub mod owners;
pub mod spill;
mod sql;
pub mod tls;
pub mod tokens;
pub mod upkeep;
pub mod uploads;

use std::fs::{File, TryLockError};
use std::path::Path;
use std::sync::Arc;
use std::time::Duration;

pub use blobs::{BlobFile, Blobs, Draft, Fetched};
pub use error::Error;
pub use spill::Spill;

use crate::config::{Database, Storage};
use sql::{Pool, Reserve, Transaction};

#[cfg(test)]
mod fresh;

/// The open store: cheap to clone, one per process and folder.
#[derive(Clone)]
pub struct Store {
    writer: Pool,
    reader: Pool,
    reserve: Reserve,
    blobs: Blobs,
    holders: uploads::Holders,
    /// Held while the store is open: whoever holds them knows that no other process serves the same folder.
    locks: Arc<Vec<File>>,
    is_alone: bool,
}

impl Store {
    /// Opens the store, made if absent, and brings the database to this version's form. Fails with
    /// [`Error::InUse`] when another process serves the same data folder or file of rows, with
    /// [`Error::OtherFiles`] when the files are another database's.
    pub async fn open(storage: impl Into<Storage>) -> Result<Store, Error> {
        let storage = storage.into();
        std::fs::create_dir_all(&storage.data)?;
        let mut locks = vec![lock(&storage.data.join("lock"))?];
        // Another process may name the same file while its data folder is another.
        if let Database::Sqlite(file) = storage.database() {
            locks.push(lock(&file.with_extension("lock"))?);
        }
        Store::connect(&storage, locks).await
    }

    /// The same, but beside whatever process has it open: for workers, and for rows that do not belong to
    /// that process, as those of tokens. The form of a file of rows is that process's then.
    pub async fn open_beside(storage: impl Into<Storage>) -> Result<Store, Error> {
        let storage = storage.into();
        if let Database::Postgres(_) = storage.database() {
            return Store::connect(&storage, Vec::new()).await;
        }
        match Store::open(storage.clone()).await {
            Err(Error::InUse(_)) => Store::connect(&storage, Vec::new()).await,
            opened => opened,
        }
    }

    async fn connect(storage: &Storage, locks: Vec<File>) -> Result<Store, Error> {
        let is_locked = !locks.is_empty();
        let blobs = Blobs::open(storage).await?;
        let (writer, reader, reserve) = match storage.database() {
            Database::Sqlite(file) => {
                let reserve = Reserve::beside(&file);
                let open = || Pool::open_sqlite(&file, is_locked);
                let [writer, reader] = reserve.lend(open).await?;
                (writer, reader, reserve)
            }
            Database::Postgres(url) => {
                let pool = Pool::open_postgres(&url).await?;
                (pool.clone(), pool, Reserve::none())
            }
        };
        let is_alone = is_locked && writer.is_file();
        if let Err(error) = reserve.require().await {
            tracing::warn!(%error, "there is no room for the reserve: nothing new is stored");
        }
        let store = Store {
            writer,
            reader,
            reserve,
            blobs,
            holders: uploads::Holders::default(),
            locks: Arc::new(locks),
            is_alone,
        };
        store.own_files().await?;
        Ok(store)
    }

    /// Whether every lease that stands was given by a process that is gone: no other can have the rows.
    pub fn is_alone(&self) -> bool {
        self.is_alone
    }

    /// Whether the data folder is this process's: then so are the uploads that grow in it.
    pub fn serves(&self) -> bool {
        !self.locks.is_empty()
    }

    /// The time by the database's clock, where processes with clocks of their own share the database.
    pub async fn clock_ms(&self) -> Result<Option<i64>, Error> {
        Ok(self.reader.clock_ms().await?)
    }

    /// The files.
    pub fn blobs(&self) -> &Blobs {
        &self.blobs
    }

    /// Whether the database can be written now: for readiness.
    pub async fn is_writable(&self) -> bool {
        let probe = async { self.writer.begin().await?.rollback().await };
        matches!(
            tokio::time::timeout(Duration::from_secs(2), probe).await,
            Ok(Ok(()))
        )
    }

    /// Closes the connections in order, so that the write-ahead log is folded in.
    pub async fn close(&self) {
        self.reader.close().await;
        self.writer.close().await;
        self.blobs.work().close();
    }

    /// Begins a transaction that adds rows: fails where the disk has no room but the reserve. A transaction that
    /// removes or ends things begins at the writer, within [`Reserve::lend`].
    async fn begin(&self) -> Result<Transaction, sqlx::Error> {
        self.reserve.require().await?;
        self.writer.begin().await
    }
}

fn lock(path: &Path) -> Result<File, Error> {
    let file = File::create(path)?;
    match try_for_a_moment(&file) {
        Ok(()) => Ok(file),
        Err(TryLockError::WouldBlock) => {
            let folder = path.parent().unwrap_or(path);
            Err(Error::InUse(folder.to_owned()))
        }
        Err(TryLockError::Error(error)) => Err(error.into()),
    }
}

/// A child of a process that was killed holds its locks too until it is another program: for a moment.
fn try_for_a_moment(file: &File) -> Result<(), TryLockError> {
    for _ in 0..10 {
        match file.try_lock() {
            Err(TryLockError::WouldBlock) => std::thread::sleep(Duration::from_millis(30)),
            tried => return tried,
        }
    }
    file.try_lock()
}
