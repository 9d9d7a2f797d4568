//! Queries for jobs: one job, a page of jobs, or the job of a result.

use sqlx::types::Uuid;

use super::retry::Refusal;
use super::{JobState, Kind};
use crate::store::owners::OwnerFilter;
use crate::store::{Error, Store};
use flockreel_core::code::Code;
use flockreel_core::ids::JobId;

/// Statement that selects the jobs of all owners as [`JobRow`]s. The table has the alias `r`.
pub(super) const SELECT: &str = "select id, kind, state, result_id, cancel_requested, attempt, stage, \
    progress, code, detail, mends, created_ms, started_ms, finished_ms, refused_jpeg is not null as has_picture, \
    (select b.state from jobs b where b.id = r.after_job) as state_before, \
    case kind when 'sample' then null when 'analysis' then json_extract(input, '$.footage_id') \
    when 'dataset' then json_extract(input, '$.library_ids[0]') \
    else json_extract(input, '$.library_id') end as subject, \
    case when kind = 'analysis' and state = 'failed' then json_extract(input, '$.params') end as params from jobs r";

/// One job as shown to users.
#[derive(Clone, Debug, PartialEq, sqlx::FromRow)]
pub struct JobRow {
    /// Id of the job.
    #[sqlx(try_from = "Uuid")]
    pub id: JobId,
    /// Kind of the job.
    #[sqlx(try_from = "String")]
    pub kind: Kind,
    /// State of the job.
    #[sqlx(try_from = "String")]
    pub state: JobState,
    /// Id of the result that the job makes.
    pub result_id: Uuid,
    subject: Option<String>,
    /// Whether a user asked to cancel the job.
    pub cancel_requested: bool,
    /// Number of attempts so far.
    pub attempt: i64,
    /// Current stage; `None` before the first one and after the end.
    pub stage: Option<String>,
    /// Completed share of the job, 0..=1.
    pub progress: f64,
    code: Option<String>,
    detail: Option<String>,
    mends: Option<String>,
    params: Option<String>,
    state_before: Option<String>,
    /// Whether a picture shows the reason of the failure.
    pub has_picture: bool,
    /// Time at which the job was queued, milliseconds since 1970.
    pub created_ms: i64,
    /// Time of the first claim, milliseconds since 1970.
    pub started_ms: Option<i64>,
    /// Time at which the job ended, milliseconds since 1970.
    pub finished_ms: Option<i64>,
}

/// Reason why a job failed.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Failure {
    /// Stable error code.
    pub code: Code,
    /// Description of this failure.
    pub detail: String,
    /// List of changes of the request that may mend it, JSON. `None` if none was stored.
    pub mends: Option<String>,
    /// Parameters of a failed analysis, JSON.
    pub params: Option<String>,
}

impl JobRow {
    /// Returns the id of the footage or library that is the input; `None` for a sample.
    pub fn subject_id(&self) -> Option<Uuid> {
        self.subject.as_ref()?.parse().ok()
    }

    /// Returns why the job failed; `None` unless it failed.
    pub fn failure(&self) -> Option<Failure> {
        let code = self.code.as_deref()?;
        Some(Failure {
            code: Code::from_name(code).unwrap_or(Code::Internal),
            detail: self.detail.clone().unwrap_or_default(),
            mends: self.mends.clone(),
            params: self.params.clone(),
        })
    }
}

impl JobRow {
    /// Returns whether a user may have the job tried again.
    pub fn is_retriable(&self) -> bool {
        let code = self.code.as_deref().and_then(Code::from_name);
        let before = self.state_before.clone();
        let before = before.and_then(|state| JobState::try_from(state).ok());
        Refusal::of(self.state, code, before).is_none()
    }
}

impl Store {
    /// Returns the job if it exists and is visible to the caller.
    pub async fn job(&self, id: JobId, owners: &OwnerFilter) -> Result<Option<JobRow>, Error> {
        self.visible_row(SELECT, "id", id.0, owners).await
    }

    /// Returns the job that makes or made this result, if it is visible to the caller.
    pub async fn job_of_result(
        &self,
        result: Uuid,
        owners: &OwnerFilter,
    ) -> Result<Option<JobRow>, Error> {
        self.visible_row(SELECT, "result_id", result, owners).await
    }

    /// Returns the picture that shows why a job failed (JPEG), if it has one and is visible to the caller.
    pub async fn refused_jpeg(
        &self,
        id: JobId,
        owners: &OwnerFilter,
    ) -> Result<Option<Vec<u8>>, Error> {
        let select = "select refused_jpeg from jobs r";
        let row: Option<(Option<Vec<u8>>,)> = self.visible_row(select, "id", id.0, owners).await?;
        Ok(row.and_then(|(jpeg,)| jpeg))
    }

    /// Returns the newest jobs with ids less than `before`, at most `limit`.
    pub async fn list_jobs(
        &self,
        limit: i64,
        before: Option<Uuid>,
        owners: &OwnerFilter,
    ) -> Result<Vec<JobRow>, Error> {
        self.newest_visible_rows(SELECT, (limit, before), owners, ("", |query| query))
            .await
    }
}
