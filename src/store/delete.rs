//! Deletion of user data with everything derived from it. One transaction deletes the rows, and the files are
//! removed after it. A crash in between leaves folders without rows, which the sweep removes.
//!
//! The row of a job is deleted with its result. If the job is running, its worker finds no row at the next
//! heartbeat and stops. It cannot store a result, because its fence matches no row.
//!
//! Deleting also works on a full disk, within the reserve (docs/explanation/promises.md, "Full disk").

use sqlx::types::Uuid;

use super::{Error, Store, Transaction, sql};

impl Store {
    /// Deletes a footage, its libraries and everything made from them. Returns false if the footage does not
    /// exist.
    pub async fn delete_footage(&self, id: Uuid) -> Result<bool, Error> {
        self.reserve.lend(|| self.delete_footage_now(id)).await
    }

    async fn delete_footage_now(&self, id: Uuid) -> Result<bool, Error> {
        let mut transaction = self.writer.begin().await?;
        let folder: Option<String> = sql::query_scalar("select folder from footage where id = $1")
            .bind(id)
            .fetch_optional(&mut transaction)
            .await?;
        let Some(folder) = folder else {
            return Ok(false);
        };
        let libraries: Vec<Uuid> = sql::query_scalar(
            "select result_id from jobs \
             where kind = 'analysis' and json_extract(input, '$.footage_id') = $1 for update",
        )
        .bind(id.to_string())
        .fetch_all(&mut transaction)
        .await?;
        let mut folders = vec![folder];
        for library in libraries {
            folders.extend(delete_library_rows(&mut transaction, library).await?);
        }
        for sql in [
            "delete from footage where id = $1",
            "delete from jobs where result_id = $1",
        ] {
            sql::query(sql).bind(id).execute(&mut transaction).await?;
        }
        self.forget(transaction, folders).await?;
        tracing::info!(footage.id = %id, "footage deleted");
        Ok(true)
    }

    /// Deletes a library and everything made from it. Returns false if the library does not exist.
    pub async fn delete_library(&self, id: Uuid) -> Result<bool, Error> {
        self.reserve.lend(|| self.delete_library_now(id)).await
    }

    async fn delete_library_now(&self, id: Uuid) -> Result<bool, Error> {
        let mut transaction = self.writer.begin().await?;
        let folders = delete_library_rows(&mut transaction, id).await?;
        let was_there = !folders.is_empty();
        self.forget(transaction, folders).await?;
        tracing::info!(library.id = %id, was_there, "library deleted");
        Ok(was_there)
    }

    /// Deletes a flock or a virtual fish. Returns false if it does not exist.
    pub async fn delete_film(&self, id: Uuid) -> Result<bool, Error> {
        self.reserve.lend(|| self.delete_film_now(id)).await
    }

    async fn delete_film_now(&self, id: Uuid) -> Result<bool, Error> {
        let mut transaction = self.writer.begin().await?;
        sql::query("select 1 from jobs where result_id = $1 for update")
            .bind(id)
            .execute(&mut transaction)
            .await?;
        let sql = "select folder from flocks where id = $1 union all \
                   select folder from fish where id = $1";
        let folders: Vec<String> = sql::query_scalar(sql)
            .bind(id)
            .fetch_all(&mut transaction)
            .await?;
        for sql in [
            "delete from flocks where id = $1",
            "delete from fish where id = $1",
            "delete from jobs where result_id = $1",
        ] {
            sql::query(sql).bind(id).execute(&mut transaction).await?;
        }
        let was_there = !folders.is_empty();
        self.forget(transaction, folders).await?;
        tracing::info!(result.id = %id, was_there, "result deleted");
        Ok(was_there)
    }

    /// Deletes the rows of the files, commits, and removes the folders.
    async fn forget(
        &self,
        mut transaction: Transaction,
        folders: Vec<String>,
    ) -> Result<(), Error> {
        for folder in &folders {
            let delete = sql::query("delete from blobs where folder = $1").bind(folder);
            delete.execute(&mut transaction).await?;
        }
        transaction.commit().await?;
        for folder in &folders {
            self.blobs.discard(folder).await?;
        }
        Ok(())
    }
}

/// Deletes the rows of a library and of everything made from it, including jobs that have not finished.
/// Returns the folders that these rows named.
async fn delete_library_rows(
    transaction: &mut Transaction,
    library: Uuid,
) -> Result<Vec<String>, sqlx::Error> {
    // Locks the jobs first, in the same order as finishing a job does. This prevents deadlocks.
    let jobs = "select 1 from jobs where result_id = $1 \
               or kind in ('flock', 'fish') and json_extract(input, '$.library_id') = $2 for update";
    let lock = sql::query(jobs).bind(library).bind(library.to_string());
    lock.execute(&mut *transaction).await?;
    let sql = "select folder from libraries where id = $1 union all \
               select folder from flocks where library_id = $1 union all \
               select folder from fish where library_id = $1";
    let folders = sql::query_scalar(sql)
        .bind(library)
        .fetch_all(&mut *transaction)
        .await?;
    for sql in [
        "delete from flocks where library_id = $1",
        "delete from fish where library_id = $1",
        "delete from libraries where id = $1",
    ] {
        let delete = sql::query(sql).bind(library);
        delete.execute(&mut *transaction).await?;
    }
    let sql = "delete from jobs where result_id = $1 \
               or kind in ('flock', 'fish') and json_extract(input, '$.library_id') = $2";
    let delete = sql::query(sql).bind(library).bind(library.to_string());
    delete.execute(&mut *transaction).await?;
    Ok(folders)
}
