//! Ownership of rows (docs/explanation/promises.md, "Owners are isolated"). Every row that a user creates has
//! one owner. Every query takes the set of visible owners as an argument, so that a query without this filter
//! does not compile.

use sqlx::types::Uuid;

use super::{Error, Store, sql};

/// Owner of a row: the owner named by a token, or the local owner.
#[derive(Clone, Debug, PartialEq, Eq, Hash, sqlx::Type)]
#[sqlx(transparent)]
pub struct Owner(pub String);

impl Owner {
    /// Returns the owner of requests without a token, and of rows that the program itself creates.
    pub fn local() -> Owner {
        Owner("local".to_owned())
    }
}

impl Store {
    /// Returns the owner of a flock. For holders of a signed link, who have no token.
    pub async fn owner_of_flock(&self, id: Uuid) -> Result<Option<Owner>, Error> {
        let owner = sql::query_scalar("select owner from flocks where id = $1").bind(id);
        Ok(owner.fetch_optional(&self.reader).await?)
    }
}

/// Queries restricted to visible rows.
impl Store {
    /// Returns the row that `sql` selects: `$1` is the id, `$2` the owner (null = all owners).
    pub(super) async fn one_of<T: sql::Row>(
        &self,
        sql: &'static str,
        id: Uuid,
        reach: &Reach,
    ) -> Result<Option<T>, Error> {
        let row = sql::query(sql).bind(id).bind(reach.owner());
        Ok(row.fetch_optional(&self.reader).await?)
    }

    /// Returns the rows that `sql` selects: only ids less than `$1` (null = no limit), at most `$2` rows, of
    /// the owner `$3` (null = all owners).
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

/// The owners whose rows are visible to a query.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Reach {
    /// All owners: for administrators and workers.
    All,
    /// One owner. Rows of others appear not to exist.
    Of(Owner),
}

impl Reach {
    /// Returns the parameter for `$n is null or owner = $n`.
    pub(super) fn owner(&self) -> Option<&str> {
        match self {
            Reach::All => None,
            Reach::Of(Owner(name)) => Some(name),
        }
    }
}

/// Account that a new job counts against (docs/explanation/promises.md, "Fair queue").
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Account {
    /// Owner of the job and of its result.
    pub owner: Owner,
    /// Maximum number of queued and running jobs of the owner; `None` = unlimited.
    pub quota: Option<i64>,
}

impl Account {
    /// Returns the account of the local owner, without a limit.
    pub fn local() -> Account {
        Account {
            owner: Owner::local(),
            quota: None,
        }
    }
}
