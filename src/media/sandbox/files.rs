//! Landlock (RELIABILITY.md, "The gate"): a child reads its one input and what its program is made
//! of, writes its one output, runs nothing but its program, opens no TCP connection and signals nobody
//! outside. Each kernel gives as much of this as it has.
//!
//! The output is a file that is there already, not a folder: the child can neither make nor remove
//! a file anywhere.

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

use super::{Cage, Layer};

/// What a program is made of: where it and its libraries lie.
#[derive(Clone, Debug, Default)]
pub(in crate::media) struct Reach {
    /// Files that may be run: the program and its loader.
    pub(in crate::media) runs: Vec<PathBuf>,
    /// Folders whose files may be read: those of its libraries.
    pub(in crate::media) reads: Vec<PathBuf>,
}

/// What libraries look at when they are loaded, besides themselves; none of it is anybody's secret.
const USUAL: [&str; 9] = [
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

/// The newest version of the rules that this code was written for.
const NEWEST: ABI = ABI::V6;

/// The rules of a child, ready to be entered; `None` where no layer wants them.
pub(super) fn ruleset(cage: &Cage, reach: &Reach) -> io::Result<Option<OwnedFd>> {
    let mut rules = Ruleset::default();
    let mut is_empty = true;
    for layer in [Layer::Files, Layer::Network, Layer::Signals] {
        if !cage.layers.has(layer) {
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
    if cage.layers.has(Layer::Files) {
        rules = allow(rules, cage, reach)?;
    }
    Ok(rules.into())
}

fn allow(mut rules: RulesetCreated, cage: &Cage, reach: &Reach) -> io::Result<RulesetCreated> {
    let read = BitFlags::from(AccessFs::ReadFile);
    let write = AccessFs::ReadFile | AccessFs::WriteFile | AccessFs::Truncate;
    let must = |path: &Path| PathFd::new(path).map_err(io::Error::other);
    for path in &reach.runs {
        rules = add(rules, must(path)?, AccessFs::Execute | AccessFs::ReadFile)?;
    }
    if let Some(input) = &cage.input {
        rules = add(rules, must(input)?, read)?;
    }
    if let Some(output) = &cage.output {
        rules = add(rules, must(output)?, write)?;
    }
    let usual = USUAL.iter().map(Path::new);
    // What is not there cannot be missed.
    for path in reach.reads.iter().map(PathBuf::as_path).chain(usual) {
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

/// Enters the rules, for good. Async-signal-safe.
pub(super) fn enter(ruleset: &OwnedFd) -> io::Result<()> {
    // SAFETY: the call takes a descriptor that is open, and reads no memory of ours.
    let entered =
        unsafe { libc::syscall(libc::SYS_landlock_restrict_self, ruleset.as_raw_fd(), 0) };
    match entered {
        0 => Ok(()),
        _ => Err(io::Error::last_os_error()),
    }
}
