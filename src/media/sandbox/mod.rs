//! What a media child may do (RELIABILITY.md, "The gate", "Before exec"): layers that do not rely on
//! each other, so that what slips through one is held by the next. Everything that allocates is
//! prepared before the fork; after it there are plain system calls alone.
//!
//! RLIMIT_NPROC is left out on purpose: it counts every thread of the *user*, so that it fails innocent
//! films on a busy machine, and it does not hold for root at all. `calls` refuses new processes instead,
//! however many there are, and threads are bounded by the address space that their stacks need.

#![expect(unsafe_code, reason = "code between fork and exec needs `pre_exec`")]

mod calls; // seccomp: the filter
mod files; // Landlock: files, network, signals
mod layer; // the layers by name, and which of them this machine has
mod refused; // which system calls the filter refuses, and why

use std::io;
use std::os::fd::OwnedFd;
use std::os::unix::process::CommandExt;
use std::path::PathBuf;
use std::process::Command;

use rustix::process::{Resource, Rlimit, Signal};
use rustix::thread::{CapabilitySet, CapabilitySets};

pub(super) use files::Reach;
pub use layer::{Layer, Layers};
pub(super) use layer::{lack_of, landlock_abi};

/// The walls around one child.
#[derive(Clone, Debug)]
pub(super) struct Cage {
    /// Which layers stand.
    pub(super) layers: Layers,
    /// Address space, bytes.
    pub(super) memory_bytes: u64,
    /// Processor time of all threads together, seconds.
    pub(super) cpu_s: u64,
    /// Largest file it may write, bytes; 0 = it may write to pipes only.
    pub(super) file_bytes: u64,
    /// The one file that it may read, besides its own libraries.
    pub(super) input: Option<PathBuf>,
    /// The one file that it may write; it must be there already.
    pub(super) output: Option<PathBuf>,
}

/// Files a child may hold open: the libraries are mapped, not held.
const OPEN_FILES: u64 = 64;

/// Puts the cage around the child that `command` will start, a program of this reach.
///
/// The parent's death is noticed through the *thread* that starts the child, so that thread must
/// live as long as the process (see `gate`). Fails when a file that the child is to use is not there.
pub(super) fn enclose(command: &mut Command, cage: &Cage, reach: &Reach) -> io::Result<()> {
    let ruleset = files::ruleset(cage, reach)?;
    let mut refusals = match cage.layers.has(Layer::Calls) {
        true => calls::program(),
        false => Vec::new(),
    };
    let parent = rustix::process::getpid();
    let (layers, limits) = (cage.layers, limits_of(cage));
    let enter = move || {
        rustix::process::setsid()?;
        if layers.has(Layer::Leash) {
            rustix::process::set_parent_process_death_signal(Some(Signal::KILL))?;
        }
        if rustix::process::getppid() != Some(parent) {
            // The parent died before the line above took hold.
            return Err(rustix::io::Errno::SRCH.into());
        }
        // The kernel wants it of whoever enters the layers below.
        rustix::thread::set_no_new_privs(true)?;
        if layers.has(Layer::Privileges) {
            drop_privileges()?;
        }
        if layers.has(Layer::Limits) {
            for (resource, limit) in limits {
                lower(resource, limit)?;
            }
        }
        enter_rules(ruleset.as_ref(), &mut refusals)
    };
    // SAFETY: between fork and exec only async-signal-safe work is allowed. `enter` makes plain
    // system calls on values that were made before: it neither allocates, nor locks, nor panics.
    unsafe {
        command.pre_exec(enter);
    }
    Ok(())
}

fn limits_of(cage: &Cage) -> [(Resource, u64); 5] {
    [
        (Resource::As, cage.memory_bytes),
        (Resource::Cpu, cage.cpu_s),
        (Resource::Fsize, cage.file_bytes),
        (Resource::Nofile, OPEN_FILES),
        (Resource::Core, 0),
    ]
}

/// Gives up what root may do, but for reaching the files of others: a service of root's may be asked
/// for a person's file, and `files` draws the border there. Of an ordinary user there is nothing to drop.
fn drop_privileges() -> rustix::io::Result<()> {
    let held = rustix::thread::capabilities(None)?;
    let kept = held.permitted & (CapabilitySet::DAC_OVERRIDE | CapabilitySet::DAC_READ_SEARCH);
    let sets = CapabilitySets {
        effective: held.effective & kept,
        permitted: kept,
        inheritable: CapabilitySet::empty(),
    };
    rustix::thread::set_capabilities(None, sets)
}

/// Lowers a limit, never raising one that the system or an administrator has set.
fn lower(resource: Resource, limit: u64) -> rustix::io::Result<()> {
    let held = rustix::process::getrlimit(resource).maximum;
    let limit = Some(held.map_or(limit, |held| held.min(limit)));
    rustix::process::setrlimit(
        resource,
        Rlimit {
            current: limit,
            maximum: limit,
        },
    )
}

/// The last two layers, in this order: the second refuses what it takes to enter the first.
fn enter_rules(ruleset: Option<&OwnedFd>, refusals: &mut [libc::sock_filter]) -> io::Result<()> {
    if let Some(ruleset) = ruleset {
        files::enter(ruleset)?;
    }
    match refusals.is_empty() {
        true => Ok(()),
        false => calls::enter(refusals),
    }
}
