//! Reading jobs: one, a page, the one that makes a given result.

use sqlx::types::Uuid;

use super::{JobState, Kind};
use crate::code::Code;
use crate::ids::JobId;
use crate::store::owners::Reach;
use crate::store::{Error, Store};

/// One job as people see it.
#[derive(Clone, Debug, PartialEq)]
pub struct JobRow {
    /// Its id.
    pub id: JobId,
    /// What it is.
    pub kind: Kind,
    /// Where it stands.
    pub state: JobState,
    /// The id of the result that it makes.
    pub result_id: Uuid,
    /// The id of the footage or library that it works on; `None` for a sample, which needs neither.
    pub subject_id: Option<Uuid>,
    /// Whether somebody asked to cancel it.
    pub cancel_requested: bool,
    /// How often it has been tried.
    pub attempt: i64,
    /// The stage under way, while running.
    pub stage: Option<String>,
    /// How much of the whole is done, 0..=1.
    pub progress: f64,
    /// Why it failed.
    pub failure: Option<(Code, String)>,
    /// Whether there is a picture of that.
    pub has_picture: bool,
    /// When it was queued, first claimed and ended, milliseconds since 1970.
    pub created_ms: i64,
    /// See `created_ms`.
    pub started_ms: Option<i64>,
    /// See `created_ms`.
    pub finished_ms: Option<i64>,
}

/// The columns of a [`Row`].
macro_rules! columns {
    () => {
        "id, kind, state, result_id, cancel_requested, attempt, stage, progress, code, detail, \
         created_ms, started_ms, finished_ms, refused_jpeg is not null as has_picture, \
         case kind when 'sample' then null when 'analysis' then json_extract(input, '$.footage_id') \
         else json_extract(input, '$.library_id') end as subject"
    };
}
pub(super) use columns;

#[derive(sqlx::FromRow)]
pub(super) struct Row {
    id: Uuid,
    kind: String,
    state: String,
    result_id: Uuid,
    cancel_requested: bool,
    attempt: i64,
    stage: Option<String>,
    progress: f64,
    code: Option<String>,
    detail: Option<String>,
    created_ms: i64,
    started_ms: Option<i64>,
    finished_ms: Option<i64>,
    has_picture: bool,
    subject: Option<String>,
}

impl Store {
    /// One job, if it is there and within reach.
    pub async fn job(&self, id: JobId, reach: &Reach) -> Result<Option<JobRow>, Error> {
        let sql = concat!(
            "select ",
            columns!(),
            " from jobs where id = $1 and ($2 is null or owner = $2)"
        );
        let row: Option<Row> = self.one_of(sql, id.0, reach).await?;
        row.map(JobRow::try_from).transpose()
    }

    /// The picture of why a job failed, JPEG, if it has one and is within reach.
    pub async fn refused_jpeg(&self, id: JobId, reach: &Reach) -> Result<Option<Vec<u8>>, Error> {
        let sql = "select refused_jpeg from jobs \
                   where id = $1 and ($2 is null or owner = $2) and refused_jpeg is not null";
        let row: Option<(Vec<u8>,)> = self.one_of(sql, id.0, reach).await?;
        Ok(row.map(|(jpeg,)| jpeg))
    }

    /// The job that makes, or made, the result of that id, if it is within reach.
    pub async fn job_of_result(
        &self,
        result: Uuid,
        reach: &Reach,
    ) -> Result<Option<JobRow>, Error> {
        let sql = concat!(
            "select ",
            columns!(),
            " from jobs where result_id = $1 and ($2 is null or owner = $2)"
        );
        let row: Option<Row> = self.one_of(sql, result, reach).await?;
        row.map(JobRow::try_from).transpose()
    }

    /// The newest jobs, at most `limit`, older than `before`.
    pub async fn list_jobs(
        &self,
        limit: i64,
        before: Option<Uuid>,
        reach: &Reach,
    ) -> Result<Vec<JobRow>, Error> {
        let sql = concat!(
            "select ",
            columns!(),
            " from jobs where ($1 is null or id < $1) \
             and ($3 is null or owner = $3) order by id desc limit $2"
        );
        let rows: Vec<Row> = self.newest_of(sql, limit, before, reach).await?;
        rows.into_iter().map(JobRow::try_from).collect()
    }
}

impl TryFrom<Row> for JobRow {
    type Error = Error;

    fn try_from(row: Row) -> Result<JobRow, Error> {
        let failure = row.code.map(|name| {
            let code = Code::from_name(&name).unwrap_or(Code::Internal);
            (code, row.detail.unwrap_or_default())
        });
        Ok(JobRow {
            id: JobId(row.id),
            kind: Kind::from_name(&row.kind)?,
            state: JobState::from_name(&row.state)?,
            result_id: row.result_id,
            subject_id: row.subject.and_then(|id| id.parse().ok()),
            cancel_requested: row.cancel_requested,
            attempt: row.attempt,
            stage: row.stage,
            progress: row.progress,
            failure,
            has_picture: row.has_picture,
            created_ms: row.created_ms,
            started_ms: row.started_ms,
            finished_ms: row.finished_ms,
        })
    }
}
