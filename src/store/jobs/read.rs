//! Queries for jobs: one job, a page of jobs, or the job of a result.

use sqlx::types::Uuid;

use super::{JobState, Kind};
use crate::code::Code;
use crate::ids::JobId;
use crate::store::owners::Reach;
use crate::store::{Error, Store};

/// One job as shown to users.
#[derive(Clone, Debug, PartialEq)]
pub struct JobRow {
    /// Id of the job.
    pub id: JobId,
    /// Kind of the job.
    pub kind: Kind,
    /// State of the job.
    pub state: JobState,
    /// Id of the result that the job makes.
    pub result_id: Uuid,
    /// Id of the footage or library that is the input; `None` for a sample.
    pub subject_id: Option<Uuid>,
    /// Whether a user asked to cancel the job.
    pub cancel_requested: bool,
    /// Number of attempts so far.
    pub attempt: i64,
    /// Current stage; for a failed or cancelled job the last one, if known.
    pub stage: Option<String>,
    /// Completed share of the job, 0..=1.
    pub progress: f64,
    /// Error code and message of a failed job.
    pub failure: Option<(Code, String)>,
    /// Whether a picture shows the reason of the failure.
    pub has_picture: bool,
    /// Time at which the job was queued, milliseconds since 1970.
    pub created_ms: i64,
    /// Time of the first claim, milliseconds since 1970.
    pub started_ms: Option<i64>,
    /// Time at which the job ended, milliseconds since 1970.
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
    /// Returns the job if it exists and is visible to the caller.
    pub async fn job(&self, id: JobId, reach: &Reach) -> Result<Option<JobRow>, Error> {
        let sql = concat!(
            "select ",
            columns!(),
            " from jobs where id = $1 and ($2 is null or owner = $2)"
        );
        let row: Option<Row> = self.one_of(sql, id.0, reach).await?;
        row.map(JobRow::try_from).transpose()
    }

    /// Returns the picture that shows why a job failed (JPEG), if it has one and is visible to the caller.
    pub async fn refused_jpeg(&self, id: JobId, reach: &Reach) -> Result<Option<Vec<u8>>, Error> {
        let sql = "select refused_jpeg from jobs \
                   where id = $1 and ($2 is null or owner = $2) and refused_jpeg is not null";
        let row: Option<(Vec<u8>,)> = self.one_of(sql, id.0, reach).await?;
        Ok(row.map(|(jpeg,)| jpeg))
    }

    /// Returns the job that makes or made this result, if it is visible to the caller.
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

    /// Returns the newest jobs with ids less than `before`, at most `limit`.
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
