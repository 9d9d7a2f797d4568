//! Jobs: the kinds of work in the queue, and the workers that run them
//! (docs/explanation/promises.md, "No job is lost").
//!
//! The kinds are a closed enum. The `run` of a job is a plain function in a child process. It loads its input,
//! computes, and leaves files in a folder; the worker stores them. A job may run twice, and only one of the results
//! is kept.

// How jobs are run.
pub mod attempt; // one attempt, in a child process
pub mod id_sequence; // ids for idempotent requests
pub mod listener; // progress and cancellation
pub mod meters; // metrics
pub mod supervisor; // start of workers, rescue of jobs, graceful stop
pub mod worker; // claim, run and finish one job

mod lane; // small jobs

// The kinds of jobs, and related computations.
pub mod admit; // received files -> footage
pub mod analysis; // footage -> library
pub mod concurrency; // limits of simultaneous work
pub mod fish; // library -> virtual fish
pub mod flock; // library -> flock
pub mod masks; // footage -> given masks or alpha channel
pub mod refusal; // refused footage -> picture of the reason, and mends
pub mod sample; // nothing -> sample footage
pub mod synchronous; // library -> computations during a request
pub mod views; // library and its footage -> videos

pub mod clock;
pub mod error;

use std::ffi::OsString;
use std::path::PathBuf;
use std::sync::Arc;
use std::time::Duration;

use serde::Serialize;
use serde::de::DeserializeOwned;
use tokio::sync::Notify;
use tokio_util::sync::CancellationToken;
use uuid::Uuid;

pub use attempt::{Attempt, Product};
pub use concurrency::ConcurrencyLimit;
pub use error::Error;
pub use id_sequence::IdSequence;
pub use listener::{Listener, Stages};
pub use meters::Meters;

use self::flock::dataset::job as dataset;
use crate::config::{self, JobSettings, Retention};
use crate::store::jobs::Kind;
use crate::store::jobs::enqueue::NewJob;
use crate::store::jobs::retry::Retry;
use crate::store::owners::{Account, OwnerFilter};
use crate::store::{self, Store};
use flockreel_core::ids::{FootageId, JobId, LibraryId};

/// Data shared by workers. Smaller than the state of the API.
#[derive(Clone)]
pub struct Context {
    /// The store.
    pub store: Store,
    /// Wakes the idle workers when a job is queued.
    pub wake: Arc<Notify>,
    /// Cancelled when the process stops. Workers then claim no jobs, and running jobs return to the queue.
    pub draining: CancellationToken,
    /// Id of this process, by which its jobs are told from those of others. Random, so that a restarted process has
    /// another one.
    pub process: Uuid,
    /// Program of an attempt, and its arguments before `attempt`.
    pub attempt_program: (PathBuf, Vec<OsString>),
    /// Number of threads that one job may use.
    pub threads: usize,
    /// Limit of the memory of one attempt, without its media tools, bytes.
    pub memory_bytes: u64,
    /// Duration of a lease without a heartbeat.
    pub lease: Duration,
    /// Time limit of one attempt at a job.
    pub budget: Duration,
    /// Time limit of a check of received files.
    pub check_time: Duration,
    /// Interval of the sweeps of expired data.
    pub sweep_every: Duration,
    /// Maximum number of queued and running jobs of all owners.
    pub max_queued: i64,
    /// Ages at which data is deleted.
    pub retention: Retention,
    /// Free disk space below which no job begins and running jobs are stopped, bytes. It keeps space for the database.
    pub min_free_bytes: u64,
    /// Metrics of the jobs of this process.
    pub meters: Meters,
    /// Limit of simultaneous checks of uploads.
    pub upload_checks: ConcurrencyLimit,
    /// Limit of simultaneous computations during requests.
    pub synchronous_work: ConcurrencyLimit,
}

impl Context {
    /// Returns the time for leases, milliseconds since 1970. If machines share the queue, this is the
    /// database's clock.
    pub async fn now_ms(&self) -> Result<i64, store::Error> {
        let shared = self.store.clock_ms().await?;
        Ok(shared.unwrap_or_else(clock::now_ms))
    }

    /// Returns whether the free disk space is below the limit for jobs.
    fn lacks_disk_space(&self) -> bool {
        let free = self.store.blobs().free_bytes();
        free.is_ok_and(|free_bytes| free_bytes < self.min_free_bytes)
    }

    /// Queues a job, after `after_job` if that makes its input. Returns the id of the job and the id that its
    /// result will have. Both are the next ids of `ids`, in this order. Fails with `storage_full` if the job could not
    /// begin for lack of disk space.
    pub async fn enqueue<Input: JobInput>(
        &self,
        input: &Input,
        after_job: Option<JobId>,
        account: &Account,
        ids: &mut IdSequence,
    ) -> Result<(JobId, Input::ResultId), store::Error> {
        self.require_disk_space()?;
        let (job_id, result_id) = (JobId(ids.next_id()), ids.next_id());
        let job = NewJob {
            job_id,
            account: account.clone(),
            kind: Input::KIND,
            input: serde_json::json!(input).to_string(),
            result_id,
            after_job,
            priority: 0,
            is_small: self.is_small(input).await?,
            max_queued: self.max_queued,
        };
        self.store.enqueue(&job, self.now_ms().await?).await?;
        self.wake.notify_waiters();
        Ok((job_id, result_id.into()))
    }

