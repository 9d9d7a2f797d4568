//! Landlock rules (docs/explanation/promises.md, "Sandbox"). A child may read its input and its libraries,
//! write its output and run its own program. It may not open TCP connections or signal outside processes.
//! Each kernel enforces as much of this as it supports.
//!
//! The output is an existing file, not a folder, so the child cannot create or delete files.

#![expect(
    unsafe_code,
    reason = "a rule set is entered by a system call after the fork"
)]

use std::io;
use std::os::fd::{AsRawFd, OwnedFd};
use std::path::{Path, PathBuf};

use landlock::{
    ABI, Access, AccessFs, AccessNet, BitFlags, PathBeneath, PathFd, Ruleset, RulesetAttr,
    RulesetCreated, RulesetCreatedAttr, Scope,
};
use serde::{Deserialize, Serialize};

use super::{Layer, Policy};

/// Files that a program needs to run: the program, its loader and its libraries.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub(in crate::media) struct ProgramFiles {
    /// Files that may be executed: the program and its loader.
    pub(in crate::media) executables: Vec<PathBuf>,
    /// Folders of its libraries, which may be read.
    pub(in crate::media) library_dirs: Vec<PathBuf>,
}

/// Files that libraries read when they are loaded. None of them is secret.
const STARTUP_FILES: [&str; 9] = [
    "/etc/ld.so.cache",
    "/etc/ld.so.preload",
    "/dev/null",
    "/dev/zero",
    "/dev/urandom",
    "/proc/cpuinfo",
    "/proc/meminfo",
    "/sys/devices/system/cpu",
    "/sys/devices/system/node",
];

/// The newest Landlock ABI that this code was written for.
const NEWEST: ABI = ABI::V6;

/// Returns the rules of a child, ready to be entered; `None` if no layer needs them.
pub(super) fn ruleset(
    policy: &Policy,
    program_files: &ProgramFiles,
) -> io::Result<Option<OwnedFd>> {
    let mut rules = Ruleset::default();
    let mut is_empty = true;
    for layer in [Layer::Files, Layer::Network, Layer::Signals] {
        if !policy.layers.has(layer) {
            continue;
        }
        is_empty = false;
        rules = match layer {
            Layer::Files => rules.handle_access(AccessFs::from_all(NEWEST)),
            Layer::Network => rules.handle_access(AccessNet::from_all(NEWEST)),
            _ => rules.scope(Scope::from_all(NEWEST)),
        }
        .map_err(io::Error::other)?;
    }
    if is_empty {
        return Ok(None);
    }
    let mut rules = rules.create().map_err(io::Error::other)?;
    if policy.layers.has(Layer::Files) {
        rules = allow(rules, policy, program_files)?;
    }
    Ok(rules.into())
}

fn allow(
    mut rules: RulesetCreated,
    policy: &Policy,
    program_files: &ProgramFiles,
) -> io::Result<RulesetCreated> {
    let read = BitFlags::from(AccessFs::ReadFile);
    let write = AccessFs::ReadFile | AccessFs::WriteFile | AccessFs::Truncate;
    let open = |path: &Path| PathFd::new(path).map_err(io::Error::other);
    for path in &program_files.executables {
        rules = add(rules, open(path)?, AccessFs::Execute | AccessFs::ReadFile)?;
    }
    if let Some(input) = &policy.input {
        rules = add(rules, open(input)?, read)?;
    }
    if let Some(output) = &policy.output {
        rules = add(rules, open(output)?, write)?;
    }
    let startup_files = STARTUP_FILES.iter().map(Path::new);
    // Paths that do not exist are skipped.
    for path in program_files
        .library_dirs
        .iter()
        .map(PathBuf::as_path)
        .chain(startup_files)
    {
        if let Ok(found) = PathFd::new(path) {
            rules = add(rules, found, read | AccessFs::ReadDir)?;
        }
    }
    Ok(rules)
}

fn add(
    rules: RulesetCreated,
    path: PathFd,
    access: BitFlags<AccessFs>,
) -> io::Result<RulesetCreated> {
    rules
        .add_rule(PathBeneath::new(path, access))
        .map_err(io::Error::other)
}

/// Enters the rules. This cannot be undone. Async-signal-safe.
pub(super) fn enter(ruleset: &OwnedFd) -> io::Result<()> {
    // SAFETY: the call takes an open descriptor and reads no memory of this process.
    let entered =
        unsafe { libc::syscall(libc::SYS_landlock_restrict_self, ruleset.as_raw_fd(), 0) };
    match entered {
        0 => Ok(()),
        _ => Err(io::Error::last_os_error()),
    }
}
