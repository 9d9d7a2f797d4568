//! The table of idempotency keys: a repeated request with the same key and body gets the same answer
//! (docs/explanation/promises.md, "Durable answers").
//!
//! A key is `running` while its first request runs, and `done` once the answer is stored. It is `interrupted`
//! if the request ended without an answer worth keeping: a crash, a broken connection or a 5xx status. The
//! next request with an interrupted key runs with the same ids, so that nothing is created twice.

use sqlx::types::Uuid;

use super::{Error, Store, Transaction, sql};

/// Time for which an answer is kept, milliseconds. Free choice.
pub const ANSWER_LIFETIME_MS: i64 = 24 * 3600 * 1000;

/// Time after which a running key counts as abandoned, milliseconds. Its request died with its process or
/// failed to release it. Long enough for an upload over a slow connection.
const MAX_REQUEST_MS: i64 = 3600 * 1000;
/// Time without renewal after which a key counts as abandoned if other processes share the database,
/// milliseconds. Free choice.
pub const LEASE_MS: i64 = 15_000;

/// Identity of a key. Equal texts from different callers, or for different routes, are different keys.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Scope {
    /// Owner of everything that the request creates.
    pub caller: String,
    /// Route of the request.
    pub route: String,
    /// The key as sent by the client.
    pub key: String,
}

/// A stored answer.
#[derive(Clone, Debug, PartialEq, Eq, sqlx::FromRow)]
pub struct Answer {
    /// SHA-256 of the request body.
    pub body_sha256: Vec<u8>,
    /// HTTP status, below 500.
    #[sqlx(try_from = "i64")]
    pub status: u16,
    /// Headers as JSON: pairs of name and value.
    pub headers: String,
    /// Body of the answer.
    pub answer: Vec<u8>,
}

/// Result of [`Store::begin_key`].
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Begun {
    /// The request must run. It creates things with ids derived from this one.
    Run(Uuid),
    /// Another request with this key is running.
    Running,
    /// An interrupted request with this key had another body.
    OtherBody,
    /// The request was answered before.
    Done(Answer),
}

impl Store {
    /// Takes the key for a request. If other processes share the database, the caller must renew the key
    /// every third of [`LEASE_MS`].
    ///
    /// `body_sha256` is `None` if the body is not known before the request runs. Keys that are older than
    /// [`ANSWER_LIFETIME_MS`] are deleted first.
    pub async fn begin_key(
        &self,
        scope: &Scope,
        body_sha256: Option<&[u8]>,
        now_ms: i64,
    ) -> Result<Begun, Error> {
        let mut transaction = self.writer.begin().await?;
        // One of two simultaneous requests begins, and the other sees its key.
        let name = format!("key {} {} {}", scope.caller, scope.route, scope.key);
        transaction.lock(&name).await?;
        sql::query("delete from idempotency where created_ms <= $1")
            .bind(now_ms - ANSWER_LIFETIME_MS)
            .execute(&mut transaction)
            .await?;
        let known: Option<(String, Uuid, Option<Vec<u8>>, i64)> = with_key(
            "select state, ids, body_sha256, created_ms from idempotency \
             where caller = $1 and route = $2 and key = $3",
            scope,
        )
        .fetch_optional(&mut transaction)
        .await?;
        let ids = match known {
            Some((state, _, _, heard_ms))
                if state == "running" && !self.is_abandoned(heard_ms, now_ms) =>
            {
                return Ok(Begun::Running);
            }
            Some((state, ..)) if state == "done" => {
                return Ok(Begun::Done(answer(&mut transaction, scope).await?));
            }
            Some((_, _, Some(then), _)) if body_sha256.is_some_and(|now| now != then) => {
                return Ok(Begun::OtherBody);
            }
            Some((_, ids, ..)) => ids,
            None => Uuid::now_v7(),
        };
        self.reserve.require().await?;
        with_key(
            "insert into idempotency (caller, route, key, ids, state, body_sha256, created_ms) \
             values ($1, $2, $3, $4, 'running', $5, $6) \
             on conflict (caller, route, key) do update \
             set state = 'running', created_ms = excluded.created_ms",
            scope,
        )
        .bind(ids)
        .bind(body_sha256)
        .bind(now_ms)
        .execute(&mut transaction)
        .await?;
        transaction.commit().await?;
        Ok(Begun::Run(ids))
    }

