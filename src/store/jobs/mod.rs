//! The table of jobs: a small state machine in words (STYLE.md, habit 8; RELIABILITY.md, queue
//! rules). Every transition is one function in one file, one short transaction and one event.
//!
//! ```text
//! enqueue -> queued --claim--> running --finish--> done
//!              ^  |               |  \---fail----> failed      <- rescue, after two crashes
//!              |  '----cancel--.  |  '---stop----> cancelled   <- rescue, where cancel was asked for
//!              |               v  |
//!              |           cancelled
//!              '-- retry, release, rescue
//! ```
//! A job's row is never deleted by the queue: the history is what users ask for.

pub mod cancel;
pub mod changes;
pub mod claim;
pub mod enqueue;
pub mod fail;
pub mod finish;
mod follow;
pub mod heartbeat;
pub mod read;
pub mod release;
pub mod rescue;
pub mod retry;
#[cfg(test)]
mod tests;

use sqlx::types::Uuid;

use super::Error;
use crate::ids::JobId;

/// The closed set of kinds of job.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// Nothing to footage: the sample is filmed.
    Sample,
    /// Footage to library.
    Analysis,
    /// Library to flock.
    Flock,
    /// Library to virtual fish.
    Fish,
}

/// Where a job stands.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum JobState {
    /// Waits for a worker. In by enqueue, retry, release, rescue; out by claim, cancel.
    Queued,
    /// A worker holds its lease. In by claim; out by finish, fail, retry, release, stop, rescue.
    Running,
    /// Its one result set is linked. In by finish; final.
    Done,
    /// It has a code. In by fail and rescue (quarantine); final.
    Failed,
    /// Somebody asked for it. In by cancel, stop and rescue; final.
    Cancelled,
}

/// The right to work on a job until the lease ends, and to finish it if the fence still stands.
#[derive(Clone, Debug, PartialEq)]
pub struct Lease {
    /// The job.
    pub job_id: JobId,
    /// What it is.
    pub kind: Kind,
    /// Its input as it was enqueued, JSON.
    pub input: String,
    /// The id that its result will have.
    pub result_id: Uuid,
    /// How often it has been claimed, released claims apart: 1 at the first time.
    pub attempt: i64,
    /// The number that only the newest claim holds.
    pub fence: i64,
}

/// Whether a transition that needs a standing lease took place.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[must_use]
pub enum Change {
    /// It did.
    Made,
    /// The lease had passed to somebody else, or the job had ended: nothing was changed.
    Lost,
}

impl Kind {
    /// Every kind.
    pub const ALL: [Kind; 4] = [Kind::Sample, Kind::Analysis, Kind::Flock, Kind::Fish];

    /// The name in the database and the API.
    pub fn name(self) -> &'static str {
        match self {
            Kind::Sample => "sample",
            Kind::Analysis => "analysis",
            Kind::Flock => "flock",
            Kind::Fish => "fish",
        }
    }

    pub(super) fn from_name(name: &str) -> Result<Kind, Error> {
        let found = Kind::ALL.into_iter().find(|kind| kind.name() == name);
        found.ok_or_else(|| unknown(name))
    }
}

impl JobState {
    /// Every state.
    pub const ALL: [JobState; 5] = [
        JobState::Queued,
        JobState::Running,
        JobState::Done,
        JobState::Failed,
        JobState::Cancelled,
    ];

    /// The name in the database and the API.
    pub fn name(self) -> &'static str {
        match self {
            JobState::Queued => "queued",
            JobState::Running => "running",
            JobState::Done => "done",
            JobState::Failed => "failed",
            JobState::Cancelled => "cancelled",
        }
    }

    /// Whether it will never change again.
    pub fn is_final(self) -> bool {
        match self {
            JobState::Queued | JobState::Running => false,
            JobState::Done | JobState::Failed | JobState::Cancelled => true,
        }
    }

    pub(super) fn from_name(name: &str) -> Result<JobState, Error> {
        let found = JobState::ALL.into_iter().find(|state| state.name() == name);
        found.ok_or_else(|| unknown(name))
    }
}

impl Change {
    fn of_rows(n_rows: u64) -> Change {
        match n_rows {
            0 => Change::Lost,
            _ => Change::Made,
        }
    }
}

fn unknown(value: &str) -> Error {
    Error::UnknownValue {
        table: "jobs",
        value: value.to_owned(),
    }
}
