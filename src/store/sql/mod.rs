//! One SQL text for both database engines: SQLite, a file on one machine, and PostgreSQL, which several
//! machines can share. The rest of the store does not depend on the engine.
//!
//! `$n` parameters, `returning`, `on conflict` and common table expressions mean the same in both. Only
//! PostgreSQL has row locks. They are removed from the text for SQLite, where the single writer locks the
//! whole database.

mod pool;
mod reserve;
mod value;

use std::borrow::Cow;

use sqlx::postgres::PgRow;
use sqlx::sqlite::SqliteRow;
use sqlx::{AssertSqlSafe, Decode, FromRow, Postgres, Sqlite, Type};

use pool::On;
pub(super) use pool::{Listener, Pool, Transaction};
pub(super) use reserve::Reserve;
use value::{Value, arguments};

/// Clauses that SQLite does not know. Longer ones come first, because shorter ones are parts of them.
const ROW_LOCKS: [&str; 3] = [
    " for update of j skip locked",
    " for update skip locked",
    " for update",
];

/// A statement with its parameters.
#[derive(Clone)]
pub(super) struct Query {
    sql: Cow<'static, str>,
    values: Vec<Value>,
}

/// A statement whose rows have one column.
#[derive(Clone)]
pub(super) struct ScalarQuery(Query);

/// Returns a statement without parameters. The first bound value becomes `$1`.
pub(super) fn query(sql: impl Into<Cow<'static, str>>) -> Query {
    Query {
        sql: sql.into(),
        values: Vec::new(),
    }
}

/// Returns a statement whose rows have one column, without parameters.
pub(super) fn query_scalar(sql: impl Into<Cow<'static, str>>) -> ScalarQuery {
    ScalarQuery(query(sql))
}

/// Types that can be read from a row of either engine.
pub(super) trait Row:
    for<'r> FromRow<'r, SqliteRow> + for<'r> FromRow<'r, PgRow> + Send + Unpin
{
}

impl<T> Row for T where T: for<'r> FromRow<'r, SqliteRow> + for<'r> FromRow<'r, PgRow> + Send + Unpin
{}

/// Types that can be read from a column of either engine.
pub(super) trait Column:
    for<'r> Decode<'r, Sqlite>
    + Type<Sqlite>
    + for<'r> Decode<'r, Postgres>
    + Type<Postgres>
    + Send
    + Unpin
{
}

impl<T> Column for T where
    T: for<'r> Decode<'r, Sqlite>
        + Type<Sqlite>
        + for<'r> Decode<'r, Postgres>
        + Type<Postgres>
        + Send
        + Unpin
{
}

/// Runs a query on a connection or transaction, with the statement and parameters in the form of its engine.
macro_rules! run {
    ($query:expr, $on:expr, $prepare:path, |$at:ident, $statement:ident| $run:expr) => {{
        let Query { sql, values } = $query;
        match $on.into() {
            On::SqlitePool($at) => {
                let sql = AssertSqlSafe(without_row_locks(sql));
                let $statement = $prepare(sql, arguments::<Sqlite>(values)?);
                $run
            }
            On::Sqlite($at) => {
                let sql = AssertSqlSafe(without_row_locks(sql));
                let $statement = $prepare(sql, arguments::<Sqlite>(values)?);
                $run
            }
            On::PostgresPool($at) => {
                let sql = AssertSqlSafe(sql.into_owned());
                let $statement = $prepare(sql, arguments::<Postgres>(values)?);
                $run
            }
            On::Postgres($at) => {
                let sql = AssertSqlSafe(sql.into_owned());
                let $statement = $prepare(sql, arguments::<Postgres>(values)?);
                $run
            }
        }
    }};
}

impl Query {
    /// Binds the next parameter.
    pub(super) fn bind(mut self, value: impl Into<Value>) -> Query {
        self.values.push(value.into());
        self
    }

