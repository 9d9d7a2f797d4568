//! One run of a media tool: program, arguments, limits, and the files that it may open. `gate` starts it.

use std::ffi::OsString;
use std::path::{Path, PathBuf};
use std::time::Duration;

use serde::{Deserialize, Serialize};

use super::limits::Limits;
use super::sandbox::{Layers, Policy, ProgramFiles};
use crate::config;

/// An installed tool.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(super) struct InstalledTool {
    /// Path of the program.
    pub(super) path: PathBuf,
    /// Files that the program needs to run.
    pub(super) program_files: ProgramFiles,
    /// Layers of the sandbox in which it runs on this machine.
    pub(super) layers: Layers,
}

/// A run of a tool.
pub(super) struct Invocation<'a> {
    pub(super) tool: &'a InstalledTool,
    pub(super) args: Vec<OsString>,
    /// Whether the loader lists the program's libraries instead of running the program.
    pub(super) lists_libraries: bool,
    pub(super) policy: Policy,
    pub(super) time_limit: Duration,
    /// Longest wait for output, or for the acceptance of input.
    pub(super) stall_limit: Duration,
}

impl<'a> Invocation<'a> {
    /// Returns a run for work on `n_frames` frames (0 for reading headers). The child may open no file.
    pub(super) fn new(
        tool: &'a InstalledTool,
        args: Vec<OsString>,
        limits: &Limits,
        n_frames: usize,
    ) -> Invocation<'a> {
        let time_limit = match n_frames {
            0 => limits.probe_time,
            n => limits.work_time(n),
        };
        Invocation {
            tool,
            args,
            lists_libraries: false,
            policy: Policy {
                layers: limits.layers,
                memory_bytes: limits.max_memory_bytes,
                cpu_s: (time_limit.as_secs() + 1) * config::cores() as u64,
                file_bytes: 0,
                input: None,
                output: None,
            },
            time_limit,
            stall_limit: limits.stall_time.min(time_limit),
        }
    }

    /// Adds `more` to the time limit.
    pub(super) fn with_more_time(mut self, more: Duration) -> Invocation<'a> {
        self.time_limit += more;
        self
    }

    /// Allows the child to read a file.
    pub(super) fn with_input(mut self, path: &Path) -> Invocation<'a> {
        self.policy.input = Some(path.to_owned());
        self
    }

    /// Allows the child to write an existing file, up to `bytes`.
    pub(super) fn with_output(mut self, path: &Path, bytes: u64) -> Invocation<'a> {
        self.policy.output = Some(path.to_owned());
        self.policy.file_bytes = bytes;
        self
    }

    /// Makes the loader list the program's libraries and exit.
    pub(super) fn listing_libraries(mut self) -> Invocation<'a> {
        self.lists_libraries = true;
        self
    }
}
