//! Priority of media tools. A decoder works for minutes, so it runs at the low priority of the job that needs
//! it and yields to requests (docs/explanation/promises.md, "Overload"). A tool that a request waits for,
//! such as the check of an upload, is started by a thread of normal priority.

use rustix::process::{Pid, getpriority_process, setpriority_process};

/// Gives the child the niceness of the calling thread; another thread starts the child.
///
/// Sets the niceness of its autogroup, too. The child has its own session, and Linux gives each session its
/// own share of the processor, regardless of the niceness within. Failure is ignored: the child then runs at
/// normal priority.
pub(super) fn pass_on(child: Pid) {
    if let Ok(niceness @ 1..) = getpriority_process(None) {
        setpriority_process(Some(child), niceness).ok();
        let group = format!("/proc/{}/autogroup", child.as_raw_nonzero());
        std::fs::write(group, niceness.to_string()).ok();
    }
}
