//! One attempt at a job, in a child process of its own (docs/explanation/promises.md, "Poison jobs"). A job that
//! exhausts memory, aborts or hangs ends its own process and nothing else. Received files are checked in the same way,
//! so the service itself parses no foreign files.
//!
//! The worker's process hands its child local files and parameters, and neither secrets nor the database. The
//! child writes files to the folder of the attempt, and reports progress and result as lines of JSON.

mod child; // the child: computes and reports
mod decoding; // metrics of decoding
mod inspection; // check of received files, and preview of an analysis
mod keep; // finished parts of a result
mod message; // what worker and child tell each other
mod process; // the worker's side: starts the child and follows it
mod reporter; // progress and cancellation of the child

use std::path::{Path, PathBuf};
use std::sync::Arc;

pub use child::run;
pub(super) use decoding::Counted;
pub(super) use inspection::{CHECK_TIME, inspect, preview};
pub use keep::KEPT_FILES;
pub use message::{Film, Part, Product};
pub(super) use process::compute;
pub use reporter::Reporter;

use super::Error;
use crate::media::Limits;
use crate::store::Spill;
use flockreel_core::analysis::Params;
use flockreel_core::formats::library_dir;
use flockreel_core::formats::library_json::FootageSummary;
use flockreel_core::library::{Library, Poses};
use flockreel_core::progress::Progress;
use flockreel_core::scratch::Scratch;
use message::{Job, Order};

/// Input and output of an attempt, as the child sees them.
pub struct Attempt<'a> {
    /// Receives progress and passes on cancellation.
    pub reporter: &'a Reporter,
    folder: &'a Path,
    order: &'a Order,
    job: &'a Job,
}

impl Attempt<'_> {
    /// Returns the folder for the files of this attempt. It is empty at the start, and removed unless the job
    /// is finished.
    pub fn folder(&self) -> &Path {
        self.folder
    }

    /// Returns the number of threads to use, at least 1.
    pub fn threads(&self) -> usize {
        self.order.threads
    }

    /// Returns a temporary storage for data that is too large for memory.
    pub fn scratch(&self) -> Arc<dyn Scratch> {
        Arc::new(Spill::into(self.folder))
    }

    /// Returns the default limits of media tools, with the threads of this attempt.
    pub fn limits(&self) -> Limits {
        Limits {
            threads: u32::try_from(self.threads()).unwrap_or(0),
            ..Limits::default()
        }
    }

    /// Returns the path of a file of the footage or library that the job works on. The file may be absent.
    pub fn subject_file(&self, name: &str) -> PathBuf {
        self.order.subject().join(name)
    }

    /// Returns the folders of all libraries that the job works on.
    pub fn libraries(&self) -> &[PathBuf] {
        &self.order.subjects
    }

    /// Returns the path of a file of the footage from which the library of a views job was made.
    pub fn film_file(&self, name: &str) -> PathBuf {
        self.order.film.join(name)
    }

    /// Reads the poses and the parameters of the library that the job works on, and nothing else of it.
    pub fn measurement(&self) -> Result<(Poses, Params), Error> {
        let poses = library_dir::read_poses(self.order.subject())?;
        Ok((poses, library_dir::read_params(self.order.subject())?))
    }

    /// Returns the hash and size of the footage that the job works on. Fails if that is no footage.
    pub fn footage(&self) -> Result<&FootageSummary, Error> {
        let footage = self.job.footage.as_ref();
        footage.ok_or_else(|| std::io::Error::other("the attempt has no footage").into())
    }

    /// Reads the library that the job works on.
    pub fn library(&self) -> Result<Library, Error> {
        self.reporter.report("loading", 0.0);
        Ok(library_dir::read(self.order.subject(), self.scratch())?.library)
    }
}
