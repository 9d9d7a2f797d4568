//! Time in which a child was ready to run, but other processes had the processors.

use std::time::Duration;

use rustix::process::Pid;

/// Returns how long the thread of a process that waited longest for a processor did so; zero if the kernel does
/// not count it (`/proc/PID/task/TID/schedstat`: running, waiting, slices; nanoseconds).
pub(super) fn processor_wait(process: Pid) -> Duration {
    let tasks = format!("/proc/{}/task", process.as_raw_nonzero());
    let tasks = std::fs::read_dir(tasks).into_iter().flatten().flatten();
    let waits = tasks.filter_map(|task| {
        let counts = std::fs::read_to_string(task.path().join("schedstat")).ok()?;
        counts.split_whitespace().nth(1)?.parse().ok()
    });
    Duration::from_nanos(waits.max().unwrap_or_default())
}

#[cfg(test)]
mod tests {
    use std::time::Instant;

    use super::*;

    #[test]
    fn threads_that_share_processors_wait_for_them() {
        let before = processor_wait(rustix::process::getpid());
        let end = Instant::now() + Duration::from_millis(300);
        let n_threads = 8 * crate::config::cores();
        let threads = (0..n_threads).map(|_| {
            std::thread::spawn(move || {
                while Instant::now() < end {
                    std::hint::spin_loop();
                }
                processor_wait(rustix::process::getpid())
            })
        });
        let threads: Vec<_> = threads.collect();
        let waits = threads.into_iter().filter_map(|thread| thread.join().ok());
        let least = before + Duration::from_millis(100);
        assert!(waits.max().is_some_and(|wait| wait > least));
    }
}
