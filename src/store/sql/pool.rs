//! Database connections, and how they are opened for each engine.
//!
//! SQLite has one writer connection and a pool of readers. With a single writer no reader upgrades its
//! snapshot to write, so `database is locked` does not occur. PostgreSQL locks rows. Rules that involve more
//! than the changed rows use a named lock ([`Transaction::lock`]).

use std::io;
use std::path::Path;
use std::pin::pin;
use std::str::FromStr;
use std::time::{Duration, Instant};

use sqlx::migrate::{MigrateDatabase, Migrator};
use sqlx::postgres::{PgConnectOptions, PgConnection, PgListener, PgPoolOptions};
use sqlx::sqlite::{
    SqliteConnectOptions, SqliteConnection, SqliteJournalMode, SqlitePoolOptions, SqliteSynchronous,
};
use sqlx::{Connection, Executor, PgPool, Postgres, Sqlite, SqlitePool};

use tokio::time::{sleep, timeout};

use super::{query, query_scalar};
use crate::store::Error;
use crate::store::error::is_cured_by_waiting;
use flockreel_core::code::Code;

static SQLITE_MIGRATIONS: Migrator = sqlx::migrate!("migrations/sqlite");
static POSTGRES_MIGRATIONS: Migrator = sqlx::migrate!("migrations/postgres");
/// Number of reader connections of one process. Free choice.
const SQLITE_READERS: u32 = 4;
/// Number of connections of one process. Many processes share the server's limit, which is usually 100.
const POSTGRES_CONNECTIONS: u32 = 8;

/// Longest wait for a connection. Free choice: a request then has an answer while the server is down.
const MAX_CONNECTION_WAIT: Duration = Duration::from_secs(10);
/// Longest wait at the start for a server that does not answer. Free choice; a server that recovers from a crash
/// needs about as long.
const MAX_SERVER_WAIT: Duration = Duration::from_secs(30);
/// Interval between attempts to connect, and between log lines about the wait. Free choice.
const SERVER_RETRY: Duration = Duration::from_secs(2);
/// Error code of PostgreSQL: the database does not exist.
const NO_SUCH_DATABASE: &str = "3D000";
/// Error code of PostgreSQL: the database exists already.
const DATABASE_EXISTS: &str = "42P04";

/// The connections to a database.
#[derive(Clone, Debug)]
pub(in crate::store) enum Pool {
    Sqlite(SqlitePool),
    Postgres(PgPool),
}

