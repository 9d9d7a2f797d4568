//! Jobs: what the queue holds and who works on it (DESIGN.md, names; RELIABILITY.md, R2 to R5, R8).
//!
//! The kinds are a closed enum. A job's `run` is a plain function on a blocking thread: it
//! loads, computes by ring 2 and leaves files in its draft; the worker stores them. A job may be run
//! twice, and only one of the runs is kept.

// The way of a job.
pub mod supervisor; // the pool, rescue, drain

pub mod worker; // claim, run, finish

pub mod allotted; // the ids under which a request makes things

pub mod attempt; // what one run of a job is given

pub mod listener; // progress out, cancellation in

pub mod meters; // what is counted

mod decoding; // a film that counts its frames

// What jobs do.
pub mod admit; // received bytes -> footage

pub mod sample; // nothing -> footage, for the first visit

pub mod analysis; // footage -> library

pub mod flock; // library -> flock

pub mod fish; // library -> virtual fish
pub mod overlay; // footage -> the same with its poses drawn over it

pub mod masks; // footage -> which of it is the animal, where that is given

pub mod refusal; // footage that could not be measured -> a picture of why

pub mod at_once; // library -> what somebody waits for

pub mod places; // how much of that at once

pub mod clock;
pub mod error;

use std::sync::Arc;
use std::time::Duration;

use serde::Serialize;
use tokio::sync::Notify;
use tokio_util::sync::CancellationToken;
use uuid::Uuid;

pub use attempt::{Attempt, Product};
pub use error::Error;
pub use listener::{Listener, Stages};
pub use meters::Meters;
pub use places::Places;

use allotted::next_id;

use crate::config::Crew;
use crate::ids::JobId;
use crate::store::jobs::enqueue::NewJob;
use crate::store::jobs::{Kind, Lease};
use crate::store::owners::Account;
use crate::store::{self, Store};

/// What workers share: smaller than the API's state.
#[derive(Clone)]
pub struct Context {
    /// Rows and files.
    pub store: Store,
    /// Wakes one idle worker when a job was queued.
    pub wake: Arc<Notify>,
    /// Cancelled when the process stops: no more claims, running jobs go back.
    pub draining: CancellationToken,
    /// Threads that one job may use.
    pub threads: usize,
    /// How long a claim holds without a heartbeat.
    pub lease: Duration,
    /// How long one attempt at a job may take.
    pub budget: Duration,
    /// How often what has expired is swept while the service runs.
    pub sweep_every: Duration,
    /// How many jobs of everybody may be queued or running at once.
    pub max_queued: i64,
    /// Room on the disk below which jobs are stopped, bytes, so that rows can still be written.
    pub least_room_bytes: u64,
    /// What is counted of the jobs of this process.
    pub meters: Meters,
    /// How many films are looked at at once.
    pub places: Places,
    /// Who may have something computed while they wait.
    pub at_once: Places,
}

impl Context {
    /// The time that leases are given and ended by: of all who share the queue, not of this machine alone.
    pub async fn now_ms(&self) -> Result<i64, store::Error> {
        let shared = self.store.clock_ms().await?;
        Ok(shared.unwrap_or_else(clock::now_ms))
    }

    /// Whether a job that goes on writing would leave too little room on the disk.
    fn lacks_room(&self) -> bool {
        let room = self.store.blobs().room_bytes();
        room.is_ok_and(|room_bytes| room_bytes < self.least_room_bytes)
    }

    /// Queues a job, after another one if it needs that one's result; its id, and the id that its result will
    /// have. Both are chosen in this order, as a request that comes again asks for them.
    async fn enqueue<Input: Serialize>(
        &self,
        kind: Kind,
        input: &Input,
        after_job: Option<JobId>,
        account: &Account,
    ) -> Result<(JobId, Uuid), store::Error> {
        let (job_id, result_id) = (JobId(next_id()), next_id());
        let job = NewJob {
            job_id,
            account: account.clone(),
            kind,
            input: serde_json::json!(input).to_string(),
            result_id,
            after_job,
            priority: 0,
            room: self.max_queued,
        };
        self.store.enqueue(&job, self.now_ms().await?).await?;
        self.wake.notify_one();
        Ok((job_id, result_id))
    }

    /// The usual lease, over a store.
    pub fn new(store: Store, threads: usize) -> Context {
        Context {
            store,
            wake: Arc::new(Notify::new()),
            draining: CancellationToken::new(),
            threads,
            lease: Duration::from_secs(15),
            budget: Duration::from_secs(Crew::JOB_TIME_S),
            sweep_every: Duration::from_secs(3600),
            max_queued: i64::MAX,
            least_room_bytes: 0,
            meters: Meters::default(),
            places: Places::of_cores(),
            at_once: Places::one(),
        }
    }
}

/// A job with its input, decoded.
#[derive(Clone, Debug)]
pub enum Job {
    /// Nothing to footage.
    Sample(sample::Input),
    /// Footage to library.
    Analysis(Box<analysis::Input>),
    /// Library to flock.
    Flock(Box<flock::Input>),
    /// Library to virtual fish.
    Fish(fish::Input),
}

impl Job {
    /// Reads the input of a claimed job.
    pub fn decode(lease: &Lease) -> Result<Job, Error> {
        Ok(match lease.kind {
            Kind::Sample => Job::Sample(serde_json::from_str(&lease.input)?),
            Kind::Analysis => Job::Analysis(serde_json::from_str(&lease.input)?),
            Kind::Flock => Job::Flock(serde_json::from_str(&lease.input)?),
            Kind::Fish => Job::Fish(serde_json::from_str(&lease.input)?),
        })
    }

    /// Does the work, on the thread that calls.
    pub fn run(&self, attempt: &Attempt) -> Result<Product, Error> {
        match self {
            Job::Sample(input) => input.run(attempt),
            Job::Analysis(input) => input.run(attempt),
            Job::Flock(input) => input.run(attempt),
            Job::Fish(input) => input.run(attempt),
        }
    }
}

/// The stages of a kind of job.
pub fn stages(kind: Kind) -> Stages {
    match kind {
        Kind::Sample => sample::STAGES,
        Kind::Analysis => analysis::STAGES,
        Kind::Flock => flock::STAGES,
        Kind::Fish => fish::STAGES,
    }
}
