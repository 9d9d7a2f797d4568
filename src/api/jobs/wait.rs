//! `Prefer: wait=N` (RFC 7240): an answer that waits up to N seconds, at most 60, for its job to end.
//! Polling must always do as well; a service that stops waits for nobody (RELIABILITY.md, R4).

use std::time::Duration;

use axum::extract::{Request, State};
use axum::http::{HeaderMap, HeaderName, HeaderValue, Method, StatusCode, header};
use axum::middleware::Next;
use axum::response::Response;
use tokio::time::{Instant, sleep};

use crate::api::AppState;
use crate::ids::JobId;
use crate::store::jobs::JobState;
use crate::store::jobs::read::JobRow;
use crate::store::owners::Reach;

const PREFER: HeaderName = HeaderName::from_static("prefer");
const MAX_WAIT_S: u64 = 60;
/// How often the job is looked at.
const LOOK: Duration = Duration::from_millis(200);

/// How long the sender is ready to wait, seconds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Wait(u64);

impl Wait {
    /// What the headers ask for; what cannot be read is no preference.
    pub(super) fn of(headers: &HeaderMap) -> Option<Wait> {
        let lines = headers.get_all(PREFER);
        let lines = lines.iter().filter_map(|line| line.to_str().ok());
        lines
            .flat_map(|line| line.split(','))
            .find_map(|preference| {
                let (name, value) = preference.split(';').next()?.split_once('=')?;
                let is_wait = name.trim().eq_ignore_ascii_case("wait");
                let wait_s: u64 = value.trim().trim_matches('"').parse().ok()?;
                is_wait.then_some(Wait(wait_s.min(MAX_WAIT_S)))
            })
    }

    /// Says in the answer that the preference was heard.
    pub(super) fn applied(self, headers: &mut HeaderMap) {
        if let Ok(value) = HeaderValue::from_str(&format!("wait={}", self.0)) {
            headers.insert(HeaderName::from_static("preference-applied"), value);
        }
    }

    /// The job once it has ended, or as it is when the time is up; none where there is no such job.
    pub(super) async fn for_end(
        self,
        state: &AppState,
        id: JobId,
    ) -> Result<Option<JobRow>, crate::store::Error> {
        let end = Instant::now() + Duration::from_secs(self.0);
        loop {
            let job = state.context.store.job(id, &Reach::All).await?;
            let is_running = job.as_ref().is_some_and(|job| !job.state.is_final());
            if !is_running || Instant::now() >= end || state.context.draining.is_cancelled() {
                return Ok(job);
            }
            tokio::select! {
                () = sleep(LOOK) => {}
                () = state.context.draining.cancelled() => {}
            }
        }
    }
}

/// An accepted job whose sender waits: 201 and the result's address where it is done in time.
pub(in crate::api) async fn wait_for_result(
    State(state): State<AppState>,
    request: Request,
    next: Next,
) -> Response {
    let wait = Wait::of(request.headers()).filter(|_| request.method() == Method::POST);
    let mut answer = next.run(request).await;
    let location = answer.headers().get(header::LOCATION);
    let job_id = location.and_then(|value| value.to_str().ok()?.strip_prefix("/v1/jobs/"));
    let job_id: Option<JobId> = job_id.and_then(|id| id.parse().ok());
    let (Some(wait), Some(job_id), StatusCode::ACCEPTED) = (wait, job_id, answer.status()) else {
        return answer;
    };
    wait.applied(answer.headers_mut());
    match wait.for_end(&state, job_id).await {
        Ok(Some(job)) if job.state == JobState::Done => {
            let result = HeaderValue::from_str(&super::result_of(&job));
            if let Ok(result) = result {
                answer.headers_mut().insert(header::LOCATION, result);
                answer.headers_mut().remove(header::RETRY_AFTER);
                *answer.status_mut() = StatusCode::CREATED;
            }
        }
        Ok(_) => {}
        Err(error) => tracing::warn!(%error, "a job could not be waited for"),
    }
    answer
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_wait_is_found_among_other_preferences_and_bounded() {
        let of = |text| {
            Wait::of(&HeaderMap::from_iter([(
                PREFER,
                HeaderValue::from_static(text),
            )]))
        };
        assert_eq!(of("respond-async, wait=5"), Some(Wait(5)));
        assert_eq!(of("Wait = 600; x=1"), Some(Wait(60)));
        assert_eq!(of("wait=soon"), None);
        assert_eq!(of("return=minimal"), None);
    }
}
