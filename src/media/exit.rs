//! Exit of a media child process and its meaning as an error code (docs/explanation/promises.md, "Bad
//! input").

use std::os::unix::process::ExitStatusExt;
use std::path::PathBuf;
use std::process::ExitStatus;

use super::error::Error;

/// The exit of a child process.
pub(super) struct Exit {
    /// Exit code or signal.
    pub(super) status: ExitStatus,
    /// Whether it reached the limit of its processor time.
    pub(super) used_up_processor_time: bool,
    /// The end of its stderr.
    pub(super) stderr_tail: String,
}

impl Exit {
    /// Returns the exit if it was successful, otherwise the error that it means.
    pub(super) fn check(self) -> Result<Exit, Error> {
        const OUT_OF_MEMORY: [&str; 4] = [
            "Cannot allocate memory",
            "_buffer() failed",
            "failed to map segment",
            "thread_encoder_init failed",
        ];
        const SIGKILL: i32 = 9;
        const SIGXCPU: i32 = 24;
        const SIGXFSZ: i32 = 25;
        let says = |what| self.stderr_tail.contains(what);
        match self.status.signal() {
            None if self.status.success() => Ok(self),
            Some(SIGXCPU) => Err(Error::TimeLimit),
            Some(SIGKILL) if self.used_up_processor_time => Err(Error::TimeLimit),
            Some(SIGXFSZ) => Err(Error::StorageFull),
            _ if says("No space left on device") || says("Disk quota exceeded") => {
                Err(Error::StorageFull)
            }
            _ if OUT_OF_MEMORY.into_iter().any(says) => Err(Error::MemoryLimit {
                stderr_tail: self.stderr_tail,
            }),
            // Flockreel kills only children that it no longer waits for.
            Some(SIGKILL) => Err(Error::Killed),
            _ => Err(Error::Crashed {
                status: self.status.to_string(),
                stderr_tail: self.stderr_tail,
            }),
        }
    }
}

/// Replaces the paths of our files in a message of a child.
pub(super) fn hide_paths(files: &[PathBuf], stderr_tail: String) -> String {
    files.iter().fold(stderr_tail, |text, file| {
        let path = file.to_string_lossy();
        text.replace(&*format!("file:{path}"), "the file")
            .replace(&*path, "the file")
    })
}
