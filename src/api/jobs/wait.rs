//! `Prefer: wait=N` (RFC 7240): the response waits up to N seconds, at most 60, until its job ends.
//!
//! Waiting is a convenience: polling gives the same results. When the service stops, all waits end at once
//! (docs/explanation/promises.md, "Graceful stop").

use std::time::Duration;

use axum::extract::{Request, State};
use axum::http::{HeaderMap, HeaderName, HeaderValue, Method, StatusCode, header};
use axum::middleware::Next;
use axum::response::Response;
use tokio::time::{Instant, sleep};

use crate::api::AppState;
use crate::store::jobs::JobState;
use crate::store::jobs::read::JobRow;
use crate::store::owners::OwnerFilter;
use flockreel_core::ids::JobId;

const PREFER: HeaderName = HeaderName::from_static("prefer");
/// Longest wait, seconds. Free choice.
const MAX_WAIT_S: u64 = 60;
/// Interval between two queries of the job. Free choice.
const POLL_INTERVAL: Duration = Duration::from_millis(200);

/// Time that the client is willing to wait, seconds, at most [`MAX_WAIT_S`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Wait(u64);

impl Wait {
    /// Returns the wait that the headers ask for. A malformed preference is ignored.
    pub(super) fn from_headers(headers: &HeaderMap) -> Option<Wait> {
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

    /// Adds `Preference-Applied` to the headers of the response.
    pub(super) fn mark_applied(self, headers: &mut HeaderMap) {
        if let Ok(value) = HeaderValue::from_str(&format!("wait={}", self.0)) {
            headers.insert(HeaderName::from_static("preference-applied"), value);
        }
    }

    /// Waits until the job has ended or the time is up, and returns its state. Returns `None` if there is no
    /// such job.
    pub(super) async fn until_ended(
        self,
        state: &AppState,
        id: JobId,
    ) -> Result<Option<JobRow>, crate::store::Error> {
        let end = Instant::now() + Duration::from_secs(self.0);
        loop {
            let job = state.context.store.job(id, &OwnerFilter::All).await?;
            let is_running = job.as_ref().is_some_and(|job| !job.state.is_final());
            if !is_running || Instant::now() >= end || state.context.draining.is_cancelled() {
                return Ok(job);
            }
            tokio::select! {
                () = sleep(POLL_INTERVAL) => {}
                () = state.context.draining.cancelled() => {}
            }
        }
    }
}

/// Middleware: waits for the job that a POST with `Prefer: wait=N` has queued. If the job is done in time,
/// the response is 201 with the address of the result in `Location`.
pub(in crate::api) async fn wait_for_result(
    State(state): State<AppState>,
    request: Request,
    next: Next,
) -> Response {
    let wait = Wait::from_headers(request.headers()).filter(|_| request.method() == Method::POST);
    let mut answer = next.run(request).await;
    let location = answer.headers().get(header::LOCATION);
    let job_id = location.and_then(|value| value.to_str().ok()?.strip_prefix("/v1/jobs/"));
    let job_id: Option<JobId> = job_id.and_then(|id| id.parse().ok());
    let (Some(wait), Some(job_id), StatusCode::ACCEPTED) = (wait, job_id, answer.status()) else {
        return answer;
    };
    wait.mark_applied(answer.headers_mut());
    match wait.until_ended(&state, job_id).await {
        Ok(Some(job)) if job.state == JobState::Done => {
            let result = HeaderValue::from_str(&super::result_path(&job));
            if let Ok(result) = result {
                answer.headers_mut().insert(header::LOCATION, result);
                answer.headers_mut().remove(header::RETRY_AFTER);
                *answer.status_mut() = StatusCode::CREATED;
            }
        }
        Ok(_) => {}
        Err(error) => tracing::warn!(%error, "the wait for a job failed"),
    }
    answer
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn wait_is_parsed_among_other_preferences_and_limited() {
        let of = |text| {
            Wait::from_headers(&HeaderMap::from_iter([(
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
