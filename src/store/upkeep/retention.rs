//! Deletion of data by its age (docs/explanation/promises.md, "Limited space"): resources that nobody used, and jobs that
//! made nothing.
//!
//! A resource stays if it is pinned, if a queued or running job works on it, or if anything that stays was made from it.
//! Jobs that are done belong to their results and are deleted with them.

use sqlx::types::Uuid;

use crate::config::Retention;
use crate::store::resources::{ResourceKind, is_dataset_of};
use crate::store::space::Amount;
use crate::store::{Error, Store, sql};

/// Kinds of resources in the order of their deletion: results before their sources. Views are deleted with their library.
const ORDER: [ResourceKind; 5] = [
    ResourceKind::Dataset,
    ResourceKind::Fish,
    ResourceKind::Flock,
    ResourceKind::Library,
    ResourceKind::Footage,
];

/// Statement that continues with the jobs to delete: those that ended without a result before `$1`, unless a job that
/// waited for them stays. Jobs of views stay with their library, whose views they can still make.
const OLD_JOBS: &str = "from jobs where state in ('failed', 'cancelled') and finished_ms < $1 and kind <> 'views' \
    and id not in ( \
    with recursive needed (id) as ( \
        select after_job from jobs where after_job is not null \
            and not (state in ('failed', 'cancelled') and finished_ms < $1) \
        union select f.after_job from jobs f join needed n on f.id = n.id where f.after_job is not null) \
    select id from needed)";

/// Result of a deletion by age.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Retired {
    /// Deleted resources by kind.
    pub resources: Vec<(ResourceKind, Amount)>,
    /// Number of deleted jobs that had failed or were cancelled.
    pub n_jobs: u64,
}

impl Retired {
    /// Returns the number of all resources and their total size.
    pub fn total(&self) -> Amount {
        let amounts = self.resources.iter().map(|(_, amount)| amount);
        amounts.fold(Amount::default(), |total, amount| Amount {
            n: total.n + amount.n,
            n_bytes: total.n_bytes + amount.n_bytes,
        })
    }
}

impl Store {
    /// Counts what [`Store::retire`] would delete. Changes nothing.
    pub async fn retirable(&self, retention: Retention, now_ms: i64) -> Result<Retired, Error> {
        let mut retired = Retired::default();
        if let Some(before_ms) = retention.unused_before_ms(now_ms) {
            for kind in ORDER {
                let mut amount = Amount::default();
                for (_, size_bytes) in self.unused(kind, before_ms).await? {
                    amount.n += 1;
                    amount.n_bytes += size_bytes;
                }
                retired.resources.push((kind, amount));
            }
        }
        if let Some(before_ms) = retention.jobs_before_ms(now_ms) {
            let sql = format!("select count(*) {OLD_JOBS}");
            let count = sql::query_scalar(sql).bind(before_ms);
            retired.n_jobs = count.fetch_one::<i64>(&self.reader).await?.unsigned_abs();
        }
        Ok(retired)
    }

    /// Deletes what is older than the settings allow. Each resource is deleted in a transaction of its own, which first
    /// checks that it is still unused.
    pub async fn retire(&self, retention: Retention, now_ms: i64) -> Result<Retired, Error> {
        let mut retired = Retired::default();
        if let Some(before_ms) = retention.unused_before_ms(now_ms) {
            for kind in ORDER {
                let amount = self.delete_unused(kind, before_ms).await?;
                retired.resources.push((kind, amount));
            }
        }
        if let Some(before_ms) = retention.jobs_before_ms(now_ms) {
            retired.n_jobs = self.prune_jobs(before_ms).await?;
        }
        if retired.total().n > 0 || retired.n_jobs > 0 {
            tracing::info!(
                n_resources = retired.total().n,
                n_bytes = retired.total().n_bytes,
                n_jobs = retired.n_jobs,
                "old data deleted"
            );
        }
        Ok(retired)
    }

    async fn delete_unused(&self, kind: ResourceKind, before_ms: i64) -> Result<Amount, Error> {
        let condition = format!(
            "select r.id from {table} r where r.id = $2 and not {kept} for update",
            table = kind.plural(),
            kept = kept(kind, "r")
        );
        let mut amount = Amount::default();
        for (id, size_bytes) in self.unused(kind, before_ms).await? {
            let condition = Some((condition.as_str(), before_ms));
            if self.delete_if(kind, id, condition).await? {
                amount.n += 1;
                amount.n_bytes += size_bytes;
            }
        }
        Ok(amount)
    }

    /// Returns the ids and sizes of the resources that nobody used since `before_ms` and that nothing needs.
    async fn unused(&self, kind: ResourceKind, before_ms: i64) -> Result<Vec<(Uuid, i64)>, Error> {
        let (table, kept) = (kind.plural(), kept(kind, "r"));
        let size = kind.size();
        let sql = format!("select r.id, {size} from {table} r where not {kept}");
        Ok(sql::query(sql)
            .bind(before_ms)
            .fetch_all(&self.reader)
            .await?)
    }

