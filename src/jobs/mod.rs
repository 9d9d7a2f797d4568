//! Jobs: the kinds of work in the queue, and the workers that run them
//! (docs/explanation/promises.md, "No job is lost").
//!
//! The kinds are a closed enum. The `run` of a job is a plain function on a blocking thread. It loads its
//! input, computes, and leaves files in its draft; the worker stores them. A job may run twice, and only one
//! of the results is kept.

// How jobs are run.
pub mod supervisor; // start of workers, rescue of jobs, graceful stop

pub mod worker; // claim, run and finish one job

pub mod allotted; // ids for idempotent requests

pub mod attempt; // input and output of one attempt

pub mod listener; // progress and cancellation

pub mod meters; // metrics

mod decoding; // metrics of decoding

// The kinds of jobs, and related computations.
pub mod admit; // received files -> footage

pub mod sample; // nothing -> sample footage

pub mod analysis; // footage -> library

pub mod flock; // library -> flock

pub mod fish; // library -> virtual fish
pub mod overlay; // footage -> video with its poses drawn over it

pub mod masks; // footage -> given masks or alpha channel

pub mod refusal; // refused footage -> picture of the reason

pub mod at_once; // library -> computations during a request

pub mod places; // limits of simultaneous work

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

use crate::config::JobSettings;
use crate::ids::JobId;
use crate::store::jobs::enqueue::NewJob;
use crate::store::jobs::{Kind, Lease};
use crate::store::owners::Account;
use crate::store::{self, Store};

/// Data shared by workers. Smaller than the state of the API.
#[derive(Clone)]
pub struct Context {
    /// The store.
    pub store: Store,
    /// Wakes an idle worker when a job is queued.
    pub wake: Arc<Notify>,
    /// Cancelled when the process stops. Workers then claim no jobs, and running jobs return to the queue.
    pub draining: CancellationToken,
    /// Number of threads that one job may use.
    pub threads: usize,
    /// Duration of a lease without a heartbeat.
    pub lease: Duration,
    /// Time limit of one attempt at a job.
    pub budget: Duration,
    /// Interval of the sweeps of expired data.
    pub sweep_every: Duration,
    /// Maximum number of queued and running jobs of all owners.
    pub max_queued: i64,
    /// Free disk space below which jobs are stopped, bytes. It keeps space for the database.
    pub least_room_bytes: u64,
    /// Metrics of the jobs of this process.
    pub meters: Meters,
    /// Limit of simultaneous checks of uploads.
    pub places: Places,
    /// Limit of simultaneous computations during requests.
    pub at_once: Places,
}

impl Context {
    /// Returns the time for leases, milliseconds since 1970. If machines share the queue, this is the
    /// database's clock.
    pub async fn now_ms(&self) -> Result<i64, store::Error> {
        let shared = self.store.clock_ms().await?;
        Ok(shared.unwrap_or_else(clock::now_ms))
    }

    /// Returns whether the free disk space is below the limit for jobs.
    fn lacks_room(&self) -> bool {
        let room = self.store.blobs().room_bytes();
        room.is_ok_and(|room_bytes| room_bytes < self.least_room_bytes)
    }

    /// Queues a job, after `after_job` if that makes its input. Returns the id of the job and the id that its
    /// result will have. The ids are chosen in this order, because a repeated request must get the same ones.
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

    /// Returns a context with default settings.
    pub fn new(store: Store, threads: usize) -> Context {
        Context {
            store,
            wake: Arc::new(Notify::new()),
            draining: CancellationToken::new(),
            threads,
            lease: Duration::from_secs(15),
            budget: Duration::from_secs(JobSettings::JOB_TIME_S),
            sweep_every: Duration::from_secs(3600),
            max_queued: i64::MAX,
            least_room_bytes: 0,
            meters: Meters::default(),
            places: Places::of_cores(),
            at_once: Places::one(),
        }
    }
}

/// A job with its decoded input.
#[derive(Clone, Debug)]
pub enum Job {
    /// Makes the sample footage.
    Sample(sample::Input),
    /// Makes a library from footage.
    Analysis(Box<analysis::Input>),
    /// Makes a flock from a library.
    Flock(Box<flock::Input>),
    /// Makes a virtual fish from a library.
    Fish(fish::Input),
}

impl Job {
    /// Decodes the input of a claimed job.
    pub fn decode(lease: &Lease) -> Result<Job, Error> {
        Ok(match lease.kind {
            Kind::Sample => Job::Sample(serde_json::from_str(&lease.input)?),
            Kind::Analysis => Job::Analysis(serde_json::from_str(&lease.input)?),
            Kind::Flock => Job::Flock(serde_json::from_str(&lease.input)?),
            Kind::Fish => Job::Fish(serde_json::from_str(&lease.input)?),
        })
    }

    /// Runs the job on the calling thread.
    pub fn run(&self, attempt: &Attempt) -> Result<Product, Error> {
        match self {
            Job::Sample(input) => input.run(attempt),
            Job::Analysis(input) => input.run(attempt),
            Job::Flock(input) => input.run(attempt),
            Job::Fish(input) => input.run(attempt),
        }
    }
}

/// Returns the stages of a kind of job.
pub fn stages(kind: Kind) -> Stages {
    match kind {
        Kind::Sample => sample::STAGES,
        Kind::Analysis => analysis::STAGES,
        Kind::Flock => flock::STAGES,
        Kind::Fish => fish::STAGES,
    }
}
