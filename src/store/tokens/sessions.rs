//! The table of sessions: browsers that exchanged a token for a cookie
//! (docs/explanation/promises.md, "No cross-site writes"). A session is valid no longer than its token.

use super::Token;
use super::secret::{self, Secret};
use crate::store::{Error, Store, sql};

/// Largest number of sessions of a token. Free choice: browsers and computers of one person.
const MAX_SESSIONS: i64 = 64;

impl Store {
    /// Begins a session of a token and returns the value of the cookie. Expired sessions are deleted first, and the oldest
    /// ones of the token beyond `MAX_SESSIONS`.
    pub async fn begin_session(
        &self,
        token_id: &str,
        now_ms: i64,
        expires_ms: i64,
    ) -> Result<String, Error> {
        let secret = Secret::random()?;
        let mut transaction = self.begin().await?;
        sql::query("delete from sessions where expires_ms <= $1")
            .bind(now_ms)
            .execute(&mut transaction)
            .await?;
        sql::query(
            "delete from sessions where token_id = $1 and sha256 not in (select sha256 from sessions \
             where token_id = $1 order by created_ms desc, sha256 limit $2)",
        )
        .bind(token_id)
        .bind(MAX_SESSIONS - 1)
        .execute(&mut transaction)
        .await?;
        sql::query(
            "insert into sessions (sha256, token_id, created_ms, expires_ms) \
             values ($1, $2, $3, $4)",
        )
        .bind(secret.sha256.as_slice())
        .bind(token_id)
        .bind(now_ms)
        .bind(expires_ms)
        .execute(&mut transaction)
        .await?;
        transaction.commit().await?;
        tracing::info!(token.id = token_id, "session begun");
        Ok(secret.text)
    }

    /// Returns the token of a cookie if both are valid at `now_ms`. The lookup uses the hash of the secret.
    /// An attacker cannot choose hashes, so its duration reveals nothing.
    pub async fn token_of_session(
        &self,
        cookie: &str,
        now_ms: i64,
    ) -> Result<Option<Token>, Error> {
        let token: Option<Token> = sql::query(
            "select t.* from tokens t join sessions s on s.token_id = t.id \
             where s.sha256 = $1 and s.expires_ms > $2",
        )
        .bind(secret::hash(cookie).as_slice())
        .bind(now_ms)
        .fetch_optional(&self.reader)
        .await?;
        Ok(token.filter(|token| token.is_valid(now_ms)))
    }

    /// Ends a session. Succeeds also if the session does not exist.
    pub async fn end_session(&self, cookie: &str) -> Result<(), Error> {
        let end = || async {
            sql::query("delete from sessions where sha256 = $1")
                .bind(secret::hash(cookie).as_slice())
                .execute(&self.writer)
                .await?;
            Ok(())
        };
        self.reserve.lend(end).await
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::store::fresh;
    use crate::store::tokens::{NewToken, Scope};

    #[tokio::test]
    async fn oldest_sessions_of_a_token_end_when_it_has_too_many() {
        let data = tempfile::tempdir().unwrap();
        let store = fresh::open(data.path()).await;
        let new = NewToken {
            name: "lab".to_owned(),
            owner: None,
            scope: Scope::Read,
            quota: 1,
            expires_ms: None,
        };
        let (token, _) = store.add_token(&new, 0).await.unwrap();
        let (other, _) = store.add_token(&new, 0).await.unwrap();
        let others = store.begin_session(&other.id, 0, 1000).await.unwrap();
        let mut cookies = Vec::new();
        for k in 0..MAX_SESSIONS + 3 {
            cookies.push(store.begin_session(&token.id, k, 1000).await.unwrap());
        }
        let mut is_valid = Vec::new();
        for cookie in &cookies {
            is_valid.push(store.token_of_session(cookie, 500).await.unwrap().is_some());
        }
        let (ended, valid) = is_valid.split_at(3);
        assert!(ended.iter().all(|is_valid| !is_valid) && valid.iter().all(|is_valid| *is_valid));
        assert!(
            store
                .token_of_session(&others, 500)
                .await
                .unwrap()
                .is_some()
        );
    }
}
