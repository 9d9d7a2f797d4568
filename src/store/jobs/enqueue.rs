//! Enqueue: a job comes to be, queued, unless its owner has as many as it may (RELIABILITY.md, R9).

use sqlx::types::Uuid;

use super::Kind;
use crate::ids::JobId;
use crate::store::owners::Account;
use crate::store::{Error, Store, Transaction, sql};

/// What a server tells all who listen.
const QUEUED: &str = "flockreel_jobs";

/// A job to be queued.
#[derive(Clone, Debug)]
pub struct NewJob {
    /// Its id.
    pub job_id: JobId,
    /// To whom it is charged.
    pub account: Account,
    /// What it is.
    pub kind: Kind,
    /// What it needs to run, JSON.
    pub input: String,
    /// The id that its result will have.
    pub result_id: Uuid,
    /// The job whose result it needs, if that is not there yet.
    pub after_job: Option<JobId>,
    /// Higher runs first; 0 is usual.
    pub priority: i64,
    /// How many jobs of everybody may be queued and running, this one included.
    pub room: i64,
}

impl Store {
    /// Adds the job to the queue; [`Error::QuotaExceeded`] where its owner has too many queued and
    /// running already, [`Error::QueueFull`] where all together have. Counted and added under one lock, so that
    /// two at once cannot both be the last. A job
    /// that is there already under its id, because its request comes again after a crash, is left as it is;
    /// [`Error::IdInUse`] where that one has another input.
    pub async fn enqueue(&self, job: &NewJob, now_ms: i64) -> Result<(), Error> {
        let mut transaction = self.begin().await?;
        transaction.lock("queue").await?;
        if is_queued_already(&mut transaction, job).await? {
            return Ok(());
        }
        let added = sql::query(
            "insert into jobs (id, kind, state, input, result_id, after_job, priority, run_at_ms, \
             created_ms, owner) select $1, $2, 'queued', $3, $4, $5, $6, $7, $7, $8 \
             where ($9 is null or $9 > (select count(*) from jobs \
             where owner = $8 and state in ('queued', 'running'))) \
             and $10 > (select count(*) from jobs where state in ('queued', 'running'))",
        )
        .bind(job.job_id.0)
        .bind(job.kind.name())
        .bind(&job.input)
        .bind(job.result_id)
        .bind(job.after_job.map(|id| id.0))
        .bind(job.priority)
        .bind(now_ms)
        .bind(&job.account.owner)
        .bind(job.account.quota)
        .bind(job.room)
        .execute(&mut transaction)
        .await?;
        if added == 0 {
            return Err(why_not(&mut transaction, job).await?);
        }
        transaction.notify(QUEUED).await?;
        transaction.commit().await?;
        tracing::info!(job.id = %job.job_id, job.kind = job.kind.name(), "job queued");
        Ok(())
    }

    /// Hears of jobs that any process queues.
    pub async fn listen(&self) -> Result<QueuedJobs, Error> {
        Ok(QueuedJobs(self.reader.listen(QUEUED).await?))
    }
}

/// Where a process hears that there are jobs, its own and those of others.
pub struct QueuedJobs(sql::Listener);

impl QueuedJobs {
    /// Returns once a job was queued since the last call, or may have been. Never where no other process
    /// queues jobs; an error is a lost connection, and then one listens anew.
    pub async fn next(&mut self) -> Result<(), Error> {
        Ok(self.0.heard().await?)
    }
}

/// Why there was no room: where it is both, the owner's own doing.
async fn why_not(transaction: &mut Transaction, job: &NewJob) -> Result<Error, Error> {
    let sql = "select count(*) from jobs where owner = $1 and state in ('queued', 'running')";
    let count = sql::query_scalar(sql).bind(&job.account.owner);
    let n_jobs: i64 = count.fetch_one(transaction).await?;
    Ok(match job.account.quota {
        Some(quota) if quota <= n_jobs => Error::QuotaExceeded { quota },
        _ => Error::QueueFull { room: job.room },
    })
}

async fn is_queued_already(transaction: &mut Transaction, job: &NewJob) -> Result<bool, Error> {
    let input: Option<String> = sql::query_scalar("select input from jobs where id = $1")
        .bind(job.job_id.0)
        .fetch_optional(transaction)
        .await?;
    match input {
        Some(input) if input != job.input => Err(Error::IdInUse(job.job_id.0)),
        found => Ok(found.is_some()),
    }
}
