//! Deletion of a resource with everything derived from it. One transaction deletes the rows, and the files are
//! removed after it. A crash in between leaves folders without rows, which the sweep removes.
//!
//! The row of a job is deleted with its result. If the job is running, its worker finds no row at the next
//! heartbeat and stops. It cannot store a result, because its fence matches no row.
//!
//! Deleting also works on a full disk, within the reserve (docs/explanation/promises.md, "Full disk").

use sqlx::types::Uuid;

use super::jobs::enqueue::QUEUE_LOCK;
use super::resources::{ResourceKind, is_dataset_of};
use super::{Error, Store, Transaction, sql};

impl Store {
    /// Deletes a resource and everything made from it. Returns false if the resource does not exist.
    pub async fn delete(&self, kind: ResourceKind, id: Uuid) -> Result<bool, Error> {
        self.delete_if(kind, id, None).await
    }

    /// Like [`Store::delete`], but first runs the statement of `condition`, with its number as the first and `id` as the
    /// second parameter. If that selects no id, deletes nothing and returns false.
    pub(super) async fn delete_if(
        &self,
        kind: ResourceKind,
        id: Uuid,
        condition: Option<(&str, i64)>,
    ) -> Result<bool, Error> {
        let delete = || async {
            let mut transaction = self.writer.begin().await?;
            // No job that uses the resource is queued meanwhile, and deletions do not wait for each other in a circle.
            transaction.lock(QUEUE_LOCK).await?;
            if let Some((sql, parameter)) = condition {
                let select = sql::query_scalar(sql.to_owned()).bind(parameter).bind(id);
                let found: Option<Uuid> = select.fetch_optional(&mut transaction).await?;
                if found.is_none() {
                    return Ok(false);
                }
            }
            let folders = match kind {
                ResourceKind::Footage => delete_footage_rows(&mut transaction, id).await?,
                ResourceKind::Library => delete_library_rows(&mut transaction, id).await?,
                _ => delete_film_rows(&mut transaction, id).await?,
            };
            for folder in &folders {
                let delete = sql::query("delete from blobs where folder = $1").bind(folder);
                delete.execute(&mut transaction).await?;
            }
            transaction.commit().await?;
            for folder in &folders {
                self.blobs.discard(folder).await?;
            }
            let was_there = !folders.is_empty();
            tracing::info!(resource.kind = kind.plural(), resource.id = %id, was_there, "resource deleted");
            Ok(was_there)
        };
        self.reserve.lend(delete).await
    }
}

/// Deletes the rows of a footage and of everything made from it. Returns the folders that these rows named;
/// none if the footage does not exist.
async fn delete_footage_rows(
    transaction: &mut Transaction,
    id: Uuid,
) -> Result<Vec<String>, sqlx::Error> {
    let mut folders =
        folders_of(transaction, "select folder from footage where id = $1", id).await?;
    if folders.is_empty() {
        return Ok(folders);
    }
    let sql = "select result_id from jobs \
               where kind = 'analysis' and json_extract(input, '$.footage_id') = $1 for update";
    let libraries = sql::query_scalar(sql).bind(id.to_string());
    for library in libraries.fetch_all(&mut *transaction).await? {
        folders.extend(delete_library_rows(transaction, library).await?);
    }
    for sql in [
        "delete from footage where id = $1",
        "delete from jobs where result_id = $1",
    ] {
        sql::query(sql).bind(id).execute(&mut *transaction).await?;
    }
    Ok(folders)
}

/// Deletes the rows of a library and of everything made from it, including jobs that have not finished.
/// Returns the folders that these rows named.
async fn delete_library_rows(
    transaction: &mut Transaction,
    library: Uuid,
) -> Result<Vec<String>, sqlx::Error> {
    // Locks the jobs first, in the same order as finishing a job does. This prevents deadlocks.
    let jobs = "select 1 from jobs where result_id = $1 \
               or kind in ('views', 'flock', 'fish') and json_extract(input, '$.library_id') = $2 for update";
    let lock = sql::query(jobs).bind(library).bind(library.to_string());
    lock.execute(&mut *transaction).await?;
    let sql = "select folder from libraries where id = $1 union all \
               select folder from views where library_id = $1 union all \
               select folder from flocks where library_id = $1 union all \
               select folder from fish where library_id = $1";
    let mut folders = folders_of(transaction, sql, library).await?;
    for dataset in datasets_of(transaction, library).await? {
        folders.extend(delete_film_rows(transaction, dataset).await?);
    }
    for sql in [
        "delete from views where library_id = $1",
        "delete from flocks where library_id = $1",
        "delete from fish where library_id = $1",
        "delete from libraries where id = $1",
    ] {
        let delete = sql::query(sql).bind(library);
        delete.execute(&mut *transaction).await?;
    }
    let sql = "delete from jobs where result_id = $1 \
               or kind in ('views', 'flock', 'fish') and json_extract(input, '$.library_id') = $2";
    let delete = sql::query(sql).bind(library).bind(library.to_string());
    delete.execute(&mut *transaction).await?;
    Ok(folders)
}

/// Returns the results of all jobs that make data sets of a library, also of those that have not finished.
async fn datasets_of(
    transaction: &mut Transaction,
    library: Uuid,
) -> Result<Vec<Uuid>, sqlx::Error> {
    let is_of = is_dataset_of("$1");
    let sql = format!("select j.result_id from jobs j where {is_of} for update");
    sql::query_scalar(sql)
        .bind(library)
        .fetch_all(transaction)
        .await
}

/// Deletes the rows of a flock, a virtual fish or a data set. Returns the folders that they named, also those of parts
/// that an unfinished job has kept.
async fn delete_film_rows(
    transaction: &mut Transaction,
    id: Uuid,
) -> Result<Vec<String>, sqlx::Error> {
    let lock = sql::query("select 1 from jobs where result_id = $1 for update").bind(id);
    lock.execute(&mut *transaction).await?;
    let sql = "select folder from flocks where id = $1 union all \
               select folder from fish where id = $1 union all \
               select folder from datasets where id = $1 union all \
               select p.folder from job_parts p join jobs j on j.id = p.job_id where j.result_id = $1";
    let folders = folders_of(transaction, sql, id).await?;
    for sql in [
        "delete from flocks where id = $1",
        "delete from fish where id = $1",
        "delete from datasets where id = $1",
        "delete from job_parts where job_id in (select id from jobs where result_id = $1)",
        "delete from jobs where result_id = $1",
    ] {
        sql::query(sql).bind(id).execute(&mut *transaction).await?;
    }
    Ok(folders)
}

/// Returns the folders that a statement with the parameter `id` selects.
async fn folders_of(
    transaction: &mut Transaction,
    sql: &'static str,
    id: Uuid,
) -> Result<Vec<String>, sqlx::Error> {
    sql::query_scalar(sql).bind(id).fetch_all(transaction).await
}