    /// Deletes keys that are older than [`ANSWER_LIFETIME_MS`], also if no new keys arrive.
    pub async fn forget_old_answers(&self, now_ms: i64) -> Result<(), Error> {
        let forget = || async {
            let sql = "delete from idempotency where created_ms <= $1";
            let delete = sql::query(sql).bind(now_ms - ANSWER_LIFETIME_MS);
            delete.execute(&self.writer).await?;
            Ok(())
        };
        self.reserve.lend(forget).await
    }

    /// Returns whether a running request counts as abandoned. `heard_ms` is the time of its last renewal.
    fn is_abandoned(&self, heard_ms: i64, now_ms: i64) -> bool {
        let longest_ms = if self.is_alone() {
            MAX_REQUEST_MS
        } else {
            LEASE_MS
        };
        heard_ms < now_ms - longest_ms
    }

    /// Renews the key of a request that is still running.
    pub async fn renew_key(&self, scope: &Scope, now_ms: i64) -> Result<(), Error> {
        with_key(
            "update idempotency set created_ms = $4 \
             where caller = $1 and route = $2 and key = $3 and state = 'running'",
            scope,
        )
        .bind(now_ms)
        .execute(&self.writer)
        .await?;
        Ok(())
    }

    /// Stores the answer of the request that holds the key.
    pub async fn finish_key(&self, scope: &Scope, answer: &Answer) -> Result<(), Error> {
        let finish = || async {
            with_key(
                "update idempotency set state = 'done', body_sha256 = $4, status = $5, headers = $6, \
                 answer = $7 where caller = $1 and route = $2 and key = $3 and state = 'running'",
                scope,
            )
            .bind(&answer.body_sha256)
            .bind(i64::from(answer.status))
            .bind(&answer.headers)
            .bind(&answer.answer)
            .execute(&self.writer)
            .await?;
            Ok(())
        };
        self.reserve.lend(finish).await
    }

    /// Releases the key of a request that ended without an answer to keep.
    pub async fn interrupt_key(&self, scope: &Scope) -> Result<(), Error> {
        let interrupt = || async {
            with_key(
                "update idempotency set state = 'interrupted' \
                 where caller = $1 and route = $2 and key = $3 and state = 'running'",
                scope,
            )
            .execute(&self.writer)
            .await?;
            Ok(())
        };
        self.reserve.lend(interrupt).await
    }

    /// Releases every running key at the start of the process. The requests have ended, because no other
    /// process uses the store.
    pub async fn interrupt_all_keys(&self) -> Result<(), Error> {
        let sql = "update idempotency set state = 'interrupted' where state = 'running'";
        let interrupt = || async {
            sql::query(sql).execute(&self.writer).await?;
            Ok(())
        };
        self.reserve.lend(interrupt).await
    }
}

/// Returns a statement with the parts of a key as `$1`, `$2` and `$3`.
fn with_key(sql: &'static str, scope: &Scope) -> sql::Query {
    sql::query(sql)
        .bind(&scope.caller)
        .bind(&scope.route)
        .bind(&scope.key)
}

