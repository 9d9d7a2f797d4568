//! Enqueue: a job comes to be, queued, unless its owner has as many as it may (RELIABILITY.md, R9).

use sqlx::types::Uuid;

use super::follow::{cancel_followers, fail_followers};
use super::{JobState, Kind};
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
    /// two at once cannot both be the last. A job after one that was cancelled, or has failed, ends at once as it
    /// would have, had it come before that. A job that is there already under its id, because its request comes again after a crash, is left as it is;
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
        end_with_predecessor(&mut transaction, job, now_ms).await?;
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

/// A job that ended before its follower came ends it now: nobody else would.
async fn end_with_predecessor(
    transaction: &mut Transaction,
    job: &NewJob,
    now_ms: i64,
) -> Result<(), Error> {
    let Some(before) = job.after_job else {
        return Ok(());
    };
    // Whoever ends it right now does so before or after all of this.
    let sql = "select state from jobs where id = $1 for update";
    let state = sql::query_scalar(sql).bind(before.0);
    let state: Option<String> = state.fetch_optional(&mut *transaction).await?;
    match state.as_deref().map(JobState::from_name).transpose()? {
        Some(JobState::Failed) => fail_followers(transaction, before.0, now_ms).await?,
        Some(JobState::Cancelled) => cancel_followers(transaction, before.0, now_ms).await?,
        _ => {}
    }
    Ok(())
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::code::Code;
    use crate::store::fresh;
    use crate::store::jobs::Change;
    use crate::store::owners::Reach;

    fn job_after(after_job: Option<JobId>) -> NewJob {
        NewJob {
            job_id: JobId(Uuid::now_v7()),
            account: Account::local(),
            kind: Kind::Fish,
            input: "{}".into(),
            result_id: Uuid::now_v7(),
            after_job,
            priority: 0,
            room: 100,
        }
    }

    #[tokio::test]
    async fn a_job_that_comes_after_the_end_of_the_one_it_waits_for_does_not_wait_for_ever() {
        let data = tempfile::tempdir().unwrap();
        let store = fresh::open(data.path()).await;
        let state_after = async |before: &NewJob| {
            let follower = job_after(Some(before.job_id));
            store.enqueue(&follower, 7).await.unwrap();
            let row = store.job(follower.job_id, &Reach::All).await;
            let row = row.unwrap().unwrap();
            (row.state, row.failure.map(|(code, _)| code))
        };
        let (failed, cancelled) = (job_after(None), job_after(None));
        store.enqueue(&failed, 0).await.unwrap();
        let waiting = state_after(&failed).await;
        assert_eq!(waiting, (JobState::Queued, None));
        let lease = store.claim(Uuid::now_v7(), 1, 10).await.unwrap().unwrap();
        let sentence = "it is no film";
        let fail = store.fail(&lease, Code::NotAVideo, sentence, None, 2);
        assert_eq!(fail.await.unwrap(), Change::Made);
        let late = state_after(&failed).await;
        assert_eq!(late, (JobState::Failed, Some(Code::InputFailed)));
        store.enqueue(&cancelled, 0).await.unwrap();
        store
            .cancel(cancelled.job_id, &Reach::All, 3)
            .await
            .unwrap();
        assert_eq!(state_after(&cancelled).await, (JobState::Cancelled, None));
    }
}
