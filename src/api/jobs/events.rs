//! Jobs as server-sent events: one stream for all jobs of a caller, which the page uses, and one stream for a
//! single job, for scripts. Each event holds the whole state of a job, so a lost or repeated event does no
//! harm. Polling works as well.
//!
//! The id of an event of `/v1/events` is the time of the query that found it. A client that reconnects with
//! this id also gets the jobs that ended in the meantime. It may get some twice, because queries overlap: the
//! clocks of the processes that end jobs may differ a little.

use std::collections::{BTreeMap, VecDeque};
use std::convert::Infallible;
use std::time::Duration;

use axum::body::Body;
use axum::http::{HeaderMap, Response};
use axum::response::IntoResponse;
use axum::response::sse::{Event, KeepAlive, Sse};
use futures_util::stream::{Stream, unfold};
use serde_json::json;
use utoipa::ToSchema;
use uuid::Uuid;

use super::{JobView, find, is_final};
use crate::api::extract::{Access, Id};
use crate::api::problem::{Answer, ProblemBody};
use crate::jobs::clock::now_ms;
use crate::store;
use crate::store::jobs::read::JobRow;
use flockreel_core::ids::JobId;

/// Interval between two queries of a stream: as often as workers store progress.
const POLL_INTERVAL: Duration = Duration::from_millis(500);
/// Overlap of successive queries, ms, for changes that were written late. Free choice.
const OVERLAP_MS: i64 = 10_000;
/// Longest interruption of a stream after which missed changes are still sent, ms. Free choice.
const MAX_RESUME_MS: i64 = 3_600_000;
/// Time after which a client should reconnect. Free choice.
const RECONNECT_DELAY: Duration = Duration::from_secs(1);

/// Data of an event `gone`: the job was deleted with its result.
#[derive(ToSchema)]
#[expect(
    dead_code,
    reason = "it only describes the event in the OpenAPI document"
)]
pub(in crate::api) struct JobGone {
    /// Id of the deleted job.
    id: Uuid,
}

/// One server-sent event.
#[derive(ToSchema)]
#[expect(
    dead_code,
    reason = "it only describes the streams in the OpenAPI document"
)]
pub(in crate::api) struct JobEvent {
    /// `job` or `gone`.
    event: String,
    /// JSON. For `job` the same as GET /v1/jobs/{id}, for `gone` an object with the `id` of the job.
    data: String,
    /// Value to send as Last-Event-ID when reconnecting. Absent in the stream of a single job.
    id: Option<String>,
}

/// Follow all jobs as server-sent events.
///
/// The stream starts with all queued and running jobs. Then it sends an event `job` for every change, and
/// `gone` for a deleted job. With `Last-Event-ID` it also sends the jobs that ended since then, at most an
/// hour ago.
///
/// The stream ends when the token or session is no longer valid, and when the service stops.
#[utoipa::path(get, path = "/v1/events",
    params(("Last-Event-ID" = Option<String>, Header, description = "id of the last event received")),
    responses(
    (status = 200, content_type = "text/event-stream", body = JobEvent),
    (status = "4XX", body = ProblemBody, content_type = "application/problem+json"),
))]
pub(in crate::api) async fn get_events(access: Access, headers: HeaderMap) -> Response<Body> {
    let last = headers.get("last-event-id");
    let last_ms = last.and_then(|id| id.to_str().ok()?.parse().ok());
    let last_ms = last_ms.map(|id_ms| resume_time(id_ms, now_ms()));
    let stream = JobStream {
        access,
        seen: BTreeMap::new(),
        ready: VecDeque::from([Event::default().retry(RECONNECT_DELAY)]),
        last_ms,
        queried_ms: None,
    };
    answer(unfold(stream, async |mut stream| {
        let event = stream.next().await?;
        Some((Ok(event), stream))
    }))
}

/// Follow one job as server-sent events.
///
/// The stream sends an event `job` with the current state and after every change. It ends after the final
/// state, when the token or session is no longer valid, and when the service stops.
#[utoipa::path(get, path = "/v1/jobs/{id}/events", params(("id" = Uuid, Path)), responses(
    (status = 200, content_type = "text/event-stream", body = JobEvent),
    (status = "4XX", body = ProblemBody, content_type = "application/problem+json"),
))]
pub(in crate::api) async fn get_job_events(access: Access, Id(id): Id) -> Answer {
    let job = find(&access, JobId(id)).await?;
    let start = (access, None, Some(job));
    let events = unfold(start, async |(access, last, first)| {
        let job = match first {
            Some(first) => first,
            None => next_change(&access, last.as_ref()?).await?,
        };
        let event = Event::default().event("job").json_data(&job).ok()?;
        Some((Ok(event), (access, Some(job), None)))
    });
    Ok(answer(events))
}

