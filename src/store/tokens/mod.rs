//! The table of tokens: who may use the service, until when, and with how many jobs
//! (docs/explanation/promises.md, "Owners are isolated" and "Fair queue"). The table contains only the hash
//! of the secret. The secret itself is shown once, when the token is created.

mod key;
pub mod secret;
pub mod sessions;

pub(super) use secret::random_key;
use secret::{Presented, Secret};

use super::owners::{Account, Owner, OwnerFilter};
use super::{Error, Store, sql};

/// Permissions of a token. Each scope includes the scopes before it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Scope {
    /// Read the owner's data.
    Read,
    /// Create, cancel and delete.
    Write,
    /// Read and change the data of all owners.
    Admin,
}

/// Properties of a token to be created.
#[derive(Clone, Debug)]
pub struct NewToken {
    /// Label for people.
    pub name: String,
    /// Owner whose data the token gives access to; `None` creates a new owner.
    pub owner: Option<Owner>,
    /// Permissions.
    pub scope: Scope,
    /// Maximum number of queued and running jobs of the owner.
    pub quota: i64,
    /// Time of expiry, milliseconds since 1970; `None` = never.
    pub expires_ms: Option<i64>,
}

/// One stored token.
#[derive(Clone, Debug, PartialEq, Eq, sqlx::FromRow)]
pub struct Token {
    /// Id: the public part of the token.
    pub id: String,
    /// Label for people.
    pub name: String,
    /// Owner whose data the token gives access to.
    pub owner: Owner,
    /// Permissions.
    #[sqlx(try_from = "String")]
    pub scope: Scope,
    /// Maximum number of queued and running jobs of the owner.
    pub quota: i64,
    /// Time of creation, milliseconds since 1970.
    pub created_ms: i64,
    /// Time of expiry, milliseconds since 1970; `None` = never.
    pub expires_ms: Option<i64>,
    /// Time of revocation, milliseconds since 1970; `None` if not revoked.
    pub revoked_ms: Option<i64>,
}

/// A token with the hash of its secret.
#[derive(sqlx::FromRow)]
struct HashedToken {
    sha256: Vec<u8>,
    #[sqlx(flatten)]
    token: Token,
}

impl Store {
    /// Adds a token. Returns it with its text, which contains the secret and cannot be recovered later.
    pub async fn add_token(&self, new: &NewToken, now_ms: i64) -> Result<(Token, String), Error> {
        let (id, secret) = (secret::random_id()?, Secret::random()?);
        let token = Token {
            owner: new.owner.clone().unwrap_or_else(|| Owner(id.clone())),
            id,
            name: new.name.clone(),
            scope: new.scope,
            quota: new.quota,
            created_ms: now_ms,
            expires_ms: new.expires_ms,
            revoked_ms: None,
        };
        self.reserve.require().await?;
        sql::query(
            "insert into tokens (id, name, owner, sha256, scope, quota, created_ms, expires_ms) \
             values ($1, $2, $3, $4, $5, $6, $7, $8)",
        )
        .bind(&token.id)
        .bind(&token.name)
        .bind(&token.owner)
        .bind(secret.sha256.as_slice())
        .bind(token.scope.name())
        .bind(token.quota)
        .bind(token.created_ms)
        .bind(token.expires_ms)
        .execute(&self.writer)
        .await?;
        tracing::info!(
            token.id,
            token.name,
            scope = token.scope.name(),
            "token made"
        );
        let text = secret::token_text(&token.id, &secret.text);
        Ok((token, text))
    }

    /// Returns all tokens, also expired and revoked ones, oldest first.
    pub async fn list_tokens(&self) -> Result<Vec<Token>, Error> {
        let rows = sql::query("select * from tokens order by created_ms, id");
        Ok(rows.fetch_all(&self.reader).await?)
    }

    /// Revokes a token and thereby its sessions. Returns false if no token has this id, or if it was revoked
    /// before.
    pub async fn revoke_token(&self, id: &str, now_ms: i64) -> Result<bool, Error> {
        let sql = "update tokens set revoked_ms = $2 where id = $1 and revoked_ms is null";
        let revoke = || async {
            let update = sql::query(sql).bind(id).bind(now_ms);
            Ok(update.execute(&self.writer).await?)
        };
        let n_rows = self.reserve.lend(revoke).await?;
        tracing::info!(token.id = id, n_rows, "token revoked");
        Ok(n_rows > 0)
    }

    /// Returns whether any token is valid at `now_ms`.
    pub async fn has_tokens(&self, now_ms: i64) -> Result<bool, Error> {
        let sql = "select exists (select 1 from tokens where revoked_ms is null \
                   and (expires_ms is null or expires_ms > $1))";
        let known = sql::query_scalar(sql).bind(now_ms);
        Ok(known.fetch_one(&self.reader).await?)
    }

