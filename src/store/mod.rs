//! What outlives the process: rows in SQLite, files in a folder (RELIABILITY.md, store and queue
//! rules). SQL exists in this folder only, a file per table.
//!
//! One writer connection and a pool of readers: with one writer nobody upgrades a read snapshot, so
//! nobody meets `database is locked`. No transaction awaits anything but SQL. Times come in as
//! arguments, milliseconds since 1970 (UTC).

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
pub mod sweep;
pub mod tokens;
pub mod upkeep;
pub mod uploads;

use std::fs::{File, TryLockError};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Duration;

use sqlx::SqlitePool;
use sqlx::migrate::Migrator;
use sqlx::sqlite::{
    SqliteConnectOptions, SqliteConnection, SqliteJournalMode, SqlitePoolOptions, SqliteSynchronous,
};

pub use blobs::{BlobFile, Blobs, Draft};
pub use error::Error;
pub use spill::Spill;

static MIGRATIONS: Migrator = sqlx::migrate!("migrations/sqlite");
const READERS: u32 = 4;

/// The open store: cheap to clone, one per process and folder.
#[derive(Clone)]
pub struct Store {
    writer: SqlitePool,
    reader: SqlitePool,
    blobs: Blobs,
    holders: uploads::Holders,
    /// Held while the store is open: whoever holds it knows that every other process is gone.
    _lock: Option<Arc<File>>,
}

impl Store {
    /// Opens the folder, made if absent, and brings the database to this version's form. Fails with
    /// [`Error::InUse`] when another process has it open.
    pub async fn open(data: &Path) -> Result<Store, Error> {
        std::fs::create_dir_all(data)?;
        let lock = lock(data)?;
        Store::connect(data, Some(lock)).await
    }

    /// The same, but beside a process that has the folder open, where there is one: for rows that do
    /// not belong to that process, as those of tokens. The database's form is that process's then.
    pub async fn open_beside(data: &Path) -> Result<Store, Error> {
        match Store::open(data).await {
            Err(Error::InUse(_)) => Store::connect(data, None).await,
            opened => opened,
        }
    }

    async fn connect(data: &Path, lock: Option<File>) -> Result<Store, Error> {
        let blobs = Blobs::open(data)?;
        let options = options(data.join("flockreel.db"));
        let writer = SqlitePoolOptions::new()
            .max_connections(1)
            .connect_with(options.clone())
            .await?;
        if lock.is_some() {
            MIGRATIONS.run(&writer).await?;
        }
        let reader = SqlitePoolOptions::new()
            .max_connections(READERS)
            .connect_with(options.read_only(true))
            .await?;
        Ok(Store {
            writer,
            reader,
            blobs,
            holders: uploads::Holders::default(),
            _lock: lock.map(Arc::new),
        })
    }

    /// Whether no other process has the folder open.
    pub fn is_alone(&self) -> bool {
        self._lock.is_some()
    }

    /// The files.
    pub fn blobs(&self) -> &Blobs {
        &self.blobs
    }

    /// Whether the database can be written now: for readiness.
    pub async fn is_writable(&self) -> bool {
        let probe = async { self.begin().await?.rollback().await };
        matches!(
            tokio::time::timeout(Duration::from_secs(2), probe).await,
            Ok(Ok(()))
        )
    }

    /// Closes the connections in order, so that the write-ahead log is folded in.
    pub async fn close(&self) {
        self.reader.close().await;
        self.writer.close().await;
    }

    /// A write transaction that holds the writer's lock from its first statement.
    async fn begin(&self) -> Result<sqlx::Transaction<'static, sqlx::Sqlite>, sqlx::Error> {
        self.writer.begin_with("BEGIN IMMEDIATE").await
    }
}

fn lock(data: &Path) -> Result<File, Error> {
    let file = File::create(data.join("lock"))?;
    match file.try_lock() {
        Ok(()) => Ok(file),
        Err(TryLockError::WouldBlock) => Err(Error::InUse(data.to_owned())),
        Err(TryLockError::Error(error)) => Err(error.into()),
    }
}

fn options(database: PathBuf) -> SqliteConnectOptions {
    SqliteConnectOptions::new()
        .filename(database)
        .create_if_missing(true)
        .journal_mode(SqliteJournalMode::Wal)
        .synchronous(SqliteSynchronous::Full)
        .foreign_keys(true)
        .busy_timeout(Duration::from_secs(5))
}

/// Where a statement that may be part of a transaction runs.
type Connection = SqliteConnection;
