//! The table of jobs: a state machine (docs/explanation/promises.md, "No job is lost"). Every transition is
//! one function in one file, one short transaction and one log event.
//!
//! ```text
//! enqueue -> queued --claim--> running --finish--> done
//!            ^ ^  |               |  \---fail----> failed      <- rescue, after three crashes
//!            | |  '----cancel--.  |  '---stop----> cancelled   <- rescue, if cancel was requested
//!            | |               v  |                   |
//!            | |           cancelled                  |
//!            | '-- requeue, release, rescue           |
//!            '-- retry, by a user --------------------'
//! ```
//! A job may keep finished parts of its result while it runs (`keep`), so that a later attempt goes on from them.
//!
//! The queue never deletes rows, because users want to see the history of their jobs.

pub mod cancel;
pub mod changes;
pub mod claim;
pub mod enqueue;
pub mod fail;
pub mod finish;
mod follow;
pub mod heartbeat;
pub mod keep;
pub mod read;
pub mod release;
pub mod requeue;
pub mod rescue;
pub mod retry;
pub mod trace;

#[cfg(test)]
mod tests;

use sqlx::types::Uuid;

use super::Error;
use super::resources::ResourceKind;
use flockreel_core::ids::JobId;
use trace::TraceParent;

/// Kinds of jobs.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// Makes the sample footage; needs no input.
    Sample,
    /// Makes a library from footage.
    Analysis,
    /// Makes the videos of a library. Queued by the service with the library.
    Views,
    /// Makes a flock from a library.
    Flock,
    /// Makes a virtual fish from a library.
    Fish,
    /// Makes a labelled data set from libraries.
    Dataset,
}

/// State of a job.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum JobState {
    /// Waits for a worker. Entered by enqueue, requeue, release, rescue, retry; left by claim, cancel.
    Queued,
    /// A worker holds its lease. Entered by claim; left by finish, fail, requeue, release, stop, rescue.
    Running,
    /// Its result is linked. Entered by finish; final.
    Done,
    /// It has an error code. Entered by fail and by rescue (quarantine); final unless a user retries it.
    Failed,
    /// A user cancelled it. Entered by cancel, stop and rescue; final unless a user retries it.
    Cancelled,
}

/// The right to work on a job until the lease expires, and to finish it while the fence is valid.
#[derive(Clone, Debug, PartialEq, sqlx::FromRow)]
pub struct Lease {
    /// Id of the job.
    #[sqlx(try_from = "Uuid")]
    pub job_id: JobId,
    /// Kind of the job.
    #[sqlx(try_from = "String")]
    pub kind: Kind,
    /// Input of the job, JSON.
    pub input: String,
    /// Id that the result will have.
    pub result_id: Uuid,
    /// Number of claims so far, without released ones. The first claim has 1.
    pub attempt: i64,
    /// Number of the claim. Only the latest claim of a job can change it.
    pub fence: i64,
    /// Number of attempts whose own process crashed.
    pub own_crashes: i64,
    /// Number of attempts that ended for a transient reason.
    pub transient_ends: i64,
    /// Header `traceparent` of the request that queued the job.
    pub traceparent: Option<String>,
}

impl Lease {
    /// Returns the id of the trace to which the job belongs, for the log.
    pub fn trace_id(&self) -> Option<String> {
        let trace = TraceParent::parse(self.traceparent.as_deref()?)?;
        Some(trace.trace_id().to_owned())
    }
}

/// Whether a transition that requires a valid lease took place.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[must_use]
pub enum Change {
    /// The transition took place.
    Made,
    /// Nothing was changed: another worker holds the lease, or the job has ended.
    Lost,
}

impl Kind {
    /// All kinds.
    pub const ALL: [Kind; 6] = [
        Kind::Sample,
        Kind::Analysis,
        Kind::Views,
        Kind::Flock,
        Kind::Fish,
        Kind::Dataset,
    ];

    /// Returns the name used in the database and in the API.
    pub fn name(self) -> &'static str {
        match self {
            Kind::Sample => "sample",
            Kind::Analysis => "analysis",
            Kind::Views => "views",
            Kind::Flock => "flock",
            Kind::Fish => "fish",
            Kind::Dataset => "dataset",
        }
    }

    /// Returns the kind of the job's result.
    pub fn result_kind(self) -> ResourceKind {
        match self {
            Kind::Sample => ResourceKind::Footage,
            Kind::Analysis => ResourceKind::Library,
            Kind::Views => ResourceKind::Views,
            Kind::Flock => ResourceKind::Flock,
            Kind::Fish => ResourceKind::Fish,
            Kind::Dataset => ResourceKind::Dataset,
        }
    }
}

impl JobState {
    /// All states.
    pub const ALL: [JobState; 5] = [
        JobState::Queued,
        JobState::Running,
        JobState::Done,
        JobState::Failed,
        JobState::Cancelled,
    ];

    /// Returns the name used in the database and in the API.
    pub fn name(self) -> &'static str {
        match self {
            JobState::Queued => "queued",
            JobState::Running => "running",
            JobState::Done => "done",
            JobState::Failed => "failed",
            JobState::Cancelled => "cancelled",
        }
    }

    /// Returns whether the state is final.
    pub fn is_final(self) -> bool {
        match self {
            JobState::Queued | JobState::Running => false,
            JobState::Done | JobState::Failed | JobState::Cancelled => true,
        }
    }
}

impl Change {
    fn from_rows(n_rows: u64) -> Change {
        match n_rows {
            0 => Change::Lost,
            _ => Change::Made,
        }
    }
}

impl TryFrom<String> for Kind {
    type Error = Error;

    fn try_from(name: String) -> Result<Kind, Error> {
        let found = Kind::ALL.into_iter().find(|kind| kind.name() == name);
        found.ok_or_else(|| unknown(name))
    }
}

impl TryFrom<String> for JobState {
    type Error = Error;

    fn try_from(name: String) -> Result<JobState, Error> {
        let found = JobState::ALL.into_iter().find(|state| state.name() == name);
        found.ok_or_else(|| unknown(name))
    }
}

fn unknown(value: String) -> Error {
    Error::UnknownValue {
        table: "jobs",
        value,
    }
}