/// A transaction. Dropping it before the commit rolls it back.
pub(in crate::store) enum Transaction {
    Sqlite(sqlx::Transaction<'static, Sqlite>),
    Postgres(sqlx::Transaction<'static, Postgres>),
}

/// Receiver of notifications from other processes. On SQLite it receives none.
pub(in crate::store) struct Listener(Option<Box<PgListener>>);

/// Where a statement runs: on any connection of a pool, or in a transaction.
pub(in crate::store) enum On<'a> {
    SqlitePool(&'a SqlitePool),
    Sqlite(&'a mut SqliteConnection),
    PostgresPool(&'a PgPool),
    Postgres(&'a mut PgConnection),
}

impl Pool {
    /// Opens a database file and returns the writer and the readers. Creates the file if absent, and migrates
    /// it to this version's schema if `migrates`.
    pub(in crate::store) async fn open_sqlite(
        file: &Path,
        migrates: bool,
    ) -> Result<[Pool; 2], Error> {
        let options = options(file);
        // A local file does not disconnect. A test before every use would double the cost of getting a
        // connection.
        let pool = SqlitePoolOptions::new().test_before_acquire(false);
        let writer = pool
            .clone()
            .max_connections(1)
            .after_release(|connection, _| Box::pin(async { Ok(is_idle(connection).await) }))
            .connect_with(options.clone())
            .await
            .map_err(|error| unusable(file, error.into()))?;
        if migrates {
            SQLITE_MIGRATIONS.run(&writer).await?;
        }
        let readers = pool
            .max_connections(SQLITE_READERS)
            .connect_with(options.read_only(true))
            .await?;
        Ok([Pool::Sqlite(writer), Pool::Sqlite(readers)])
    }

    /// Connects to a server, creates the database if absent, and migrates it to this version's schema. Waits for
    /// a server that is starting. Processes that start at the same time wait for each other.
    pub(in crate::store) async fn open_postgres(url: &str) -> Result<Pool, Error> {
        let options = PgConnectOptions::from_str(url)?.application_name("flockreel");
        wait_for_server(&options).await?;
        let pool = PgPoolOptions::new()
            .max_connections(POSTGRES_CONNECTIONS)
            .acquire_timeout(MAX_CONNECTION_WAIT);
        let pool = match pool.clone().connect_with(options.clone()).await {
            Err(sqlx::Error::Database(error))
                if error.code().as_deref() == Some(NO_SUCH_DATABASE) =>
            {
                create(url).await?;
                pool.connect_with(options).await?
            }
            opened => opened?,
        };
        POSTGRES_MIGRATIONS.run(&pool).await?;
        Ok(Pool::Postgres(pool))
    }

    /// Returns whether the database is a local file.
    pub(in crate::store) fn is_file(&self) -> bool {
        matches!(self, Pool::Sqlite(_))
    }

    /// Copies a snapshot of the database to a file and opens the copy. Fails with [`Error::DatabaseOnServer`] if
    /// the database is on a server.
    pub(in crate::store) async fn copy_to(&self, file: &Path) -> Result<Pool, Error> {
        if !self.is_file() {
            return Err(Error::DatabaseOnServer);
        }
        query("vacuum into $1")
            .bind(file.to_string_lossy().into_owned())
            .execute(self)
            .await?;
        let pool = SqlitePoolOptions::new().max_connections(1);
        Ok(Pool::Sqlite(pool.connect_with(options(file)).await?))
    }

    /// Begins a write transaction. On SQLite it locks the database immediately.
    pub(in crate::store) async fn begin(&self) -> Result<Transaction, sqlx::Error> {
        Ok(match self {
            Pool::Sqlite(pool) => Transaction::Sqlite(pool.begin_with("BEGIN IMMEDIATE").await?),
            Pool::Postgres(pool) => Transaction::Postgres(pool.begin().await?),
        })
    }

    /// Returns the time of the database's clock, milliseconds since 1970. `None` for SQLite, which only one
    /// machine uses.
    pub(in crate::store) async fn clock_ms(&self) -> Result<Option<i64>, sqlx::Error> {
        match self {
            Pool::Sqlite(_) => Ok(None),
            Pool::Postgres(_) => {
                let sql = "select cast(extract(epoch from clock_timestamp()) * 1000 as bigint)";
                Ok(Some(query_scalar(sql).fetch_one(self).await?))
            }
        }
    }

    /// Subscribes to notifications of this name from all processes.
    pub(in crate::store) async fn listen(&self, name: &str) -> Result<Listener, sqlx::Error> {
        let Pool::Postgres(pool) = self else {
            return Ok(Listener(None));
        };
        let mut listener = PgListener::connect_with(pool).await?;
        listener.listen(name).await?;
        Ok(Listener(Some(Box::new(listener))))
    }

    /// Closes all connections.
    pub(in crate::store) async fn close(&self) {
        match self {
            Pool::Sqlite(pool) => pool.close().await,
            Pool::Postgres(pool) => pool.close().await,
        }
    }
}

/// Returns whether a released SQLite connection is in no transaction, according to both SQLite and sqlx.
///
/// The two differ after SQLite has rolled back by itself, as it does on a full disk. The rollback of sqlx
/// then fails, and so would every later transaction. Such a connection is closed, and the next request opens
/// another one.
///
/// Statements run in order, so a pending rollback is complete before this test. The deferred `begin` takes no
/// lock. PostgreSQL needs no such test, because there a rollback outside of a transaction succeeds.
async fn is_idle(connection: &mut SqliteConnection) -> bool {
    let begun = connection.execute(sqlx::raw_sql("begin; rollback")).await;
    let is_idle = begun.is_ok() && !connection.is_in_transaction();
    if !is_idle {
        tracing::warn!("a database connection is replaced after a failed transaction");
    }
    is_idle
}

fn options(file: &Path) -> SqliteConnectOptions {
    SqliteConnectOptions::new()
        .filename(file)
        .create_if_missing(true)
        .journal_mode(SqliteJournalMode::Wal)
        .synchronous(SqliteSynchronous::Full)
        .foreign_keys(true)
        .busy_timeout(Duration::from_secs(5))
}

/// Returns the error with the name of the file, unless the disk is full.
fn unusable(file: &Path, error: Error) -> Error {
    match error.code() {
        Code::StorageFull => error,
        _ => Error::at(file)(io::Error::other(error)),
    }
}

/// Waits until a server accepts connections. Logs after each failed attempt, and every few seconds, how long it
/// waits. Fails after [`MAX_SERVER_WAIT`]. Errors that waiting does not cure are left to the caller.
async fn wait_for_server(options: &PgConnectOptions) -> Result<(), Error> {
    let place = match options.get_socket() {
        Some(socket) => socket.display().to_string(),
        None => format!("{}:{}", options.get_host(), options.get_port()),
    };
    let start = Instant::now();
    let left = || MAX_SERVER_WAIT.saturating_sub(start.elapsed());
    let say = |cause: &str| {
        tracing::warn!(
            "waiting for the database at {place}, {} s left: {cause}",
            left().as_secs()
        );
    };
    let mut cause = "no answer yet".to_owned();
    while !left().is_zero() {
        let mut attempt = pin!(PgConnection::connect_with(options));
        let attempted = loop {
            match timeout(SERVER_RETRY.min(left()), &mut attempt).await {
                Ok(attempted) => break Some(attempted),
                Err(_) if left().is_zero() => break None,
                Err(_) => say(&cause),
            }
        };
        match attempted {
            Some(Err(error)) if is_cured_by_waiting(&error) => {
                cause = error.to_string();
                say(&cause);
                sleep(SERVER_RETRY.min(left())).await;
            }
            Some(Ok(connection)) => {
                // The server answers, whatever happens to this connection.
                connection.close().await.ok();
                return Ok(());
            }
            Some(Err(_)) => return Ok(()),
            None => {}
        }
    }
    Err(Error::Unreachable { place, cause })
}

/// Creates the database. Succeeds also if another process has created it.
async fn create(url: &str) -> Result<(), sqlx::Error> {
    match Postgres::create_database(url).await {
        Err(sqlx::Error::Database(error)) if error.code().as_deref() == Some(DATABASE_EXISTS) => {
            Ok(())
        }
        made => made,
    }
}

impl Listener {
    /// Waits for the next notification. Never returns on SQLite.
    pub(in crate::store) async fn next(&mut self) -> Result<(), sqlx::Error> {
        match &mut self.0 {
            Some(listener) => listener.recv().await.map(drop),
            None => std::future::pending().await,
        }
    }
}

impl Transaction {
    /// Takes the named lock until the end of the transaction. It protects rules about rows that do not exist
    /// yet, or about the number of rows. On SQLite it does nothing, because there is only one write
    /// transaction at a time.
    pub(in crate::store) async fn lock(&mut self, name: &str) -> Result<(), sqlx::Error> {
        if let Transaction::Postgres(_) = self {
            query("select pg_advisory_xact_lock(hashtextextended($1, 0))")
                .bind(name)
                .execute(self)
                .await?;
        }
        Ok(())
    }

    /// Notifies all subscribers of this name when the transaction commits. Does nothing on SQLite.
    pub(in crate::store) async fn notify(&mut self, name: &str) -> Result<(), sqlx::Error> {
        if let Transaction::Postgres(_) = self {
            query("select pg_notify($1, '')")
                .bind(name)
                .execute(self)
                .await?;
        }
        Ok(())
    }

    /// Commits the transaction.
    pub(in crate::store) async fn commit(self) -> Result<(), sqlx::Error> {
        match self {
            Transaction::Sqlite(transaction) => transaction.commit().await,
            Transaction::Postgres(transaction) => transaction.commit().await,
        }
    }

    /// Rolls the transaction back.
    pub(in crate::store) async fn rollback(self) -> Result<(), sqlx::Error> {
        match self {
            Transaction::Sqlite(transaction) => transaction.rollback().await,
            Transaction::Postgres(transaction) => transaction.rollback().await,
        }
    }
}

impl<'a> From<&'a Pool> for On<'a> {
    fn from(pool: &'a Pool) -> On<'a> {
        match pool {
            Pool::Sqlite(pool) => On::SqlitePool(pool),
            Pool::Postgres(pool) => On::PostgresPool(pool),
        }
    }
}

impl<'a> From<&'a mut Transaction> for On<'a> {
    fn from(transaction: &'a mut Transaction) -> On<'a> {
        match transaction {
            Transaction::Sqlite(transaction) => On::Sqlite(transaction),
            Transaction::Postgres(transaction) => On::Postgres(transaction),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use flockreel_core::code::Code;

    #[tokio::test]
    async fn connection_after_a_rollback_by_sqlite_is_replaced() {
        let data = tempfile::tempdir().unwrap();
        let file = data.path().join("rows.db");
        let [writer, _] = Pool::open_sqlite(&file, true).await.unwrap();
        let run = async |sql| query(sql).execute(&writer).await.unwrap();
        run("create table films (bytes blob)").await;
        for _ in 0..3 {
            // This simulates a full disk: the database cannot grow. The limit belongs to the connection.
            run("pragma max_page_count = 1").await;
            let mut transaction = writer.begin().await.unwrap();
            let insert = query("insert into films values (zeroblob(1000000))");
            let full = insert.execute(&mut transaction).await.unwrap_err();
            assert_eq!(Error::from(full).code(), Code::StorageFull);
            drop(transaction);
            let mut transaction = writer.begin().await.unwrap();
            let insert = query("insert into films values (zeroblob(1000000))");
            insert.execute(&mut transaction).await.unwrap();
            transaction.commit().await.unwrap();
        }
        let count = query_scalar("select count(*) from films");
        assert_eq!(count.fetch_one::<i64>(&writer).await.unwrap(), 3);
    }
}
