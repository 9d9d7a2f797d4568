//! Jobs as server-sent events (ECOSYSTEM.md, SSE): one stream for all of a caller's, which the page opens, and one
//! for a single job, for scripts. Every event is the whole state, so that missing or repeating one is harmless, and
//! polling always does as well.
//!
//! The id of an event of `/v1/events` is the time of the look that found it. Whoever comes back with it is told
//! what ended meanwhile too, some of it twice: the clocks of those who end jobs may differ a little.

use std::collections::{BTreeMap, VecDeque};
use std::convert::Infallible;
use std::time::Duration;

use axum::body::Body;
use axum::extract::State;
use axum::http::{HeaderMap, Response};
use axum::response::IntoResponse;
use axum::response::sse::{Event, KeepAlive, Sse};
use futures_util::stream::{Stream, unfold};
use serde_json::json;
use utoipa::ToSchema;
use uuid::Uuid;

use super::{JobView, find, is_final};
use crate::api::AppState;
use crate::api::access::Caller;
use crate::api::extract::Id;
use crate::api::problem::{Problem, ProblemBody};
use crate::ids::JobId;
use crate::jobs::clock::now_ms;
use crate::store;
use crate::store::jobs::read::JobRow;

/// How often a stream looks at its jobs: as often as workers note progress.
const LOOK: Duration = Duration::from_millis(500);
/// How far back each look reaches, for what was written late.
const OVERLAP_MS: i64 = 10_000;
/// How long a stream may have been cut to be told what happened meanwhile.
const LOOK_BACK_MS: i64 = 3_600_000;
/// How long a client should wait before it comes back.
const RETRY: Duration = Duration::from_secs(1);

/// What an event `gone` says: the job was deleted with its result.
#[derive(ToSchema)]
#[expect(
    dead_code,
    reason = "it only describes the event in the OpenAPI document"
)]
pub(in crate::api) struct JobGone {
    id: Uuid,
}

/// One event of a stream, by the fields that it has there.
#[derive(ToSchema)]
#[expect(
    dead_code,
    reason = "it only describes the streams in the OpenAPI document"
)]
pub(in crate::api) struct JobEvent {
    /// `job`, or `gone`.
    event: String,
    /// JSON: of `job` what /v1/jobs/{id} answers, of `gone` the job's id.
    data: String,
    /// What to send as Last-Event-ID; of the stream of one job none.
    id: Option<String>,
}

/// Every change of the caller's jobs, as events named `job`, or `gone` for one that was deleted: first those
/// queued and running, and, after a Last-Event-ID, those that ended since. Ends when the token does.
#[utoipa::path(get, path = "/v1/events",
    params(("Last-Event-ID" = Option<String>, Header, description = "the id of the last event seen")),
    responses(
    (status = 200, content_type = "text/event-stream", body = JobEvent),
    (status = "4XX", body = ProblemBody, content_type = "application/problem+json"),
))]
pub(in crate::api) async fn get_events(
    State(state): State<AppState>,
    caller: Caller,
    headers: HeaderMap,
) -> Response<Body> {
    let last = headers.get("last-event-id");
    let last_ms = last.and_then(|id| id.to_str().ok()?.parse().ok());
    let last_ms = last_ms.map(|id_ms| within_look_back(id_ms, now_ms()));
    let feed = Feed {
        state,
        caller,
        seen: BTreeMap::new(),
        ready: VecDeque::from([Event::default().retry(RETRY)]),
        last_ms,
        looked_ms: None,
    };
    answer(unfold(feed, async |mut feed| {
        let event = feed.next().await?;
        Some((Ok(event), feed))
    }))
}

/// The job's states as server-sent events named `job`, until the last one.
#[utoipa::path(get, path = "/v1/jobs/{id}/events", params(("id" = Uuid, Path)), responses(
    (status = 200, content_type = "text/event-stream", body = JobEvent),
    (status = "4XX", body = ProblemBody, content_type = "application/problem+json"),
))]
pub(in crate::api) async fn get_job_events(
    State(state): State<AppState>,
    caller: Caller,
    Id(id): Id,
) -> Result<Response<Body>, Problem> {
    let job = find(&state, &caller, JobId(id)).await?;
    let start = (state, caller, None, Some(job));
    let events = unfold(start, async |(state, caller, last, first)| {
        let job = match first {
            Some(first) => first,
            None => next_change(&state, &caller, last.as_ref()?).await?,
        };
        let event = Event::default().event("job").json_data(&job).ok()?;
        Some((Ok(event), (state, caller, Some(job), None)))
    });
    Ok(answer(events))
}

