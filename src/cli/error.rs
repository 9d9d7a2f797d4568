//! Errors of commands, with advice and exit status (docs/reference/command-line.md).
//!
//! This module decides which error codes are the user's fault (2) and which are internal failures (1), as
//! `api/problem.rs` does for HTTP.

use crate::{jobs, media, store};
use flockreel_core::code::Code;
use flockreel_core::fish;

/// Reasons why a command failed. Each prints as one line in lower case, with the value at the end.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// The arguments are inconsistent, or a file that they name cannot be read.
    #[error("{0}")]
    Usage(String),
    /// The work was refused or failed, for a reason with a code.
    #[error("{sentence} ({code})")]
    Work {
        /// Stable code.
        code: Code,
        /// Description for people.
        sentence: String,
    },
    /// `doctor` found missing parts and has printed them.
    #[error("parts that flockreel needs are missing, each marked LACK above: {n_missing}")]
    MissingParts {
        /// Number of missing parts.
        n_missing: usize,
    },
    /// A file, a folder or an address could not be used.
    #[error("{what}: {cause}")]
    Io {
        /// Operation that failed, with the path.
        what: String,
        /// Error of the system.
        #[source]
        cause: std::io::Error,
    },
}

impl Error {
    /// Returns the error of an algorithm or a media tool, with its code.
    pub fn work(code: Code, error: &dyn std::error::Error) -> Error {
        Error::Work {
            code,
            sentence: error.to_string(),
        }
    }

    /// Returns a function for `map_err` that adds the operation to an I/O error.
    pub fn io(what: impl Into<String>) -> impl FnOnce(std::io::Error) -> Error {
        let what = what.into();
        move |cause| Error::Io { what, cause }
    }

    /// Returns advice on what to do, if the reason has a code.
    pub fn advice(&self) -> Option<&'static str> {
        match self {
            Error::Work { code, .. } => Some(code.advice()),
            Error::Usage(_) | Error::Io { .. } | Error::MissingParts { .. } => None,
        }
    }

    /// Returns the exit status: 2 for bad usage or bad input, 1 for an internal failure.
    pub fn exit_code(&self) -> u8 {
        match self {
            Error::Usage(_) => 2,
            Error::Work { code, .. } if is_internal(*code) => 1,
            Error::Work { .. } => 2,
            Error::Io { .. } | Error::MissingParts { .. } => 1,
        }
    }
}

fn is_internal(code: Code) -> bool {
    matches!(
        code,
        Code::Internal | Code::StorageFull | Code::MemoryLimit | Code::DecoderCrashed
    )
}

impl From<media::Error> for Error {
    fn from(error: media::Error) -> Error {
        Error::work(error.code(), &error)
    }
}

impl From<jobs::Error> for Error {
    fn from(error: jobs::Error) -> Error {
        Error::work(error.code(), &error)
    }
}

impl From<fish::Error> for Error {
    fn from(error: fish::Error) -> Error {
        Error::work(error.code(), &error)
    }
}

/// A store that cannot be opened or belongs to another database is a usage error. One that is in use is not: it becomes
/// free when the other process ends.
impl From<store::Error> for Error {
    fn from(error: store::Error) -> Error {
        match error {
            store::Error::ForeignFiles => Error::Usage(error.to_string()),
            store::Error::InUse(folder) => Error::Io {
                what: "the data folder is in use by another flockreel".to_owned(),
                cause: std::io::Error::other(folder.display().to_string()),
            },
            store::Error::Unusable { .. } if error.code() == Code::Internal => {
                Error::Usage(error.to_string())
            }
            store::Error::Unreachable { place, cause } => Error::Io {
                what: format!("the database at {place} cannot be reached"),
                cause: std::io::Error::other(cause),
            },
            _ => Error::work(error.code(), &error),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bad_film_exits_with_2_and_full_disk_with_1() {
        let of = |code| {
            let sentence = "why".to_owned();
            Error::Work { code, sentence }.exit_code()
        };
        assert_eq!(of(Code::NotAVideo), 2);
        assert_eq!(of(Code::StorageFull), 1);
        assert_eq!(Error::Usage("no such file: x".into()).exit_code(), 2);
    }

    #[test]
    fn a_data_folder_in_use_exits_with_1_because_a_later_start_may_succeed() {
        let error = Error::from(store::Error::InUse("films".into()));
        assert_eq!(error.exit_code(), 1);
        assert_eq!(
            error.to_string(),
            "the data folder is in use by another flockreel: films"
        );
    }
}
