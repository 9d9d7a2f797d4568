//! The key that signs links. It is random, created with the first link, and never shown.

use super::secret::random_key;
use crate::store::{Error, Store, sql};

impl Store {
    /// Returns the key that signs links. Creates it on first use.
    pub async fn signing_key(&self) -> Result<Vec<u8>, Error> {
        let sql = "select secret from keys where name = 'links'";
        let found = sql::query_scalar(sql).fetch_optional(&self.reader).await?;
        if let Some(key) = found {
            return Ok(key);
        }
        self.reserve.require().await?;
        // If two processes create a key at the same time, the first one is kept.
        sql::query("insert into keys (name, secret) values ('links', $1) on conflict do nothing")
            .bind(random_key()?.as_slice())
            .execute(&self.writer)
            .await?;
        Ok(sql::query_scalar(sql).fetch_one(&self.writer).await?)
    }
}
