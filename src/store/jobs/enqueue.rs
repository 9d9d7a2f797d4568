//! Enqueue: adds a job to the queue within the limits of its owner and of the queue
//! (docs/explanation/promises.md, "Fair queue").

use sqlx::types::Uuid;

use super::follow::{cancel_followers, fail_followers};
use super::trace::{self, TraceParent};
use super::{JobState, Kind, Lease};
use crate::store::owners::{Account, Owner};
use crate::store::{Error, Store, Transaction, sql};
use flockreel_core::ids::JobId;

/// Named lock of transactions that add jobs.
pub(in crate::store) const QUEUE_LOCK: &str = "queue";
/// Name of the notification about new jobs.
pub(super) const QUEUED: &str = "flockreel_jobs";
/// Priority of jobs that nobody waits for: below the usual one.
const BACKGROUND_PRIORITY: i64 = -1;
/// SQL condition of the jobs that count against the limits of their owner and of the queue. Background jobs do not: each
/// belongs to a library, whose own job counted.
const COUNTED: &str = "state in ('queued', 'running') and priority >= 0";

/// A job to be queued.
#[derive(Clone, Debug)]
pub struct NewJob {
    /// Id of the job.
    pub job_id: JobId,
    /// Account that the job counts against.
    pub account: Account,
    /// Kind of the job.
    pub kind: Kind,
    /// Input of the job, JSON.
    pub input: String,
    /// Id that the result will have.
    pub result_id: Uuid,
    /// Job that makes the input; `None` if the input exists.
    pub after_job: Option<JobId>,
    /// Jobs of higher priority run first. The usual value is 0.
    pub priority: i64,
    /// Whether the job is expected to take little time.
    pub is_small: bool,
    /// Maximum number of queued and running jobs of all owners, including this one.
    pub max_queued: i64,
}

impl Store {
    /// Adds the job to the queue.
    ///
    /// Fails with [`Error::QuotaExceeded`] if the owner has too many queued and running jobs, and with
    /// [`Error::QueueFull`] if all owners together have. Counting and adding happen under one lock, so that
    /// simultaneous calls cannot exceed the limits.
    ///
    /// A job that depends on a failed or cancelled job ends immediately in the same state. A repeated call
    /// with the same job id, as after a crash, changes nothing. It fails with [`Error::IdInUse`] if the input
    /// differs.
    pub async fn enqueue(&self, job: &NewJob, now_ms: i64) -> Result<(), Error> {
        let mut transaction = self.begin().await?;
        transaction.lock(QUEUE_LOCK).await?;
        if is_queued_already(&mut transaction, job).await? {
            return Ok(());
        }
        let added = sql::query(format!(
            "insert into jobs (id, kind, state, input, result_id, after_job, priority, run_at_ms, \
             created_ms, owner, small, traceparent) select $1, $2, 'queued', $3, $4, $5, $6, $7, $7, $8, $11, $12 \
             where ($9 is null or $9 > (select count(*) from jobs where owner = $8 and {COUNTED})) \
             and $10 > (select count(*) from jobs where {COUNTED})"
        ))
        .bind(job.job_id.0)
        .bind(job.kind.name())
        .bind(&job.input)
        .bind(job.result_id)
        .bind(job.after_job.map(|id| id.0))
        .bind(job.priority)
        .bind(now_ms)
        .bind(&job.account.owner)
        .bind(job.account.quota)
        .bind(job.max_queued)
        .bind(job.is_small)
        .bind(trace::current().as_ref().map(TraceParent::as_str))
        .execute(&mut transaction)
        .await?;
        if added == 0 {
            return Err(exceeded_limit(&mut transaction, job).await?);
        }
        end_with_predecessor(&mut transaction, job, now_ms).await?;
        transaction.notify(QUEUED).await?;
        transaction.commit().await?;
        tracing::info!(job.id = %job.job_id, job.kind = job.kind.name(), "job queued");
        Ok(())
    }

    /// Subscribes to notifications about new jobs of any process.
    pub async fn listen(&self) -> Result<QueuedJobs, Error> {
        Ok(QueuedJobs(self.reader.listen(QUEUED).await?))
    }
}

/// Subscription to notifications about new jobs, from this process and others.
pub struct QueuedJobs(sql::Listener);

impl QueuedJobs {
    /// Returns when a job may have been queued since the last call. Never returns on SQLite.
    ///
    /// An error means that the connection is lost. The caller must then subscribe again.
    pub async fn next(&mut self) -> Result<(), Error> {
        Ok(self.0.next().await?)
    }
}