fn answer<S>(events: S) -> Response<Body>
where
    S: Stream<Item = Result<Event, Infallible>> + Send + 'static,
{
    let events = Sse::new(events).keep_alive(KeepAlive::default());
    // This header tells a proxy not to buffer the events.
    ([("x-accel-buffering", "no")], events).into_response()
}

/// Returns the next state that differs from `last`, or `None` after a final state or if the stream must end.
async fn next_change(access: &Access, last: &JobView) -> Option<JobView> {
    while !is_final(last) && wait(access).await {
        let job = find(access, last.id).await.ok()?;
        if job != *last {
            return Some(job);
        }
    }
    None
}

/// Waits until the next query is due. Returns false if the stream must end instead.
async fn wait(access: &Access) -> bool {
    let draining = &access.state.context.draining;
    tokio::select! {
        () = tokio::time::sleep(POLL_INTERVAL) => access.caller.is_still_valid(&access.state).await,
        () = draining.cancelled() => false,
    }
}

/// State of a stream of all jobs.
struct JobStream {
    access: Access,
    /// Last known state of every job that may still change or was found by the last query.
    seen: BTreeMap<JobId, JobView>,
    /// Events to send.
    ready: VecDeque<Event>,
    /// Time given as Last-Event-ID, ms since 1970.
    last_ms: Option<i64>,
    /// Time of the last query, ms since 1970.
    queried_ms: Option<i64>,
}

impl JobStream {
    /// Returns the next event, or `None` when the stream ends.
    async fn next(&mut self) -> Option<Event> {
        loop {
            if let Some(event) = self.ready.pop_front() {
                return Some(event);
            }
            if self.queried_ms.is_some() && !wait(&self.access).await {
                return None;
            }
            if let Err(error) = self.query().await {
                // The client reconnects with the last id that it received.
                tracing::warn!(%error, "an event stream could not read its jobs");
                return None;
            }
        }
    }

    /// Queries the jobs and collects an event for every change.
    async fn query(&mut self) -> Result<(), store::Error> {
        let now_ms = now_ms();
        let rows = self.rows(now_ms).await?;
        // A new client gets no events of jobs that have ended already.
        let is_first = self.queried_ms.is_none() && self.last_ms.is_none();
        let mut seen = BTreeMap::new();
        for job in rows.into_iter().map(JobView::from) {
            let has_changed = self.seen.remove(&job.id).as_ref() != Some(&job);
            if has_changed && !(is_first && is_final(&job)) {
                let event = Event::default().event("job").json_data(&job);
                self.ready
                    .extend(event.ok().map(|event| with_id(event, now_ms)));
            }
            seen.insert(job.id, job);
        }
        // The query did not find the remaining jobs: they were deleted, or ended some time ago.
        for (id, last) in std::mem::take(&mut self.seen) {
            if !is_final(&last) {
                let event = Event::default().event("gone").json_data(json!({"id": id}));
                self.ready
                    .extend(event.ok().map(|event| with_id(event, now_ms)));
            }
        }
        (self.seen, self.queried_ms) = (seen, Some(now_ms));
        Ok(())
    }

    /// Returns the jobs that may have changed since the last query. It includes all that were unfinished
    /// then, unless they were deleted.
    async fn rows(&self, now_ms: i64) -> Result<Vec<JobRow>, store::Error> {
        let (store, owners) = (self.access.store(), &self.access.caller.owners);
        let since_ms = self.queried_ms.or(self.last_ms).unwrap_or(now_ms) - OVERLAP_MS;
        let mut rows = store.jobs_under_way(since_ms, owners).await?;
        if self.queried_ms.is_none() && self.last_ms.is_some() {
            rows.extend(store.jobs_ended(since_ms, owners).await?);
            rows.sort_by_key(|row| row.id);
            rows.dedup_by_key(|row| row.id);
        }
        for (id, last) in &self.seen {
            if !is_final(last) && !rows.iter().any(|row| row.id == *id) {
                rows.extend(store.job(*id, owners).await?);
            }
        }
        Ok(rows)
    }
}

/// Limits the time in a Last-Event-ID, which may be any number, to the last hour.
fn resume_time(id_ms: i64, now_ms: i64) -> i64 {
    id_ms.clamp(now_ms - MAX_RESUME_MS, now_ms)
}

fn with_id(event: Event, now_ms: i64) -> Event {
    event.id(now_ms.to_string())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn resume_time_lies_within_the_last_hour() {
        let now_ms = 1_800_000_000_000;
        for (id_ms, from_ms) in [
            (i64::MIN, now_ms - MAX_RESUME_MS),
            (0, now_ms - MAX_RESUME_MS),
            (now_ms - 5, now_ms - 5),
            (i64::MAX, now_ms),
        ] {
            assert_eq!(resume_time(id_ms, now_ms), from_ms, "{id_ms}");
        }
    }
}
