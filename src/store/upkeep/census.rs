//! How much there is: jobs by kind and state, bytes by what they are (ECOSYSTEM.md, metrics). Of the whole
//! store, whoever's it is, so it is asked for by those who run the service alone.

use crate::store::jobs::{JobState, Kind};
use crate::store::{Error, Store, sql};

/// What there is at one time.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Census {
    /// Jobs of a kind in a state; what is not named is none.
    pub jobs: Vec<(Kind, JobState, i64)>,
    /// When the job that is queued longest was queued, milliseconds since 1970.
    pub oldest_queued_ms: Option<i64>,
    /// Bytes of the files of each noun, and of uploads under way.
    pub stored_bytes: Vec<(&'static str, i64)>,
}

const STORED: [(&str, &str); 5] = [
    (
        "footage",
        "select cast(coalesce(sum(size_bytes), 0) as bigint) from footage",
    ),
    (
        "libraries",
        "select cast(coalesce(sum(size_bytes), 0) as bigint) from libraries",
    ),
    (
        "flocks",
        "select cast(coalesce(sum(size_bytes), 0) as bigint) from flocks",
    ),
    (
        "fish",
        "select cast(coalesce(sum(size_bytes), 0) as bigint) from fish",
    ),
    (
        "uploads",
        "select cast(coalesce(sum(offset_bytes), 0) as bigint) from uploads where footage_id is null",
    ),
];

impl Store {
    /// Counts everything.
    pub async fn census(&self) -> Result<Census, Error> {
        let sql = "select kind, state, count(*) from jobs group by kind, state";
        let rows: Vec<(String, String, i64)> = sql::query(sql).fetch_all(&self.reader).await?;
        let jobs = rows.iter().map(|(kind, state, n_jobs)| {
            Ok((Kind::from_name(kind)?, JobState::from_name(state)?, *n_jobs))
        });
        let jobs = jobs.collect::<Result<_, Error>>()?;
        let sql = "select min(created_ms) from jobs where state = 'queued'";
        let oldest_queued_ms = sql::query_scalar(sql).fetch_one(&self.reader).await?;
        let mut stored_bytes = Vec::with_capacity(STORED.len());
        for (noun, sql) in STORED {
            let n_bytes = sql::query_scalar(sql).fetch_one(&self.reader).await?;
            stored_bytes.push((noun, n_bytes));
        }
        Ok(Census {
            jobs,
            oldest_queued_ms,
            stored_bytes,
        })
    }
}
