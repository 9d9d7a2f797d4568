//! Why a command ends without success, in one line, what to do about it, and the exit code that goes with it
//! (DESIGN.md, Command line). Which code of `code.rs` is whose fault is decided here for the
//! command line, as `api/problem.rs` decides it for HTTP.

use crate::code::Code;

/// The reasons; each prints as one clear line, lower case, the value last.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// The arguments make no sense together, or a file named by them cannot be read.
    #[error("{0}")]
    Usage(String),
    /// The work was refused or failed, for a reason that has a code.
    #[error("{sentence} ({code})")]
    Work {
        /// The stable reason.
        code: Code,
        /// What happened, and what to do next.
        sentence: String,
    },
    /// `doctor` found things missing, and has said which.
    #[error("this machine lacks what flockreel needs or wants, as told above: {n_lacks}")]
    Lacks {
        /// How many.
        n_lacks: usize,
    },
    /// A file or folder could not be read or written.
    #[error("{what}: {cause}")]
    Io {
        /// What was tried, with the path.
        what: String,
        /// What the system said.
        #[source]
        cause: std::io::Error,
    },
}

impl Error {
    /// A reason that has a code: the error of an algorithm or of the gate.
    pub fn work(code: Code, error: &dyn std::error::Error) -> Error {
        Error::Work {
            code,
            sentence: error.to_string(),
        }
    }

    /// The gate's reason.
    pub fn work_of_media(error: &crate::media::Error) -> Error {
        Error::work(error.code(), error)
    }

    /// For `map_err`: a file operation named by what it tried.
    pub fn io(what: impl Into<String>) -> impl FnOnce(std::io::Error) -> Error {
        let what = what.into();
        move |cause| Error::Io { what, cause }
    }

    /// Returns what to do about it, where the reason has a code.
    pub fn advice(&self) -> Option<&'static str> {
        match self {
            Error::Work { code, .. } => Some(code.advice()),
            Error::Usage(_) | Error::Io { .. } | Error::Lacks { .. } => None,
        }
    }

    /// 2 where the person can mend it (usage or input), 1 where something failed inside.
    pub fn exit_code(&self) -> u8 {
        match self {
            Error::Usage(_) => 2,
            Error::Work { code, .. } if is_failure_inside(*code) => 1,
            Error::Work { .. } => 2,
            Error::Io { .. } | Error::Lacks { .. } => 1,
        }
    }
}

fn is_failure_inside(code: Code) -> bool {
    matches!(
        code,
        Code::Internal | Code::StorageFull | Code::MemoryLimit | Code::DecoderCrashed
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_bad_film_exits_with_2_and_a_full_disk_with_1() {
        let of = |code| {
            let sentence = "why".to_owned();
            Error::Work { code, sentence }.exit_code()
        };
        assert_eq!(of(Code::NotAVideo), 2);
        assert_eq!(of(Code::StorageFull), 1);
        assert_eq!(Error::Usage("no such file: x".into()).exit_code(), 2);
    }
}
