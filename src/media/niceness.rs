//! Media tools step back for requests as the jobs do that ask for them (RELIABILITY.md, H5): decoding takes minutes and has
//! time. What a request waits for, as the look at an upload, is asked for by a thread that is not nice.

use rustix::process::{Pid, getpriority_process, setpriority_process};

/// Gives the child the niceness of the thread that asks for it, since another starts it; and its session too: a
/// session of its own has a share of its own where Linux groups sessions for the scheduler (autogroup), however nice
/// the processes in it are. Where it may not be, the child is no less itself.
pub(super) fn pass_on(child: Pid) {
    if let Ok(niceness @ 1..) = getpriority_process(None) {
        setpriority_process(Some(child), niceness).ok();
        let group = format!("/proc/{}/autogroup", child.as_raw_nonzero());
        std::fs::write(group, niceness.to_string()).ok();
    }
}
