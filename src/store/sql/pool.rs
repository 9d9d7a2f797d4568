//! Connections to whichever engine is there, and how each is opened.
//!
//! SQLite has one writer connection beside a pool of readers: with one writer nobody upgrades a read
//! snapshot, so nobody meets `database is locked`. PostgreSQL locks rows, and where a rule is about more than
//! the rows it changes, a name ([`Transaction::lock`]).

use std::path::Path;
use std::str::FromStr;
use std::time::Duration;

use sqlx::migrate::{MigrateDatabase, Migrator};
use sqlx::postgres::{PgConnectOptions, PgConnection, PgListener, PgPoolOptions};
use sqlx::sqlite::{
    SqliteConnectOptions, SqliteConnection, SqliteJournalMode, SqlitePoolOptions, SqliteSynchronous,
};
use sqlx::{Connection, Executor, PgPool, Postgres, Sqlite, SqlitePool};

use super::{query, query_scalar};
use crate::store::Error;

static FOR_SQLITE: Migrator = sqlx::migrate!("migrations/sqlite");
static FOR_POSTGRES: Migrator = sqlx::migrate!("migrations/postgres");
const SQLITE_READERS: u32 = 4;
/// Connections of one process: many processes share what a server allows, usually 100.
const POSTGRES_CONNECTIONS: u32 = 8;

const NO_SUCH_DATABASE: &str = "3D000";
const DATABASE_IS_THERE: &str = "42P04";

/// Connections of one kind.
#[derive(Clone, Debug)]
pub(in crate::store) enum Pool {
    Sqlite(SqlitePool),
    Postgres(PgPool),
}