    /// Returns the presented token if its secret is correct and it is valid at `now_ms`.
    pub async fn token(&self, given: &Presented, now_ms: i64) -> Result<Option<Token>, Error> {
        let row = sql::query("select * from tokens where id = $1").bind(&given.id);
        let row: Option<HashedToken> = row.fetch_optional(&self.reader).await?;
        let known = row.filter(|row| secret::is_same(&row.sha256, &given.sha256));
        let token = known.map(|row| row.token);
        Ok(token.filter(|token| token.is_valid(now_ms)))
    }
}

impl Token {
    /// Returns whether the token is neither expired nor revoked.
    pub fn is_valid(&self, now_ms: i64) -> bool {
        self.revoked_ms.is_none() && self.expires_ms.is_none_or(|end_ms| end_ms > now_ms)
    }

    /// Returns the owners whose rows the token may see.
    pub fn visible_owners(&self) -> OwnerFilter {
        match self.scope {
            Scope::Admin => OwnerFilter::All,
            Scope::Read | Scope::Write => OwnerFilter::One(self.owner.clone()),
        }
    }

    /// Returns the account that the token's jobs count against.
    pub fn account(&self) -> Account {
        Account {
            owner: self.owner.clone(),
            quota: Some(self.quota),
        }
    }
}

impl Scope {
    /// All scopes, in ascending order.
    pub const ALL: [Scope; 3] = [Scope::Read, Scope::Write, Scope::Admin];

    /// Returns the name used in the database, in the API and on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Scope::Read => "read",
            Scope::Write => "write",
            Scope::Admin => "admin",
        }
    }

    /// Returns the scope with this name.
    pub fn from_name(name: &str) -> Option<Scope> {
        Scope::ALL.into_iter().find(|scope| scope.name() == name)
    }
}

impl TryFrom<String> for Scope {
    type Error = Error;

    fn try_from(name: String) -> Result<Scope, Error> {
        Scope::from_name(&name).ok_or(Error::UnknownValue {
            table: "tokens",
            value: name,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::store::fresh;

    fn wanted(expires_ms: Option<i64>) -> NewToken {
        NewToken {
            name: "lab".to_owned(),
            owner: None,
            scope: Scope::Write,
            quota: 3,
            expires_ms,
        }
    }

    #[tokio::test]
    async fn token_is_valid_until_it_expires_or_is_revoked() {
        let data = tempfile::tempdir().unwrap();
        let store = fresh::open(data.path()).await;
        assert!(!store.has_tokens(0).await.unwrap());
        let (made, text) = store.add_token(&wanted(Some(100)), 0).await.unwrap();
        let given = Presented::parse(&text).unwrap();
        let found = async |at_ms| store.token(&given, at_ms).await.unwrap();
        assert_eq!(found(99).await, Some(made.clone()));
        assert_eq!(found(100).await, None);
        assert!(!store.has_tokens(100).await.unwrap() && store.has_tokens(99).await.unwrap());
        assert!(store.revoke_token(&made.id, 50).await.unwrap());
        assert!(!store.revoke_token(&made.id, 51).await.unwrap());
        assert_eq!(found(60).await, None);
        assert!(!store.has_tokens(60).await.unwrap());
    }

    #[tokio::test]
    async fn token_with_another_secret_or_id_is_refused() {
        let data = tempfile::tempdir().unwrap();
        let store = fresh::open(data.path()).await;
        let (_, first) = store.add_token(&wanted(None), 0).await.unwrap();
        let (_, second) = store.add_token(&wanted(None), 0).await.unwrap();
        let (first, second) = (
            Presented::parse(&first).unwrap(),
            Presented::parse(&second).unwrap(),
        );
        let crossed = Presented {
            id: first.id.clone(),
            sha256: second.sha256,
        };
        assert!(store.token(&first, 1).await.unwrap().is_some());
        assert!(store.token(&crossed, 1).await.unwrap().is_none());
        let absent = Presented {
            id: "nobody".to_owned(),
            ..second
        };
        assert!(store.token(&absent, 1).await.unwrap().is_none());
    }

    #[tokio::test]
    async fn data_folder_contains_no_secret() {
        let data = tempfile::tempdir().unwrap();
        let store = Store::open(data.path()).await.unwrap();
        let (_, text) = store.add_token(&wanted(None), 0).await.unwrap();
        store.close().await;
        let secret = text.rsplit('_').next().unwrap().as_bytes().to_vec();
        for entry in std::fs::read_dir(data.path()).unwrap().flatten() {
            let bytes = std::fs::read(entry.path()).unwrap_or_default();
            let holds = bytes.windows(secret.len()).any(|part| part == secret);
            assert!(!holds, "{}", entry.path().display());
        }
    }
}
