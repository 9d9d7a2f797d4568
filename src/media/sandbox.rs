//! What a media child may do (RELIABILITY.md, "The gate", "Before exec"): its own session, death
//! with its parent, no new privileges, and limits on memory, processor time, file size, open files.
//!
//! Landlock and seccomp belong here too, after the limits; they are not written yet. RLIMIT_NPROC is
//! left out on purpose: it counts every process of the user, so it would fail innocent films on a
//! busy machine.

#![expect(unsafe_code, reason = "code between fork and exec needs `pre_exec`")]

use std::os::unix::process::CommandExt;
use std::process::Command;

use rustix::process::{Resource, Rlimit, Signal};

/// The limits of one child.
#[derive(Clone, Copy, Debug)]
pub(super) struct Cage {
    /// Address space, bytes.
    pub(super) memory_bytes: u64,
    /// Processor time of all threads together, seconds.
    pub(super) cpu_s: u64,
    /// Largest file it may write, bytes; 0 = it may write to pipes only.
    pub(super) file_bytes: u64,
}

/// Files a child may hold open: the libraries are mapped, not held.
const OPEN_FILES: u64 = 64;

/// Puts the cage around the child that `command` will start.
///
/// The parent's death is noticed through the *thread* that starts the child, so that thread must
/// live as long as the process (see `gate`).
pub(super) fn enclose(command: &mut Command, cage: Cage) {
    let parent = rustix::process::getpid();
    let enter = move || {
        rustix::process::setsid()?;
        rustix::process::set_parent_process_death_signal(Some(Signal::KILL))?;
        if rustix::process::getppid() != Some(parent) {
            // The parent died before the line above took hold.
            return Err(rustix::io::Errno::SRCH.into());
        }
        rustix::thread::set_no_new_privs(true)?;
        for (resource, limit) in [
            (Resource::As, cage.memory_bytes),
            (Resource::Cpu, cage.cpu_s),
            (Resource::Fsize, cage.file_bytes),
            (Resource::Nofile, OPEN_FILES),
            (Resource::Core, 0),
        ] {
            lower(resource, limit)?;
        }
        Ok(())
    };
    // SAFETY: between fork and exec only async-signal-safe work is allowed. `enter` makes plain
    // system calls on values copied into it: it neither allocates, nor locks, nor panics.
    unsafe {
        command.pre_exec(enter);
    }
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
