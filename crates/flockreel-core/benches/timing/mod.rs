//! Arguments, threads and times of the benchmarks.

use std::time::Instant;

/// Returns the arguments of the program, without the flag that cargo adds.
pub(crate) fn arguments() -> impl Iterator<Item = String> {
    std::env::args()
        .skip(1)
        .filter(|argument| argument != "--bench")
}

/// Runs `work` on `n_threads` threads.
pub(crate) fn on_threads<R: Send>(n_threads: usize, work: impl FnOnce() -> R + Send) -> R {
    let pool = rayon::ThreadPoolBuilder::new()
        .num_threads(n_threads)
        .build();
    pool.expect("threads can be made").install(work)
}

/// Returns the time of the fastest of `n_runs` runs, seconds.
pub(crate) fn fastest_s(n_runs: u32, mut run: impl FnMut()) -> f64 {
    let mut time_s = |_| {
        let start = Instant::now();
        run();
        start.elapsed().as_secs_f64()
    };
    (0..n_runs).map(&mut time_s).fold(f64::INFINITY, f64::min)
}
