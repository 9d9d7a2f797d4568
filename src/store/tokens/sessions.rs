//! The table of sessions: browsers that exchanged a token for a cookie
//! (docs/explanation/promises.md, "No cross-site writes"). A session is valid no longer than its token.

use super::Token;
use super::secret::{self, Secret};
use crate::store::{Error, Store, sql};

impl Store {
    /// Begins a session of a token and returns the value of the cookie. Expired sessions are deleted first.
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
