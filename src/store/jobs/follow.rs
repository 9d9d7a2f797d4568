//! Jobs that depend on a job that will never be done. They end in the same transaction as that job, so that
//! no job waits forever.

use sqlx::types::Uuid;

use crate::store::{Transaction, sql};
use flockreel_core::code::Code;

/// Cancels all jobs that depend on a cancelled job, directly or indirectly.
pub(super) async fn cancel_followers(
    transaction: &mut Transaction,
    job: Uuid,
    now_ms: i64,
) -> Result<(), sqlx::Error> {
    sql::query(
        "with recursive followers (id) as ( \
             select id from jobs where after_job = $1 \
             union select j.id from jobs j join followers f on j.after_job = f.id) \
         update jobs set state = 'cancelled', finished_ms = $2 \
         where id in (select id from followers) and state = 'queued'",
    )
    .bind(job)
    .bind(now_ms)
    .execute(transaction)
    .await?;
    Ok(())
}

/// Fails all jobs that depend on a failed job, directly or indirectly.
pub(super) async fn fail_followers(
    transaction: &mut Transaction,
    job: Uuid,
    now_ms: i64,
) -> Result<(), sqlx::Error> {
    sql::query(
        "with recursive followers (id) as ( \
             select id from jobs where after_job = $1 \
             union select j.id from jobs j join followers f on j.after_job = f.id) \
         update jobs set state = 'failed', finished_ms = $2, code = $3, detail = $4 \
         where id in (select id from followers) and state = 'queued'",
    )
    .bind(job)
    .bind(now_ms)
    .bind(Code::InputFailed.name())
    .bind(Code::InputFailed.meaning())
    .execute(transaction)
    .await?;
    Ok(())
}
