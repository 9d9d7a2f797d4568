//! Processor time of a child: what it used, and how long it waited while other processes had the processors.

use std::time::Duration;

use rustix::process::Pid;

/// Unit of the times in `/proc/PID/stat`: USER_HZ, which is 100 Hz on all processors that we support.
const TICK: Duration = Duration::from_millis(10);

/// Returns the processor time of all threads of a process, also of one that has exited and is not reaped; zero if
/// the kernel does not tell it.
pub(super) fn processor_time(process: Pid) -> Duration {
    let stat = std::fs::read_to_string(format!("/proc/{}/stat", process.as_raw_nonzero()));
    let stat = stat.unwrap_or_default();
    // The name of the program, in parentheses, may contain spaces. utime and stime are the fields 14 and 15.
    let after_name = stat.rsplit(')').next().unwrap_or_default();
    let fields = after_name.split_whitespace().skip(11).take(2);
    let ticks: u32 = fields.filter_map(|field| field.parse::<u32>().ok()).sum();
    TICK * ticks
}

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
    fn processor_time_grows_while_a_process_computes() {
        let process = rustix::process::getpid();
        let (before, start) = (processor_time(process), Instant::now());
        while processor_time(process) < before + 2 * TICK {
            assert!(start.elapsed() < Duration::from_secs(60), "it never grows");
        }
    }

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
