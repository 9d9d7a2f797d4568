//! The views of a library: `film.mp4` and `overlay.mp4`, which a job of their own makes when the library is done. They
//! have the addresses of files of the library, and a state.

use serde::Serialize;
use utoipa::ToSchema;
use uuid::Uuid;

use crate::api::extract::Access;
use crate::api::jobs::absent_result_of;
use crate::api::problem::Problem;
use crate::jobs::views::{FILM, OVERLAY};
use crate::store::jobs::JobState;
use crate::store::resources::Library;
use flockreel_core::code::Code;
use flockreel_core::ids::JobId;

/// State of the views of a library: `film.mp4` and `overlay.mp4`.
#[derive(Debug, Serialize, ToSchema)]
pub(in crate::api) struct ViewsState {
    /// `making` (queued or running), `done`, or `failed` (or cancelled).
    state: &'static str,
    /// Job that makes the views. null for a library of an older version, which was stored with its views.
    job_id: Option<Uuid>,
}

impl ViewsState {
    /// Returns the state of the views of a library.
    pub(super) fn of(library: &Library) -> Result<ViewsState, Problem> {
        Ok(ViewsState {
            state: match library.views_state()? {
                JobState::Queued | JobState::Running => "making",
                JobState::Done => "done",
                JobState::Failed | JobState::Cancelled => "failed",
            },
            job_id: library.views_job_id,
        })
    }
}

/// Returns the folder of a file of a library. Fails with `making` for a file of the views while their job has not ended,
/// and with the code of the job if that failed or was cancelled.
pub(super) async fn folder_of<'a>(
    access: &Access,
    library: &'a Library,
    name: &str,
) -> Result<&'a str, Problem> {
    if ![FILM, OVERLAY].contains(&name) {
        return Ok(&library.folder);
    }
    let (state, job_id) = (library.views_state()?, library.views_job_id);
    let Some(job_id) = job_id.filter(|_| state != JobState::Done) else {
        return Ok(library.views_folder());
    };
    if !state.is_final() {
        let sentence = format!("{name} is being made: /v1/jobs/{job_id}");
        return Err(Problem::new(Code::Making, sentence));
    }
    let job = (access.store()).job(JobId(job_id), &access.caller.owners);
    let job = job.await?.ok_or_else(Problem::not_found)?;
    let mut problem = absent_result_of(&job);
    if job.is_retriable() {
        problem.detail += &format!(". To start it again: POST /v1/jobs/{job_id}/retry");
    }
    Err(problem)
}
