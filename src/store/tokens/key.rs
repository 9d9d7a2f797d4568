//! The key by which links are signed: random, made when the first link is, and never shown.

use super::secret::random_key;
use crate::store::{Error, Store, sql};

impl Store {
    /// The data folder's signing key.
    pub async fn signing_key(&self) -> Result<Vec<u8>, Error> {
        let sql = "select secret from keys where name = 'links'";
        let found = sql::query_scalar(sql).fetch_optional(&self.reader).await?;
        if let Some(key) = found {
            return Ok(key);
        }
        self.reserve.require().await?;
        // Two at once: the first one's stays.
        sql::query("insert into keys (name, secret) values ('links', $1) on conflict do nothing")
            .bind(random_key()?.as_slice())
            .execute(&self.writer)
            .await?;
        Ok(sql::query_scalar(sql).fetch_one(&self.writer).await?)
    }
}