    /// Runs the statement and returns the number of changed rows.
    pub(super) async fn execute<'a>(self, on: impl Into<On<'a>>) -> Result<u64, sqlx::Error> {
        run!(self, on, sqlx::query_with, |at, statement| {
            Ok(statement.execute(at).await?.rows_affected())
        })
    }

    /// Returns the first row. Fails if there is none.
    pub(super) async fn fetch_one<'a, T: Row>(
        self,
        on: impl Into<On<'a>>,
    ) -> Result<T, sqlx::Error> {
        run!(self, on, sqlx::query_as_with, |at, statement| {
            statement.fetch_one(at).await
        })
    }

    /// Returns the first row, if there is one.
    pub(super) async fn fetch_optional<'a, T: Row>(
        self,
        on: impl Into<On<'a>>,
    ) -> Result<Option<T>, sqlx::Error> {
        run!(self, on, sqlx::query_as_with, |at, statement| {
            statement.fetch_optional(at).await
        })
    }

    /// Returns all rows.
    pub(super) async fn fetch_all<'a, T: Row>(
        self,
        on: impl Into<On<'a>>,
    ) -> Result<Vec<T>, sqlx::Error> {
        run!(self, on, sqlx::query_as_with, |at, statement| {
            statement.fetch_all(at).await
        })
    }
}

impl ScalarQuery {
    /// Binds the next parameter.
    pub(super) fn bind(self, value: impl Into<Value>) -> ScalarQuery {
        ScalarQuery(self.0.bind(value))
    }

    /// Returns the value of the first row. Fails if there is none.
    pub(super) async fn fetch_one<'a, T: Column>(
        self,
        on: impl Into<On<'a>>,
    ) -> Result<T, sqlx::Error> {
        let (value,) = self.0.fetch_one(on).await?;
        Ok(value)
    }

    /// Returns the value of the first row, if there is one.
    pub(super) async fn fetch_optional<'a, T: Column>(
        self,
        on: impl Into<On<'a>>,
    ) -> Result<Option<T>, sqlx::Error> {
        let row: Option<(T,)> = self.0.fetch_optional(on).await?;
        Ok(row.map(|(value,)| value))
    }

    /// Returns the values of all rows.
    pub(super) async fn fetch_all<'a, T: Column>(
        self,
        on: impl Into<On<'a>>,
    ) -> Result<Vec<T>, sqlx::Error> {
        let rows: Vec<(T,)> = self.0.fetch_all(on).await?;
        Ok(rows.into_iter().map(|(value,)| value).collect())
    }
}

fn without_row_locks(sql: Cow<'static, str>) -> String {
    let mut sql = sql.into_owned();
    for clause in ROW_LOCKS {
        sql = sql.replace(clause, "");
    }
    sql
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use super::{Pool, query, without_row_locks};

    /// Returns all tables with their columns.
    async fn columns(pool: &Pool, sql: &'static str) -> BTreeSet<(String, String)> {
        let rows: Vec<(String, String)> = query(sql).fetch_all(pool).await.unwrap();
        let ours = |(table, _): &(String, String)| !table.starts_with("_sqlx");
        rows.into_iter().filter(ours).collect()
    }

    #[tokio::test]
    #[ignore = "needs PostgreSQL: make scale-test"]
    async fn both_engines_have_the_same_tables_and_columns() {
        let data = tempfile::tempdir().unwrap();
        let [_, sqlite] = Pool::open_sqlite(&data.path().join("rows.db"), true)
            .await
            .unwrap();
        let of_sqlite = columns(
            &sqlite,
            "select m.name, c.name from sqlite_master m, pragma_table_info(m.name) c \
             where m.type = 'table'",
        );
        let postgres = crate::store::fresh::open(data.path()).await.reader;
        assert!(matches!(postgres, Pool::Postgres(_)));
        let of_postgres = columns(
            &postgres,
            "select cast(table_name as text), cast(column_name as text) \
             from information_schema.columns where table_schema = current_schema()",
        );
        let of_sqlite = of_sqlite.await;
        assert!(of_sqlite.len() > 50);
        assert_eq!(of_sqlite, of_postgres.await);
    }

    #[test]
    fn row_locks_are_removed_for_sqlite() {
        let of = |sql: &'static str| without_row_locks(sql.into());
        assert_eq!(of("select 1 from jobs for update"), "select 1 from jobs");
        assert_eq!(
            of("(select 1 from jobs j limit 1 for update of j skip locked) returning id"),
            "(select 1 from jobs j limit 1) returning id"
        );
        assert_eq!(
            of("update jobs set state = $1"),
            "update jobs set state = $1"
        );
    }
}
