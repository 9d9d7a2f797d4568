//! Sandbox of a media child process (docs/explanation/promises.md, "Sandbox"). The layers are independent, so
//! what one layer misses another catches. Everything that allocates is prepared before the fork; after it the
//! child makes only plain system calls.
//!
//! RLIMIT_NPROC is deliberately omitted. It counts all threads of the user, so valid films would fail on a
//! busy machine, and it does not apply to root. `calls` refuses new processes instead. The address space
//! limit bounds the number of threads, because each needs a stack.

#![expect(unsafe_code, reason = "code between fork and exec needs `pre_exec`")]

mod calls; // seccomp filter
mod files; // Landlock: files, network, signals
mod layer; // names of the layers, and support by this machine
mod refused; // refused system calls, with reasons

use std::io;
use std::os::fd::OwnedFd;
use std::os::unix::process::CommandExt;
use std::path::PathBuf;
use std::process::Command;

use rustix::process::{Pid, Resource, Rlimit, Signal};
use rustix::thread::{CapabilitySet, CapabilitySets};

pub(super) use files::ProgramFiles;
pub use layer::{Layer, Layers};
pub(super) use layer::{landlock_abi, unsupported_reason};

/// Sandbox settings of one child.
#[derive(Clone, Debug)]
pub(super) struct Policy {
    /// Layers to apply.
    pub(super) layers: Layers,
    /// Limit of the address space, bytes.
    pub(super) memory_bytes: u64,
    /// Limit of the processor time of all threads, seconds.
    pub(super) cpu_s: u64,
    /// Limit of the size of a written file, bytes; 0 allows output to pipes only.
    pub(super) file_bytes: u64,
    /// The only file that it may read, besides its libraries.
    pub(super) input: Option<PathBuf>,
    /// The only file that it may write. The file must exist.
    pub(super) output: Option<PathBuf>,
}

/// Limit of open file descriptors. Libraries are mapped and do not count.
const OPEN_FILES: u64 = 64;

/// Applies the sandbox to the child that `command` will start. `program_files` describes its program.
///
/// The kernel kills the child when the *thread* that started it ends, so that thread must live as long as the
/// process (see `gate`). Fails if a file that the child needs does not exist.
pub(super) fn apply(
    command: &mut Command,
    policy: &Policy,
    program_files: &ProgramFiles,
) -> io::Result<()> {
    let ruleset = files::ruleset(policy, program_files)?;
    let mut refusals = if policy.layers.has(Layer::Calls) {
        calls::program()
    } else {
        Vec::new()
    };
    let parent = rustix::process::getpid();
    let (layers, limits) = (policy.layers, limits_of(policy));
    let enter = move || {
        rustix::process::setsid()?;
        if layers.has(Layer::Leash) {
            die_with(parent)?;
        }
        // The kernel requires this of every process that enters the layers below.
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
    // SAFETY: between fork and exec only async-signal-safe work is allowed. `enter` makes plain system calls
    // on prepared values: it does not allocate, lock or panic.
    unsafe {
        command.pre_exec(enter);
    }
    Ok(())
}

/// Makes the child that `command` will start the leader of a process group that dies with this process. Like
/// [`apply`], it needs a starting thread that lives as long as the process.
pub(super) fn leash(command: &mut Command) {
    let parent = rustix::process::getpid();
    let enter = move || {
        rustix::process::setpgid(None, None)?;
        Ok(die_with(parent)?)
    };
    // SAFETY: between fork and exec only async-signal-safe work is allowed. `enter` makes plain system calls:
    // it does not allocate, lock or panic.
    unsafe {
        command.pre_exec(enter);
    }
}

/// Has the kernel kill the calling process when the thread that started it ends. Async-signal-safe.
fn die_with(parent: Pid) -> rustix::io::Result<()> {
    rustix::process::set_parent_process_death_signal(Some(Signal::KILL))?;
    if rustix::process::getppid() != Some(parent) {
        // The parent died before the death signal was set.
        return Err(rustix::io::Errno::SRCH);
    }
    Ok(())
}

fn limits_of(policy: &Policy) -> [(Resource, u64); 6] {
    [
        (Resource::As, policy.memory_bytes),
        // An attempt at a job has a limit of its own, which its tools do not inherit.
        (Resource::Data, policy.memory_bytes),
        (Resource::Cpu, policy.cpu_s),
        (Resource::Fsize, policy.file_bytes),
        (Resource::Nofile, OPEN_FILES),
        (Resource::Core, 0),
    ]
}

/// Drops all capabilities of root, except access to other users' files. A service run by root may have to
/// read such a file, and `files` limits which. An ordinary user has no capabilities to drop.
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

/// Lowers a limit. Never raises a limit set by the system or an administrator.
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

/// Enters the last two layers. The order matters: the second refuses the calls needed to enter the first.
fn enter_rules(ruleset: Option<&OwnedFd>, refusals: &mut [libc::sock_filter]) -> io::Result<()> {
    if let Some(ruleset) = ruleset {
        files::enter(ruleset)?;
    }
    if refusals.is_empty() {
        Ok(())
    } else {
        calls::enter(refusals)
    }
}