    /// Deletes jobs that failed or were cancelled before `before_ms`.
    async fn prune_jobs(&self, before_ms: i64) -> Result<u64, Error> {
        // The sweep removes the folders of the parts, which then have no rows.
        let delete = || async {
            let mut transaction = self.writer.begin().await?;
            let of_old_jobs = format!("job_id in (select id {OLD_JOBS})");
            for sql in [
                format!(
                    "delete from blobs where folder in (select folder from job_parts where {of_old_jobs})"
                ),
                format!("delete from job_parts where {of_old_jobs}"),
            ] {
                let delete = sql::query(sql).bind(before_ms);
                delete.execute(&mut transaction).await?;
            }
            let delete = sql::query(format!("delete {OLD_JOBS}")).bind(before_ms);
            let n_jobs = delete.execute(&mut transaction).await?;
            transaction.commit().await?;
            Ok(n_jobs)
        };
        self.reserve.lend(delete).await
    }
}

/// Returns the condition under which a row with this alias stays, with the time before which it is unused as `$1`.
fn kept(kind: ResourceKind, row: &str) -> String {
    let child = |child: ResourceKind, alias: &str, source: &str| {
        let (table, kept) = (child.plural(), kept(child, alias));
        format!(
            "or exists (select 1 from {table} {alias} where {alias}.{source} = {row}.id and {kept})"
        )
    };
    let job = |input: &str| {
        format!(
            "or exists (select 1 from jobs j where j.state in ('queued', 'running') \
             and upper(replace(json_extract(j.input, '$.{input}'), '-', '')) = hex({row}.id))"
        )
    };
    let needed = match kind {
        ResourceKind::Flock | ResourceKind::Fish | ResourceKind::Views | ResourceKind::Dataset => {
            String::new()
        }
        ResourceKind::Library => [
            dataset_of(row),
            child(ResourceKind::Flock, "k", "library_id"),
            child(ResourceKind::Fish, "v", "library_id"),
            job("library_id"),
        ]
        .join(" "),
        ResourceKind::Footage => [
            child(ResourceKind::Library, "l", "footage_id"),
            job("footage_id"),
        ]
        .join(" "),
    };
    format!("({row}.pinned or {row}.used_ms >= $1 {needed})")
}

/// Returns the condition that a data set of this library stays, or is being made.
fn dataset_of(row: &str) -> String {
    let (is_of, kept) = (
        is_dataset_of(&format!("{row}.id")),
        kept(ResourceKind::Dataset, "d"),
    );
    format!(
        "or exists (select 1 from jobs j left join datasets d on d.job_id = j.id \
         where {is_of} and (j.state in ('queued', 'running') or {kept}))"
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::store::fresh;
    use crate::store::jobs::Kind;
    use crate::store::jobs::enqueue::NewJob;
    use crate::store::owners::{Account, OwnerFilter};
    use flockreel_core::ids::JobId;

    fn job_after(after_job: Option<JobId>) -> NewJob {
        NewJob {
            job_id: JobId(Uuid::now_v7()),
            account: Account::local(),
            kind: Kind::Fish,
            input: "{}".into(),
            result_id: Uuid::now_v7(),
            after_job,
            priority: 0,
            max_queued: 100,
            is_small: false,
        }
    }

    #[tokio::test]
    async fn old_job_stays_while_a_job_that_waited_for_it_does() {
        let data = tempfile::tempdir().unwrap();
        let store = fresh::open(data.path()).await;
        let first = job_after(None);
        let second = job_after(Some(first.job_id));
        let third = job_after(Some(second.job_id));
        for job in [&first, &second, &third] {
            store.enqueue(job, 0).await.unwrap();
        }
        let cancel = store.cancel(first.job_id, &OwnerFilter::All, 0);
        cancel.await.unwrap();
        let day = 24 * 3600 * 1000;
        let retention = Retention {
            keep_days: 0,
            keep_jobs_days: 1,
        };
        // As if the last one had been tried again and had ended later.
        for (ended_ms, n_jobs) in [(day, 0), (0, 3)] {
            let later = sql::query("update jobs set finished_ms = $1 where id = $2");
            let later = later.bind(ended_ms).bind(third.job_id.0);
            later.execute(&store.writer).await.unwrap();
            let retirable = store.retirable(retention, day + 1).await.unwrap();
            let retired = store.retire(retention, day + 1).await.unwrap();
            assert_eq!((retirable.n_jobs, retired.n_jobs), (n_jobs, n_jobs));
        }
    }

    #[tokio::test]
    async fn ended_job_of_views_stays() {
        let data = tempfile::tempdir().unwrap();
        let store = fresh::open(data.path()).await;
        let views = NewJob {
            kind: Kind::Views,
            ..job_after(None)
        };
        store.enqueue(&views, 0).await.unwrap();
        let cancel = store.cancel(views.job_id, &OwnerFilter::All, 0);
        cancel.await.unwrap();
        let retention = Retention {
            keep_days: 0,
            keep_jobs_days: 1,
        };
        let retired = store.retire(retention, 10 * 24 * 3600 * 1000);
        assert_eq!(retired.await.unwrap().n_jobs, 0);
    }
}
