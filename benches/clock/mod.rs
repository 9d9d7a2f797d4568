//! Time that this process's threads spent on a core: what a measurement on a machine that others use too
//! can be told by.

use std::path::Path;
use std::time::Instant;

/// Seconds on a core of all threads that live at the start and at the end of `run`; where the system does not
/// say, seconds by the clock.
pub fn core_seconds(run: impl FnOnce()) -> f64 {
    let (start, before) = (Instant::now(), on_cores());
    run();
    match (before, on_cores()) {
        (Some(before), Some(after)) if after > before => (after - before) as f64 / 1e9,
        _ => start.elapsed().as_secs_f64(),
    }
}

/// Nanoseconds.
fn on_cores() -> Option<u64> {
    let tasks = std::fs::read_dir(Path::new("/proc/self/task")).ok()?;
    let of = |task: std::io::Result<std::fs::DirEntry>| {
        let text = std::fs::read_to_string(task.ok()?.path().join("schedstat")).ok()?;
        text.split_whitespace().next()?.parse::<u64>().ok()
    };
    tasks.map(of).sum()
}
