//! Messages between the service and its child, one line of JSON each: the order on the child's stdin, then progress and
//! the end on its stdout.

use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};

use crate::jobs::Error;
use crate::jobs::analysis::preview::Preview;
use crate::jobs::refusal::mend::Mend;
use crate::media::FoundTools;
use crate::store::BlobFile;
use flockreel_core::analysis::Params;
use flockreel_core::formats::library_json::FootageSummary;
use flockreel_core::ids::JobId;

/// Everything that the child needs, except the folder for its files, which is its argument.
#[derive(Debug, Serialize, Deserialize)]
pub(super) struct Order {
    /// Task of the child.
    pub(super) task: Task,
    /// Folders with the files of the footage or libraries that the task works on; none for a sample.
    pub(super) subjects: Vec<PathBuf>,
    /// Folder with the files of the footage from which the library of a views job was made; else empty.
    pub(super) film: PathBuf,
    /// Parts that earlier attempts at the job have kept.
    pub(super) parts: Vec<Part>,
    /// Number of threads to use.
    pub(super) threads: usize,
    /// Limit of the memory, bytes.
    pub(super) memory_bytes: u64,
    /// The media tools.
    pub(super) tools: FoundTools,
}

impl Order {
    /// Returns the folder of the first subject; an empty path for a sample.
    pub(super) fn subject(&self) -> &Path {
        (self.subjects.first()).map_or(Path::new(""), PathBuf::as_path)
    }
}

/// Task of a child process.
#[derive(Debug, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub(super) enum Task {
    /// An attempt at a job.
    Attempt(Job),
    /// A check of received files, which are in the folder of the child.
    Inspection,
    /// A preview of an analysis.
    Preview(Box<Params>),
}

/// The job of an attempt.
#[derive(Debug, Serialize, Deserialize)]
pub(super) struct Job {
    /// Id of the job, for the log.
    pub(super) id: JobId,
    /// Number of the attempt, for the log.
    pub(super) attempt: i64,
    /// Trace of the request that queued the job, for the log.
    pub(super) trace_id: Option<String>,
    /// Kind of the job.
    pub(super) kind: String,
    /// Input of the job, JSON.
    pub(super) input: String,
    /// Hash and size of the footage that the job works on; `None` for jobs of other kinds.
    pub(super) footage: Option<FootageSummary>,
}

/// A part of the result that an earlier attempt has kept.
#[derive(Debug, Serialize, Deserialize)]
pub struct Part {
    /// Number of the part.
    pub number: u32,
    /// Folder with the files that later attempts need.
    pub folder: PathBuf,
}

/// A line of the child.
#[derive(Debug, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub(super) enum Message {
    /// Stage, and completed share of the stage, 0..=1.
    Progress(String, f64),
    /// Number of decoded frames, and the seconds that they took.
    Decoded(u64, f64),
    /// A part of the result is finished and synced: its number, and the files in its folder. The worker stores it and
    /// takes the folder away.
    Part(u32, Vec<File>),
    /// The last line.
    End(End),
}

/// How an attempt ended.
#[derive(Debug, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub(super) enum End {
    /// The files are complete and synced.
    Done(Product, Vec<File>),
    /// The received files are a film of this format.
    Inspected(Film),
    /// Preview of the analysis.
    Previewed(Preview),
    /// There is no result.
    Failed(Failure),
}

/// Result of an attempt, besides its files.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Product {
    /// The film, if the job makes footage.
    pub film: Option<Film>,
    /// All parameters, JSON.
    pub params: String,
    /// Summary for overviews, JSON.
    pub summary: String,
}

/// Format of a film.
#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
pub struct Film {
    /// Width in square pixels.
    pub width: u32,
    /// Height in square pixels.
    pub height: u32,
    /// Frame rate, frames per second.
    pub fps: f64,
    /// Number of frames.
    pub n_frames: usize,
}

/// A file of the result.
#[derive(Debug, Serialize, Deserialize)]
pub(super) struct File {
    name: String,
    size_bytes: i64,
    sha256: Vec<u8>,
}

/// Reason why an attempt has no result. A picture that shows it is in the folder of the attempt.
#[derive(Debug, Serialize, Deserialize)]
pub(super) struct Failure {
    /// Stable code.
    pub(super) code: String,
    /// Description for people.
    pub(super) sentence: String,
    /// Whether another attempt may succeed.
    pub(super) is_transient: bool,
    /// Changes of the request that may mend it, the most promising first.
    pub(super) mends: Vec<Mend>,
}

impl From<&Error> for Failure {
    fn from(error: &Error) -> Failure {
        Failure {
            code: error.code().name().to_owned(),
            sentence: error.to_string(),
            is_transient: error.is_transient(),
            mends: error.mends(),
        }
    }
}

impl From<BlobFile> for File {
    fn from(file: BlobFile) -> File {
        File {
            name: file.name,
            size_bytes: file.size_bytes,
            sha256: file.sha256,
        }
    }
}

impl From<File> for BlobFile {
    fn from(file: File) -> BlobFile {
        BlobFile {
            name: file.name,
            size_bytes: file.size_bytes,
            sha256: file.sha256,
        }
    }
}