/// Adds the job that makes the views of a library, after the analysis that made it. It has the owner and the trace of
/// the analysis.
pub(super) async fn enqueue_views(
    transaction: &mut Transaction,
    analysis: &Lease,
    now_ms: i64,
) -> Result<(), Error> {
    let input = serde_json::json!({"library_id": analysis.result_id});
    let job_id = Uuid::now_v7();
    sql::query(
        "insert into jobs (id, kind, state, input, result_id, after_job, priority, run_at_ms, created_ms, owner, \
         small, traceparent) select $1, $2, 'queued', $3, $4, id, $5, $6, $6, owner, $7, traceparent \
         from jobs where id = $8",
    )
    .bind(job_id)
    .bind(Kind::Views.name())
    .bind(input.to_string().as_str())
    .bind(Uuid::now_v7())
    .bind(BACKGROUND_PRIORITY)
    .bind(now_ms)
    .bind(false)
    .bind(analysis.job_id.0)
    .execute(&mut *transaction)
    .await?;
    transaction.notify(QUEUED).await?;
    tracing::info!(job.id = %job_id, job.kind = Kind::Views.name(), "job queued");
    Ok(())
}

/// Ends a new job whose predecessor has already failed or been cancelled. No later event would end it.
async fn end_with_predecessor(
    transaction: &mut Transaction,
    job: &NewJob,
    now_ms: i64,
) -> Result<(), Error> {
    let Some(before) = job.after_job else {
        return Ok(());
    };
    // With the row lock, a concurrent end of the predecessor happens completely before or after this
    // transaction.
    let sql = "select state from jobs where id = $1 for update";
    let state = sql::query_scalar(sql).bind(before.0);
    let state: Option<String> = state.fetch_optional(&mut *transaction).await?;
    match state.map(JobState::try_from).transpose()? {
        Some(JobState::Failed) => fail_followers(transaction, before.0, now_ms).await?,
        Some(JobState::Cancelled) => cancel_followers(transaction, before.0, now_ms).await?,
        _ => {}
    }
    Ok(())
}

/// Returns the limit that refused the job. If both limits are reached, returns that of the owner.
async fn exceeded_limit(transaction: &mut Transaction, job: &NewJob) -> Result<Error, Error> {
    let n_jobs = n_under_way(transaction, &job.account.owner).await?;
    Ok(match job.account.quota {
        Some(quota) if quota <= n_jobs => Error::QuotaExceeded { quota },
        _ => Error::QueueFull {
            max_queued: job.max_queued,
        },
    })
}

/// Fails if more jobs are queued and running than the account and the queue allow.
pub(super) async fn check_limits(
    transaction: &mut Transaction,
    account: &Account,
    max_queued: i64,
) -> Result<(), Error> {
    if let Some(quota) = account.quota
        && n_under_way(transaction, &account.owner).await? > quota
    {
        return Err(Error::QuotaExceeded { quota });
    }
    let count = sql::query_scalar(format!("select count(*) from jobs where {COUNTED}"));
    let n_jobs: i64 = count.fetch_one(transaction).await?;
    if n_jobs > max_queued {
        return Err(Error::QueueFull { max_queued });
    }
    Ok(())
}

async fn n_under_way(transaction: &mut Transaction, owner: &Owner) -> Result<i64, sqlx::Error> {
    let sql = format!("select count(*) from jobs where owner = $1 and {COUNTED}");
    let count = sql::query_scalar(sql).bind(owner);
    count.fetch_one(transaction).await
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::store::fresh;
    use crate::store::jobs::Change;
    use crate::store::jobs::fail::Shown;
    use crate::store::owners::OwnerFilter;
    use flockreel_core::code::Code;

    fn job_after(after_job: Option<JobId>) -> NewJob {
        NewJob {
            job_id: JobId(Uuid::now_v7()),
            account: Account::local(),
            kind: Kind::Fish,
            input: "{}".into(),
            result_id: Uuid::now_v7(),
            after_job,
            priority: 0,
            is_small: false,
            max_queued: 100,
        }
    }

    #[tokio::test]
    async fn new_follower_of_an_ended_job_ends_at_once() {
        let data = tempfile::tempdir().unwrap();
        let store = fresh::open(data.path()).await;
        let state_after = async |before: &NewJob| {
            let follower = job_after(Some(before.job_id));
            store.enqueue(&follower, 7).await.unwrap();
            let row = store.job(follower.job_id, &OwnerFilter::All).await;
            let row = row.unwrap().unwrap();
            (row.state, row.failure().map(|failure| failure.code))
        };
        let (failed, cancelled) = (job_after(None), job_after(None));
        store.enqueue(&failed, 0).await.unwrap();
        let waiting = state_after(&failed).await;
        assert_eq!(waiting, (JobState::Queued, None));
        let lease = store.claim(Uuid::now_v7(), 1, 10).await.unwrap().unwrap();
        let sentence = "it is no film";
        let fail = store.fail(&lease, Code::NotAVideo, sentence, Shown::default(), 2);
        assert_eq!(fail.await.unwrap(), Change::Made);
        let late = state_after(&failed).await;
        assert_eq!(late, (JobState::Failed, Some(Code::InputFailed)));
        store.enqueue(&cancelled, 0).await.unwrap();
        store
            .cancel(cancelled.job_id, &OwnerFilter::All, 3)
            .await
            .unwrap();
        assert_eq!(state_after(&cancelled).await, (JobState::Cancelled, None));
    }
}
