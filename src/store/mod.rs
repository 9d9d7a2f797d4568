//! Storage that survives the process: rows in a database and files in a folder or bucket
//! (docs/explanation/promises.md, "No upload is lost"). Only this folder contains SQL, with one file per
//! table. The SQL text is the same for both database engines (`sql`).
//!
//! No transaction awaits anything but SQL. Times are arguments, in milliseconds since 1970 (UTC). If several
//! machines share the database, the times come from the database's clock ([`Store::clock_ms`]).

pub mod blobs;
pub mod check;
pub mod delete;
pub mod error;
pub mod footage;
pub mod idempotency;
pub mod intake;
pub mod jobs;
pub mod owners;
mod parts;
pub mod resources;
pub mod space;
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

/// An open store. Clones are cheap and share the connections. A process opens one store per folder.
#[derive(Clone)]
pub struct Store {
    writer: Pool,
    reader: Pool,
    reserve: Reserve,
    blobs: Blobs,
    space: space::Space,
    upload_locks: uploads::UploadLocks,
    /// Locks held while the store is open. They guarantee that no other process serves the same folder. Empty
    /// if this process opened the store beside another one.
    locks: Arc<Vec<File>>,
    is_alone: bool,
}

impl Store {
    /// Opens the store for a server. Creates it if absent, and migrates the database to this version's
    /// schema.
    ///
    /// Fails with [`Error::InUse`] if another process serves the same data folder or database file, and with
    /// [`Error::ForeignFiles`] if the files belong to another database.
    pub async fn open(storage: impl Into<Storage>) -> Result<Store, Error> {
        let storage = storage.into();
        std::fs::create_dir_all(&storage.data).map_err(Error::at(&storage.data))?;
        let mut locks = vec![lock(&storage.data.join("lock"))?];
        // Two processes may use the same database file with different data folders.
        if let Database::Sqlite(file) = storage.database() {
            locks.push(lock(&file.with_extension("lock"))?);
        }
        Store::connect(&storage, locks).await
    }

    /// Opens the store even if another process has it open. Workers use this, and commands that change rows
    /// which that process does not own, such as tokens.
    ///
    /// If another process serves the store, a SQLite database is not migrated here.
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
            tracing::warn!(%error, "the disk has too little space for the reserve: new data is refused");
        }
        let store = Store {
            writer,
            reader,
            reserve,
            blobs,
            space: space::Space::default(),
            upload_locks: uploads::UploadLocks::default(),
            locks: Arc::new(locks),
            is_alone,
        };
        store.check_identity().await?;
        Ok(store)
    }

    /// Returns whether no other process runs jobs of this database: it is a SQLite file that this process has
    /// locked. Any lease in it then comes from this process or from one that has ended.
    pub fn is_alone(&self) -> bool {
        self.is_alone
    }

    /// Returns whether this process has locked the data folder, and so owns the unfinished uploads in it.
    pub fn serves(&self) -> bool {
        !self.locks.is_empty()
    }

    /// Returns the time of the database's clock, milliseconds since 1970. `None` for SQLite, which only one
    /// machine uses.
    pub async fn clock_ms(&self) -> Result<Option<i64>, Error> {
        Ok(self.reader.clock_ms().await?)
    }

    /// Returns the store of files.
    pub fn blobs(&self) -> &Blobs {
        &self.blobs
    }

    /// Returns whether the database accepts a write transaction within 2 s; for the readiness check.
    pub async fn is_writable(&self) -> bool {
        answers(async { self.writer.begin().await?.rollback().await }).await
    }

    /// Returns whether the database answers a query within 2 s; for the readiness check.
    pub async fn is_readable(&self) -> bool {
        let any = sql::query_scalar("select exists (select 1 from tokens)");
        answers(any.fetch_one::<bool>(&self.reader)).await
    }

    /// Fails with `storage_full` if the disk has no space for new rows besides the reserve of the database.
    pub async fn require_rows(&self) -> Result<(), Error> {
        Ok(self.reserve.require().await?)
    }

    /// Closes all connections. SQLite then writes its write-ahead log into the database file.
    pub async fn close(&self) {
        self.reader.close().await;
        self.writer.close().await;
        self.blobs.drafts().close();
    }

    /// Begins a transaction that adds rows. Fails if the disk has no space left besides the reserve. A
    /// transaction that only removes or ends things uses `writer.begin` within [`Reserve::lend`] instead.
    async fn begin(&self) -> Result<Transaction, sqlx::Error> {
        self.reserve.require().await?;
        self.writer.begin().await
    }
}

/// Returns whether a probe of the database succeeds within 2 s.
async fn answers<T>(probe: impl Future<Output = Result<T, sqlx::Error>>) -> bool {
    let answer = tokio::time::timeout(Duration::from_secs(2), probe).await;
    matches!(answer, Ok(Ok(_)))
}

fn lock(path: &Path) -> Result<File, Error> {
    let file = File::create(path).map_err(Error::at(path))?;
    match try_lock_briefly(&file) {
        Ok(()) => Ok(file),
        Err(TryLockError::WouldBlock) => {
            let folder = path.parent().unwrap_or(path);
            Err(Error::InUse(folder.to_owned()))
        }
        Err(TryLockError::Error(error)) => Err(Error::at(path)(error)),
    }
}

/// Tries to lock the file for up to 0.3 s. A killed server's child process inherits the server's locks and
/// keeps them until it executes another program.
fn try_lock_briefly(file: &File) -> Result<(), TryLockError> {
    for _ in 0..10 {
        match file.try_lock() {
            Err(TryLockError::WouldBlock) => std::thread::sleep(Duration::from_millis(30)),
            tried => return tried,
        }
    }
    file.try_lock()
}
