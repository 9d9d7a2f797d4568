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

/// Queries restricted to visible rows. `select` names its table `r` and has no condition.
impl Store {
    /// Returns the row with this value in `column`.
    pub(super) async fn visible_row<T: sql::Row>(
        &self,
        select: &str,
        column: &str,
        id: Uuid,
        owners: &OwnerFilter,
    ) -> Result<Option<T>, Error> {
        let filter = format!("where r.{column} = $1 and ($2 is null or r.owner = $2)");
        let row = sql::query(format!("{select} {filter}")).bind(id);
        let row = row.bind(owners.parameter());
        Ok(row.fetch_optional(&self.reader).await?)
    }

    /// Returns the newest rows with ids less than `before`, at most `limit`. `condition` is more SQL for the
    /// condition, with parameters from `$4` on, which `bind` adds.
    pub(super) async fn newest_visible_rows<T: sql::Row>(
        &self,
        select: &str,
        (limit, before): (i64, Option<Uuid>),
        owners: &OwnerFilter,
        (condition, bind): (&str, impl FnOnce(sql::Query) -> sql::Query),
    ) -> Result<Vec<T>, Error> {
        let filter = "where ($1 is null or r.id < $1) and ($3 is null or r.owner = $3)";
        let order = "order by r.id desc limit $2";
        let rows = sql::query(format!("{select} {filter} {condition} {order}"))
            .bind(before)
            .bind(limit);
        let rows = rows.bind(owners.parameter());
        Ok(bind(rows).fetch_all(&self.reader).await?)
    }
}

/// The owners whose rows are visible to a query.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum OwnerFilter {
    /// All owners: for administrators and workers.
    All,
    /// One owner. Rows of others appear not to exist.
    One(Owner),
}

impl OwnerFilter {
    /// Returns the parameter for `$n is null or owner = $n`.
    pub(super) fn parameter(&self) -> Option<&str> {
        match self {
            OwnerFilter::All => None,
            OwnerFilter::One(Owner(name)) => Some(name),
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