    /// Fails with `storage_full` if only this machine runs jobs, and its disk has too little free space for them.
    fn require_disk_space(&self) -> Result<(), store::Error> {
        if self.store.is_alone() {
            self.store.require_free(self.min_free_bytes)?;
        }
        Ok(())
    }

    /// Returns a job that failed or was cancelled to the queue. Fails as [`Context::enqueue`] does.
    pub async fn retry(
        &self,
        job: JobId,
        owners: &OwnerFilter,
        account: &Account,
    ) -> Result<Retry, store::Error> {
        self.require_disk_space()?;
        let (store, now_ms) = (&self.store, self.now_ms().await?);
        let retry = store
            .retry(job, owners, account, self.max_queued, now_ms)
            .await?;
        self.wake.notify_waiters();
        Ok(retry)
    }

    /// Returns a context with these settings of jobs.
    pub fn for_jobs(store: Store, settings: &JobSettings) -> Context {
        Context {
            budget: Duration::from_secs(settings.job_time_s),
            memory_bytes: settings.job_memory_bytes,
            ..Context::new(store, config::threads_per_worker(settings.workers))
        }
    }

    /// Returns a context with default settings.
    pub fn new(store: Store, threads: usize) -> Context {
        Context {
            store,
            wake: Arc::new(Notify::new()),
            draining: CancellationToken::new(),
            process: Uuid::now_v7(),
            // This program, even if its file was replaced.
            attempt_program: (PathBuf::from("/proc/self/exe"), Vec::new()),
            threads,
            memory_bytes: JobSettings::JOB_MEMORY_BYTES,
            lease: Duration::from_secs(15),
            budget: Duration::from_secs(JobSettings::JOB_TIME_S),
            check_time: attempt::CHECK_TIME,
            sweep_every: Duration::from_secs(3600),
            max_queued: i64::MAX,
            retention: Retention::default(),
            min_free_bytes: 0,
            meters: Meters::default(),
            upload_checks: ConcurrencyLimit::per_core(),
            synchronous_work: ConcurrencyLimit::one(),
        }
    }
}

/// Footage or library that a job works on.
#[derive(Clone, Copy, Debug)]
pub enum Subject {
    /// Footage.
    Footage(FootageId),
    /// Library.
    Library(LibraryId),
}

impl Subject {
    /// Returns the id of the footage or library.
    pub fn id(self) -> Uuid {
        match self {
            Subject::Footage(id) => id.0,
            Subject::Library(id) => id.0,
        }
    }
}

/// Extent of a film: what the cost of a job depends on.
#[derive(Clone, Copy, Debug)]
pub struct Extent {
    /// Number of frames.
    pub n_frames: usize,
    /// Width and height of the picture, pixels.
    pub image_size_px: [u32; 2],
}

impl Extent {
    /// Returns the number of pixels of all frames.
    pub fn film_px(self) -> f64 {
        let [width, height] = self.image_size_px;
        self.n_frames as f64 * f64::from(width) * f64::from(height)
    }
}

/// Input of a job. It is stored with the job as JSON.
pub trait JobInput: Serialize + DeserializeOwned {
    /// Kind of the job.
    const KIND: Kind;
    /// Type of the id of the result.
    type ResultId: From<Uuid>;

    /// Returns what the job works on: nothing, a footage, a library, or several libraries.
    fn subjects(&self) -> Vec<Subject>;

    /// Estimates the cost of the job: the number of pixels that are decoded, drawn and encoded. `None` if that depends
    /// on an unknown subject. `subject` is the extent of the footage, or of that of the (first) library.
    fn cost_px(&self, subject: Option<Extent>) -> Option<f64>;

    /// Makes the result in the process of an attempt, and leaves its files in the folder of the attempt.
    fn run(&self, attempt: &Attempt) -> Result<Product, Error>;
}

/// Runs a job of this kind with its input (JSON) on the calling thread.
fn run(kind: Kind, input: &str, attempt: &Attempt) -> Result<Product, Error> {
    match kind {
        Kind::Sample => parse::<sample::Input>(input)?.run(attempt),
        Kind::Analysis => parse::<analysis::Input>(input)?.run(attempt),
        Kind::Views => parse::<views::Input>(input)?.run(attempt),
        Kind::Flock => parse::<flock::Input>(input)?.run(attempt),
        Kind::Fish => parse::<fish::Input>(input)?.run(attempt),
        Kind::Dataset => parse::<dataset::Input>(input)?.run(attempt),
    }
}

/// Returns what a job of this kind with this input (JSON) works on.
fn subjects(kind: Kind, input: &str) -> Result<Vec<Subject>, Error> {
    Ok(match kind {
        Kind::Sample => parse::<sample::Input>(input)?.subjects(),
        Kind::Analysis => parse::<analysis::Input>(input)?.subjects(),
        Kind::Views => parse::<views::Input>(input)?.subjects(),
        Kind::Flock => parse::<flock::Input>(input)?.subjects(),
        Kind::Fish => parse::<fish::Input>(input)?.subjects(),
        Kind::Dataset => parse::<dataset::Input>(input)?.subjects(),
    })
}

fn parse<Input: JobInput>(input: &str) -> Result<Input, Error> {
    Ok(serde_json::from_str(input)?)
}

/// Returns the stages of a kind of job.
pub fn stages(kind: Kind) -> Stages {
    match kind {
        Kind::Sample => sample::STAGES,
        Kind::Analysis => analysis::STAGES,
        Kind::Views => views::STAGES,
        Kind::Flock => flock::STAGES,
        Kind::Fish => fish::STAGES,
        Kind::Dataset => dataset::STAGES,
    }
}