/// Returns the stored answer, read within the transaction. A second connection might never become free if
/// every request waits for one.
async fn answer(transaction: &mut Transaction, scope: &Scope) -> Result<Answer, sqlx::Error> {
    let row = with_key(
        "select body_sha256, status, headers, answer from idempotency \
         where caller = $1 and route = $2 and key = $3",
        scope,
    );
    row.fetch_one(transaction).await
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::store::fresh;

    fn scope() -> Scope {
        Scope {
            caller: String::new(),
            route: "/v1/fish".into(),
            key: "k".into(),
        }
    }

    /// Returns an answer to store.
    fn accepted() -> Answer {
        Answer {
            body_sha256: vec![7; 32],
            status: 202,
            headers: "[]".into(),
            answer: b"{}".to_vec(),
        }
    }

    #[tokio::test]
    async fn answer_is_stored_for_a_day() {
        let data = tempfile::tempdir().unwrap();
        let store = fresh::open(data.path()).await;
        let Begun::Run(first) = store.begin_key(&scope(), None, 0).await.unwrap() else {
            panic!("the key is not new");
        };
        let answer = accepted();
        store.finish_key(&scope(), &answer).await.unwrap();
        let met = store
            .begin_key(&scope(), None, ANSWER_LIFETIME_MS - 1)
            .await
            .unwrap();
        assert_eq!(met, Begun::Done(answer));
        let met = store
            .begin_key(&scope(), None, ANSWER_LIFETIME_MS)
            .await
            .unwrap();
        assert!(matches!(met, Begun::Run(ids) if ids != first), "{met:?}");
    }

    #[tokio::test]
    async fn abandoned_key_expires() {
        let data = tempfile::tempdir().unwrap();
        let store = fresh::open(data.path()).await;
        let longest_ms = if store.is_alone() {
            MAX_REQUEST_MS
        } else {
            LEASE_MS
        };
        let first = store.begin_key(&scope(), None, 0).await.unwrap();
        let met = store.begin_key(&scope(), None, longest_ms).await;
        assert_eq!(met.unwrap(), Begun::Running);
        let met = store.begin_key(&scope(), None, longest_ms + 1).await;
        assert_eq!(met.unwrap(), first);
    }

    #[tokio::test]
    async fn more_replays_than_connections_are_all_answered() {
        let data = tempfile::tempdir().unwrap();
        let store = fresh::open(data.path()).await;
        store.begin_key(&scope(), None, 0).await.unwrap();
        let answer = accepted();
        store.finish_key(&scope(), &answer).await.unwrap();
        let scope = scope();
        let replays = (0..40).map(|_| store.begin_key(&scope, None, 1));
        let all = futures_util::future::join_all(replays);
        for met in all.await {
            assert_eq!(met.unwrap(), Begun::Done(answer.clone()));
        }
    }

    #[tokio::test]
    async fn interrupted_request_runs_again_with_its_ids_and_body() {
        let data = tempfile::tempdir().unwrap();
        let store = fresh::open(data.path()).await;
        let first = store.begin_key(&scope(), Some(&[1; 32]), 0).await.unwrap();
        let met = store.begin_key(&scope(), Some(&[1; 32]), 1).await.unwrap();
        assert_eq!(met, Begun::Running);
        store.interrupt_all_keys().await.unwrap();
        let met = store.begin_key(&scope(), Some(&[2; 32]), 2).await.unwrap();
        assert_eq!(met, Begun::OtherBody);
        let met = store.begin_key(&scope(), Some(&[1; 32]), 3).await.unwrap();
        assert_eq!(met, first);
    }

    #[tokio::test]
    async fn key_of_another_process_expires_after_a_lease_without_renewal() {
        let data = tempfile::tempdir().unwrap();
        let storage = fresh::storage(data.path());
        let (first_process, other) = (
            Store::open(storage.clone()).await.unwrap(),
            Store::open_beside(storage).await.unwrap(),
        );
        let first = first_process.begin_key(&scope(), None, 0).await.unwrap();
        first_process.renew_key(&scope(), 10_000).await.unwrap();
        let met = other.begin_key(&scope(), None, 10_000 + LEASE_MS).await;
        assert_eq!(met.unwrap(), Begun::Running);
        let met = other.begin_key(&scope(), None, 10_001 + LEASE_MS).await;
        assert_eq!(met.unwrap(), first);
    }
}
