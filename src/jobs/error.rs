//! Errors of jobs: why a job failed, with the stable code of each reason.

use std::process::ExitStatus;

use super::refusal::mend::Mend;
use crate::{media, store};
use flockreel_core::code::Code;
use flockreel_core::footage::SourceError;
use flockreel_core::{analysis, fish, flock, formats};

/// Reasons why a job did not finish, one variant per failing part.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// This version cannot read the stored input.
    #[error("this version cannot read the stored input of the job: {0}")]
    Input(#[from] serde_json::Error),
    /// The input footage or library no longer exists.
    #[error("the footage or library of the job no longer exists: {0}")]
    InputAbsent(uuid::Uuid),
    /// The footage could not be opened, or a video could not be written.
    #[error(transparent)]
    Media(#[from] media::Error),
    /// A video could not be read to its end.
    #[error(transparent)]
    Source(#[from] SourceError),
    /// The analysis failed.
    #[error(transparent)]
    Analysis(#[from] analysis::Error),
    /// The analysis failed, for a reason that the footage shows or the request may mend.
    #[error("{cause}")]
    Refused {
        /// The error of the analysis.
        #[source]
        cause: analysis::Error,
        /// The frames that show the reason, JPEG.
        picture: Option<Vec<u8>>,
        /// Changes of the request that may mend it, the most promising first.
        mends: Vec<Mend>,
    },
    /// The flock could not be made.
    #[error(transparent)]
    Flock(#[from] flock::Error),
    /// The virtual fish could not be made.
    #[error(transparent)]
    Fish(#[from] fish::Error),
    /// A library folder could not be read or written.
    #[error(transparent)]
    LibraryDir(#[from] formats::library_dir::Error),
    /// The distance matrix of the library would be too large.
    #[error(transparent)]
    DistanceArray(#[from] formats::npy::Error),
    /// The store failed.
    #[error(transparent)]
    Store(#[from] store::Error),
    /// A file of the attempt could not be read or written.
    #[error("a file of the job could not be read or written: {0}")]
    Io(#[from] std::io::Error),
    /// The computation panicked.
    #[error("the computation stopped unexpectedly")]
    Panicked,
    /// The process of the attempt reported an error.
    #[error("{}", .0.sentence)]
    Attempt(FailedAttempt),
    /// The process of the attempt reached the limit of its memory.
    #[error("the job exceeded its memory limit")]
    MemoryLimit,
    /// The process of the attempt died by itself, or was killed from outside.
    #[error("the process of the job crashed: {0}")]
    Crashed(ExitStatus),
    /// The job exceeded its time limit.
    #[error("the job exceeded its time limit")]
    TimeLimit,
    /// The disk has too little space for the job's output.
    #[error("the disk has too little free space for the output of the job")]
    DiskFull,
    /// The job returns to the queue, because one of higher priority waits.
    #[error("the job gave way to another one")]
    GaveWay,
    /// No permit for work during a request became free in time ([`super::ConcurrencyLimit`]).
    #[error("the service is too busy: try again soon")]
    Busy,
    /// A user cancelled the job, or the process is stopping.
    #[error("the job was cancelled")]
    Cancelled,
}

/// An error that the process of an attempt reported.
#[derive(Debug)]
pub struct FailedAttempt {
    /// Stable code.
    pub code: Code,
    /// Description for people.
    pub sentence: String,
    /// Whether another attempt may succeed.
    pub is_transient: bool,
    /// The frames that show the reason, JPEG.
    pub picture: Option<Vec<u8>>,
    /// Changes of the request that may mend it, the most promising first.
    pub mends: Vec<Mend>,
}

impl Error {
    /// Returns the stable code.
    pub fn code(&self) -> Code {
        match self {
            Error::Input(_) => Code::InvalidParams,
            Error::InputAbsent(_) => Code::InputFailed,
            Error::Media(error) => error.code(),
            Error::Source(error) => error.code,
            Error::Analysis(error) | Error::Refused { cause: error, .. } => error.code(),
            Error::Flock(error) => error.code(),
            Error::Fish(error) => error.code(),
            Error::LibraryDir(error) => code_of_library_dir(error),
            Error::DistanceArray(error) => error.code(),
            Error::Store(error) => error.code(),
            Error::Io(error) => code_of_io(error),
            Error::Panicked => Code::Internal,
            Error::Attempt(failed) => failed.code,
            Error::MemoryLimit => Code::MemoryLimit,
            Error::Crashed(_) => Code::CrashedWorker,
            Error::TimeLimit => Code::TimeLimit,
            Error::DiskFull => Code::StorageFull,
            Error::Busy => Code::Busy,
            Error::GaveWay | Error::Cancelled => Code::Cancelled,
        }
    }

    /// Returns the JPEG that shows the reason, if there is one.
    pub fn picture(&self) -> Option<&[u8]> {
        match self {
            Error::Refused { picture, .. } => picture.as_deref(),
            Error::Attempt(failed) => failed.picture.as_deref(),
            _ => None,
        }
    }

    /// Returns the changes of the request that may mend the failure. Empty if none does.
    pub fn mends(&self) -> Vec<Mend> {
        match self {
            Error::Refused { mends, .. } => mends.clone(),
            Error::Attempt(failed) => failed.mends.clone(),
            Error::Analysis(_) => Vec::new(),
            _ => Mend::all_for(self.code()),
        }
    }

    /// Returns whether another attempt may succeed. True for errors of the file system, the database and the
    /// start of media tools, and for tools that were killed from outside; false for bad input, a full disk and
    /// panics.
    pub fn is_transient(&self) -> bool {
        match self {
            Error::Attempt(failed) => failed.is_transient,
            Error::Media(error) => is_transient_in_media(error),
            Error::Source(error) | Error::Analysis(analysis::Error::Source(error)) => {
                let cause = error.cause.downcast_ref();
                cause.is_some_and(is_transient_in_media)
            }
            Error::Store(_) | Error::Io(_) => self.code() == Code::Internal,
            Error::LibraryDir(formats::library_dir::Error::Io { .. }) => {
                self.code() == Code::Internal
            }
            _ => false,
        }
    }
}

fn is_transient_in_media(error: &media::Error) -> bool {
    matches!(error, media::Error::Io { .. } | media::Error::Killed)
}

fn code_of_library_dir(error: &formats::library_dir::Error) -> Code {
    match error {
        formats::library_dir::Error::Io { cause, .. } => code_of_io(cause),
        _ => Code::Internal,
    }
}

fn code_of_io(error: &std::io::Error) -> Code {
    match error.kind() {
        std::io::ErrorKind::StorageFull | std::io::ErrorKind::QuotaExceeded => Code::StorageFull,
        _ => Code::Internal,
    }
}

#[cfg(test)]
mod tests {
    use std::io::ErrorKind;

    use super::*;

    #[test]
    fn error_of_a_full_disk_has_its_code() {
        for kind in [ErrorKind::StorageFull, ErrorKind::QuotaExceeded] {
            assert_eq!(Error::Io(kind.into()).code(), Code::StorageFull);
        }
        assert_eq!(Error::Io(ErrorKind::NotFound.into()).code(), Code::Internal);
    }

    #[test]
    fn failed_start_or_kill_of_a_tool_is_transient_and_bad_input_is_not() {
        let io = |kind: std::io::ErrorKind| media::Error::Io {
            doing: "starting the media tool",
            source: kind.into(),
        };
        let busy = || io(std::io::ErrorKind::WouldBlock);
        assert!(Error::Media(busy()).is_transient());
        assert!(Error::Source(busy().into()).is_transient());
        let killed = analysis::Error::Source(media::Error::Killed.into());
        assert!(Error::Analysis(killed).is_transient());
        for error in [media::Error::TimeLimit, media::Error::NoVideoStream] {
            assert!(!Error::Source(error.into()).is_transient());
        }
        assert!(!Error::Media(media::Error::StorageFull).is_transient());
    }
}