fn answer<S>(events: S) -> Response<Body>
where
    S: Stream<Item = Result<Event, Infallible>> + Send + 'static,
{
    let events = Sse::new(events).keep_alive(KeepAlive::default());
    // A proxy that gathers answers would hold events back.
    ([("x-accel-buffering", "no")], events).into_response()
}

/// Waits for another state; none after a final one, or when the service stops.
async fn next_change(state: &AppState, caller: &Caller, last: &JobView) -> Option<JobView> {
    while !is_final(last) && wait(state, caller).await {
        let job = find(state, caller, last.id).await.ok()?;
        if job != *last {
            return Some(job);
        }
    }
    None
}

/// Waits until it is time to look again; false where the stream ends instead.
async fn wait(state: &AppState, caller: &Caller) -> bool {
    let draining = &state.context.draining;
    tokio::select! {
        () = tokio::time::sleep(LOOK) => caller.is_still_good(state).await,
        () = draining.cancelled() => false,
    }
}

/// What one stream of all jobs knows.
struct Feed {
    state: AppState,
    caller: Caller,
    /// What was told last of every job that may still change, or ended a moment ago.
    seen: BTreeMap<JobId, JobView>,
    ready: VecDeque<Event>,
    /// The Last-Event-ID.
    last_ms: Option<i64>,
    looked_ms: Option<i64>,
}

impl Feed {
    /// The next event; none when the stream ends.
    async fn next(&mut self) -> Option<Event> {
        loop {
            if let Some(event) = self.ready.pop_front() {
                return Some(event);
            }
            if self.looked_ms.is_some() && !wait(&self.state, &self.caller).await {
                return None;
            }
            if let Err(error) = self.look().await {
                // The client comes back with the last id that it has seen.
                tracing::warn!(%error, "a stream of events could not look at its jobs");
                return None;
            }
        }
    }

    async fn look(&mut self) -> Result<(), store::Error> {
        let now_ms = now_ms();
        let rows = self.rows(now_ms).await?;
        // Whoever comes for the first time hears nothing of what has ended already.
        let is_first = self.looked_ms.is_none() && self.last_ms.is_none();
        let mut seen = BTreeMap::new();
        for job in rows.into_iter().map(JobView::of) {
            let is_news = self.seen.remove(&job.id).as_ref() != Some(&job);
            if is_news && !(is_first && is_final(&job)) {
                let event = Event::default().event("job").json_data(&job);
                self.ready
                    .extend(event.ok().map(|event| stamped(event, now_ms)));
            }
            seen.insert(job.id, job);
        }
        // What is left is no longer among them: deleted, or ended long enough ago.
        for (id, last) in std::mem::take(&mut self.seen) {
            if !is_final(&last) {
                let event = Event::default().event("gone").json_data(json!({"id": id}));
                self.ready
                    .extend(event.ok().map(|event| stamped(event, now_ms)));
            }
        }
        (self.seen, self.looked_ms) = (seen, Some(now_ms));
        Ok(())
    }

    /// The jobs that may have changed since the last look; those that were under way then, whatever
    /// became of them.
    async fn rows(&self, now_ms: i64) -> Result<Vec<JobRow>, store::Error> {
        let (store, reach) = (&self.state.context.store, &self.caller.reach);
        let since_ms = self.looked_ms.or(self.last_ms).unwrap_or(now_ms) - OVERLAP_MS;
        let mut rows = store.jobs_under_way(since_ms, reach).await?;
        if self.looked_ms.is_none() && self.last_ms.is_some() {
            rows.extend(store.jobs_ended(since_ms, reach).await?);
            rows.sort_by_key(|row| row.id);
            rows.dedup_by_key(|row| row.id);
        }
        for (id, last) in &self.seen {
            if !is_final(last) && !rows.iter().any(|row| row.id == *id) {
                rows.extend(store.job(*id, reach).await?);
            }
        }
        Ok(rows)
    }
}

/// The time that a client says it was here last, which may be any number.
fn within_look_back(id_ms: i64, now_ms: i64) -> i64 {
    id_ms.clamp(now_ms - LOOK_BACK_MS, now_ms)
}

fn stamped(event: Event, now_ms: i64) -> Event {
    event.id(now_ms.to_string())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_stream_looks_back_an_hour_and_never_ahead_whatever_its_id_says() {
        let now_ms = 1_800_000_000_000;
        for (id_ms, from_ms) in [
            (i64::MIN, now_ms - LOOK_BACK_MS),
            (0, now_ms - LOOK_BACK_MS),
            (now_ms - 5, now_ms - 5),
            (i64::MAX, now_ms),
        ] {
            assert_eq!(within_look_back(id_ms, now_ms), from_ms, "{id_ms}");
        }
    }
}