/// What changes together or not at all; undone when dropped before its end.
pub(in crate::store) enum Transaction {
    Sqlite(sqlx::Transaction<'static, Sqlite>),
    Postgres(sqlx::Transaction<'static, Postgres>),
}

/// Hears what other processes notify of; on SQLite there is nobody to hear.
pub(in crate::store) struct Listener(Option<Box<PgListener>>);

/// Where a statement runs: on any connection, or in a transaction.
pub(in crate::store) enum On<'a> {
    SqlitePool(&'a SqlitePool),
    Sqlite(&'a mut SqliteConnection),
    PostgresPool(&'a PgPool),
    Postgres(&'a mut PgConnection),
}

impl Pool {
    /// The writer and the readers of a file, made if absent, and brought to this version's form
    /// where `migrates`.
    pub(in crate::store) async fn open_sqlite(
        file: &Path,
        migrates: bool,
    ) -> Result<[Pool; 2], Error> {
        let options = options(file);
        // A file does not hang up: to ask each time whether a connection still answers would double the way to it.
        let pool = SqlitePoolOptions::new().test_before_acquire(false);
        let writer = pool
            .clone()
            .max_connections(1)
            .after_release(|connection, _| Box::pin(async { Ok(is_idle(connection).await) }))
            .connect_with(options.clone())
            .await?;
        if migrates {
            FOR_SQLITE.run(&writer).await?;
        }
        let readers = pool
            .max_connections(SQLITE_READERS)
            .connect_with(options.read_only(true))
            .await?;
        Ok([Pool::Sqlite(writer), Pool::Sqlite(readers)])
    }

    /// The connections to a server, brought to this version's form; processes that start at once wait
    /// for one another.
    pub(in crate::store) async fn open_postgres(url: &str) -> Result<Pool, Error> {
        let options = PgConnectOptions::from_str(url)?.application_name("flockreel");
        let pool = PgPoolOptions::new().max_connections(POSTGRES_CONNECTIONS);
        let pool = match pool.clone().connect_with(options.clone()).await {
            Err(sqlx::Error::Database(error))
                if error.code().as_deref() == Some(NO_SUCH_DATABASE) =>
            {
                create(url).await?;
                pool.connect_with(options).await?
            }
            opened => opened?,
        };
        FOR_POSTGRES.run(&pool).await?;
        Ok(Pool::Postgres(pool))
    }

    /// Whether the rows are in a file of this machine.
    pub(in crate::store) fn is_file(&self) -> bool {
        matches!(self, Pool::Sqlite(_))
    }

    /// Copies the rows, as they are at one time, into a file, and opens it. Of rows on a server
    /// [`Error::RowsElsewhere`].
    pub(in crate::store) async fn copy_to(&self, file: &Path) -> Result<Pool, Error> {
        if !self.is_file() {
            return Err(Error::RowsElsewhere);
        }
        query("vacuum into $1")
            .bind(file.to_string_lossy().into_owned())
            .execute(self)
            .await?;
        let pool = SqlitePoolOptions::new().max_connections(1);
        Ok(Pool::Sqlite(pool.connect_with(options(file)).await?))
    }

    /// A transaction for writing: on SQLite it holds the writer's lock from its first statement.
    pub(in crate::store) async fn begin(&self) -> Result<Transaction, sqlx::Error> {
        Ok(match self {
            Pool::Sqlite(pool) => Transaction::Sqlite(pool.begin_with("BEGIN IMMEDIATE").await?),
            Pool::Postgres(pool) => Transaction::Postgres(pool.begin().await?),
        })
    }

    /// The time by the database's clock, milliseconds since 1970, where processes with clocks of their
    /// own share the database.
    pub(in crate::store) async fn clock_ms(&self) -> Result<Option<i64>, sqlx::Error> {
        match self {
            Pool::Sqlite(_) => Ok(None),
            Pool::Postgres(_) => {
                let sql = "select cast(extract(epoch from clock_timestamp()) * 1000 as bigint)";
                Ok(Some(query_scalar(sql).fetch_one(self).await?))
            }
        }
    }

    /// Hears what other processes notify of under a name.
    pub(in crate::store) async fn listen(&self, name: &str) -> Result<Listener, sqlx::Error> {
        let Pool::Postgres(pool) = self else {
            return Ok(Listener(None));
        };
        let mut listener = PgListener::connect_with(pool).await?;
        listener.listen(name).await?;
        Ok(Listener(Some(Box::new(listener))))
    }

    /// Closes the connections in order.
    pub(in crate::store) async fn close(&self) {
        match self {
            Pool::Sqlite(pool) => pool.close().await,
            Pool::Postgres(pool) => pool.close().await,
        }
    }
}

/// Whether a connection that comes back is in no transaction, by SQLite's count and by sqlx's. They differ after
/// SQLite has ended a transaction by itself, as it does when the disk is full: sqlx's rollback then fails, and every
/// later transaction would. Such a connection is closed, and the next one who needs it opens another. Statements
/// run in order, so a rollback that is under way comes first; a deferred `begin` takes no lock.
///
/// PostgreSQL's connections need no such test: there a rollback succeeds outside of transactions too.
async fn is_idle(connection: &mut SqliteConnection) -> bool {
    let begun = connection.execute(sqlx::raw_sql("begin; rollback")).await;
    let is_idle = begun.is_ok() && !connection.is_in_transaction();
    if !is_idle {
        tracing::warn!("the database's connection is opened again after a transaction that failed");
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

/// Makes the database; another process may have done so meanwhile.
async fn create(url: &str) -> Result<(), sqlx::Error> {
    match Postgres::create_database(url).await {
        Err(sqlx::Error::Database(error)) if error.code().as_deref() == Some(DATABASE_IS_THERE) => {
            Ok(())
        }
        made => made,
    }
}

impl Listener {
    /// Returns once something was notified of.
    pub(in crate::store) async fn heard(&mut self) -> Result<(), sqlx::Error> {
        match &mut self.0 {
            Some(listener) => listener.recv().await.map(drop),
            None => std::future::pending().await,
        }
    }
}

impl Transaction {
    /// Until the end nobody else passes the lock of that name: for rules about rows that are not there
    /// yet, or about how many there are. On SQLite a transaction is alone anyway.
    pub(in crate::store) async fn lock(&mut self, name: &str) -> Result<(), sqlx::Error> {
        if let Transaction::Postgres(_) = self {
            query("select pg_advisory_xact_lock(hashtextextended($1, 0))")
                .bind(name)
                .execute(self)
                .await?;
        }
        Ok(())
    }

    /// Tells those who listen to a name, once the transaction has ended well.
    pub(in crate::store) async fn notify(&mut self, name: &str) -> Result<(), sqlx::Error> {
        if let Transaction::Postgres(_) = self {
            query("select pg_notify($1, '')")
                .bind(name)
                .execute(self)
                .await?;
        }
        Ok(())
    }

    /// Ends it; its changes stay.
    pub(in crate::store) async fn commit(self) -> Result<(), sqlx::Error> {
        match self {
            Transaction::Sqlite(transaction) => transaction.commit().await,
            Transaction::Postgres(transaction) => transaction.commit().await,
        }
    }

    /// Ends it without a trace.
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
    use std::borrow::Cow;

    use super::*;
    use crate::code::Code;

    #[tokio::test]
    async fn a_connection_whose_transaction_sqlite_ended_is_opened_again() {
        let data = tempfile::tempdir().unwrap();
        let file = data.path().join("rows.db");
        let [writer, _] = Pool::open_sqlite(&file, true).await.unwrap();
        let run = async |sql| query(sql).execute(&writer).await.unwrap();
        run("create table films (bytes blob)").await;
        for _ in 0..3 {
            // As on a full disk, the database cannot grow. The limit is the connection's own.
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

    /// A done analysis with its library, a flock that follows it and is done, and one that is queued.
    const ROWS: &str = "
        insert into footage (id, folder, sha256, background_sha256, name, size_bytes, width, height, fps,
            n_frames_hint, sample, created_ms) values (x'00000000000000000000000000000001', 'footage/1',
            zeroblob(32), x'', 'film', 0, 1, 1, 1.0, 1, 0, 0);
        insert into jobs (id, kind, state, input, result_id, after_job, priority, run_at_ms, created_ms,
            finished_ms, owner) values
            (x'00000000000000000000000000000002', 'analysis', 'done', '{}',
                x'00000000000000000000000000000003', null, 0, 0, 5, 6, 'ann'),
            (x'00000000000000000000000000000004', 'flock', 'done', '{}',
                x'00000000000000000000000000000005', x'00000000000000000000000000000002', 0, 0, 7, 8, 'ann'),
            (x'00000000000000000000000000000006', 'flock', 'queued', '{}',
                x'00000000000000000000000000000007', x'00000000000000000000000000000002', 0, 0, 9, null, 'ann');
        insert into libraries (id, job_id, fence, folder, footage_id, params, summary, size_bytes, created_ms)
            values (x'00000000000000000000000000000003', x'00000000000000000000000000000002', 0, 'libraries/3',
            x'00000000000000000000000000000001', '{}', '{}', 0, 6);
        insert into flocks (id, job_id, fence, folder, library_id, params, summary, size_bytes, created_ms)
            values (x'00000000000000000000000000000005', x'00000000000000000000000000000004', 0, 'flocks/5',
            x'00000000000000000000000000000003', '{}', '{}', 0, 8);";

    #[tokio::test]
    async fn jobs_of_an_older_version_stay_with_all_that_refers_to_them() {
        let data = tempfile::tempdir().unwrap();
        let file = data.path().join("rows.db");
        let older = FOR_SQLITE.iter().filter(|one| one.version < 12).cloned();
        let older = Migrator {
            migrations: Cow::Owned(older.collect()),
            ..Migrator::DEFAULT
        };
        let pool = SqlitePool::connect_with(options(&file)).await.unwrap();
        older.run(&pool).await.unwrap();
        sqlx::raw_sql(ROWS).execute(&pool).await.unwrap();
        pool.close().await;

        let [pool, _] = Pool::open_sqlite(&file, true).await.unwrap();
        let sql = "select kind, state, owner, created_ms, after_job is null from jobs order by id";
        let jobs: Vec<(String, String, String, i64, bool)> =
            query(sql).fetch_all(&pool).await.unwrap();
        let row = |kind: &str, state: &str, ms, is_first| {
            (
                kind.to_owned(),
                state.to_owned(),
                "ann".to_owned(),
                ms,
                is_first,
            )
        };
        assert_eq!(
            jobs,
            [
                row("analysis", "done", 5, true),
                row("flock", "done", 7, false),
                row("flock", "queued", 9, false)
            ]
        );
        let broken = query_scalar("select count(*) from pragma_foreign_key_check");
        assert_eq!(broken.fetch_one::<i64>(&pool).await.unwrap(), 0);
        let removed = query("delete from jobs where kind = 'analysis'");
        removed.execute(&pool).await.unwrap_err();
    }
}
