//! Whose things are whose (RELIABILITY.md, S6): every row that people make has one owner, and every
//! question names whose rows it is about, so that a query without the wall does not compile.

use sqlx::types::Uuid;

use super::{Error, Store, sql};

/// Who has a thing: the owner that a token names, or the local one.
#[derive(Clone, Debug, PartialEq, Eq, Hash, sqlx::Type)]
#[sqlx(transparent)]
pub struct Owner(pub String);

impl Owner {
    /// Whoever asks on the machine itself without a token, and the program itself.
    pub fn local() -> Owner {
        Owner("local".to_owned())
    }
}

impl Store {
    /// Whose a flock is, for whoever holds a link to it.
    pub async fn owner_of_flock(&self, id: Uuid) -> Result<Option<Owner>, Error> {
        let owner = sql::query_scalar("select owner from flocks where id = $1").bind(id);
        Ok(owner.fetch_optional(&self.reader).await?)
    }
}

/// Questions within reach: one row by its id, and the newest of a table.
impl Store {
    /// The row that `sql` asks for: `$1` is the id, `$2` the owner, null for everybody's.
    pub(super) async fn one_of<T: sql::Row>(
        &self,
        sql: &'static str,
        id: Uuid,
        reach: &Reach,
    ) -> Result<Option<T>, Error> {
        let row = sql::query(sql).bind(id).bind(reach.owner());
        Ok(row.fetch_optional(&self.reader).await?)
    }

    /// The rows that `sql` asks for: `$1` is the id that they are older than, null for the newest; `$2` how
    /// many at most, `$3` the owner, null for everybody's.
    pub(super) async fn newest_of<T: sql::Row>(
        &self,
        sql: &'static str,
        limit: i64,
        before: Option<Uuid>,
        reach: &Reach,
    ) -> Result<Vec<T>, Error> {
        let rows = sql::query(sql).bind(before).bind(limit);
        Ok(rows.bind(reach.owner()).fetch_all(&self.reader).await?)
    }
}

/// Whose rows a question is about.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Reach {
    /// Everybody's: administrators, and the workers.
    All,
    /// One owner's; the others' are not there.
    Of(Owner),
}

impl Reach {
    /// As a parameter of `$n is null or owner = $n`.
    pub(super) fn owner(&self) -> Option<&str> {
        match self {
            Reach::All => None,
            Reach::Of(Owner(name)) => Some(name),
        }
    }
}

/// To whom a new job is charged (RELIABILITY.md, R9).
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Account {
    /// Whose the job and its result will be.
    pub owner: Owner,
    /// How many jobs of the owner may be queued or running at once; any number where it is `None`.
    pub quota: Option<i64>,
}

impl Account {
    /// The local owner's, without a bound.
    pub fn local() -> Account {
        Account {
            owner: Owner::local(),
            quota: None,
        }
    }
}
