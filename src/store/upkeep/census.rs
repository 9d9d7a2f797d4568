//! Counts of the whole store for monitoring: jobs by kind and state, and bytes by type of data. The numbers
//! cover all owners, so only operators may see them.

use crate::store::jobs::{JobState, Kind};
use crate::store::resources::ResourceKind;
use crate::store::{Error, Store, sql};

/// Contents of the store at one time.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Census {
    /// Number of jobs by kind and state. Combinations without jobs are left out.
    pub jobs: Vec<(Kind, JobState, i64)>,
    /// Earliest time since which a queued job of usual priority could run, milliseconds since 1970; `None` if none could. A job that
    /// needs the result of another could run since that one was done.
    pub waiting_since_ms: Option<i64>,
    /// Size of the files by type of data, bytes. `uploads` counts unfinished uploads only.
    pub stored_bytes: Vec<(&'static str, i64)>,
    /// Announced size of all open uploads and of all bodies that are being received, bytes.
    pub announced_bytes: i64,
}

impl Store {
    /// Counts all jobs and bytes.
    pub async fn census(&self) -> Result<Census, Error> {
        let sql = "select kind, state, count(*) from jobs group by kind, state";
        let rows: Vec<(String, String, i64)> = sql::query(sql).fetch_all(&self.reader).await?;
        let jobs = rows.into_iter().map(|(kind, state, n_jobs)| {
            Ok((Kind::try_from(kind)?, JobState::try_from(state)?, n_jobs))
        });
        let jobs = jobs.collect::<Result<_, Error>>()?;
        let sql = "select min(case when a.finished_ms > j.run_at_ms then a.finished_ms else j.run_at_ms end) \
                   from jobs j left join jobs a on a.id = j.after_job \
                   where j.state = 'queued' and j.priority >= 0 and (j.after_job is null or a.state = 'done')";
        let waiting_since_ms = sql::query_scalar(sql).fetch_one(&self.reader).await?;
        let sources = ResourceKind::ALL.map(|kind| (kind.plural(), "size_bytes", kind.plural()));
        let uploads = (
            "uploads",
            "offset_bytes",
            "uploads where footage_id is null",
        );
        let parts = ("dataset_parts", "size_bytes", "job_parts");
        let mut stored_bytes = Vec::new();
        for (name, column, rows) in sources.into_iter().chain([parts, uploads]) {
            let sql = format!("select cast(coalesce(sum({column}), 0) as bigint) from {rows}");
            let n_bytes = sql::query_scalar(sql).fetch_one(&self.reader).await?;
            stored_bytes.push((name, n_bytes));
        }
        let sql = "select cast(coalesce(sum(size_bytes), 0) as bigint) from uploads where footage_id is null";
        let of_uploads: i64 = sql::query_scalar(sql).fetch_one(&self.reader).await?;
        Ok(Census {
            announced_bytes: of_uploads + self.incoming_bytes().cast_signed(),
            jobs,
            waiting_since_ms,
            stored_bytes,
        })
    }
}
