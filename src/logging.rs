//! Log lines on stderr that never cost an answer. Lines go through a bounded queue to one thread, and only that
//! thread waits for stderr. Lines that find the queue full, or a stderr that takes no more bytes, are dropped and
//! counted: a dead or stalled reader of stderr must not stop the service.

use std::backtrace::{Backtrace, BacktraceStatus};
use std::io::{self, ErrorKind, IsTerminal, Write};
use std::sync::OnceLock;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::time::{Duration, Instant};

use clap::ValueEnum;
use rustix::event::{PollFd, PollFlags, Timespec, poll};
use rustix::io::Errno;
use tracing_appender::non_blocking::{NonBlocking, NonBlockingBuilder, WorkerGuard};
use tracing_subscriber::EnvFilter;

/// Lines that wait for stderr at most: a few megabytes, seconds of a busy service.
const MAX_QUEUED_LINES: usize = 8192;
/// The largest piece that a pipe with free room takes without blocking, bytes (PIPE_BUF of Linux).
const PIECE_BYTES: usize = 4096;
/// How often the thread that waits for stderr looks whether the process ends. Below the 100 ms that
/// `WorkerGuard` waits for a place in a full queue.
const LOOK: Duration = Duration::from_millis(20);
/// How long a process that ends waits for a stderr that takes no bytes.
const LAST_WAIT: Duration = Duration::from_millis(50);

static QUEUE: OnceLock<NonBlocking> = OnceLock::new();
/// Lines that stderr did not take.
static N_UNWRITTEN: AtomicU64 = AtomicU64::new(0);
static ENDS: AtomicBool = AtomicBool::new(false);

/// How log lines are written.
#[derive(Clone, Copy, Debug, ValueEnum)]
pub enum LogFormat {
    /// Lines for people.
    Text,
    /// A JSON object a line, with the ids of the request and the job that it belongs to.
    Json,
}

/// The running log. Writes the queued lines when dropped, within about a second.
#[must_use]
#[derive(Debug)]
pub struct Log {
    _writer: WorkerGuard,
}

impl Drop for Log {
    fn drop(&mut self) {
        ENDS.store(true, Ordering::Relaxed);
    }
}

/// Starts the log of the process, once. `filter` is in the syntax of `tracing_subscriber::EnvFilter`.
pub fn start(filter: &str, format: LogFormat) -> Log {
    let (queue, writer) = NonBlockingBuilder::default()
        .lossy(true)
        .buffered_lines_limit(MAX_QUEUED_LINES)
        .thread_name("log")
        .finish(Stderr { is_stuck: false });
    let queue = QUEUE.get_or_init(|| queue).clone();
    let lines = tracing_subscriber::fmt()
        .with_env_filter(EnvFilter::new(filter))
        .with_writer(queue)
        .with_ansi(io::stderr().is_terminal())
        .with_target(false)
        .log_internal_errors(false);
    match format {
        LogFormat::Text => lines.init(),
        LogFormat::Json => lines
            .json()
            .flatten_event(true)
            .with_span_list(false)
            .init(),
    }
    Log { _writer: writer }
}

/// Has panics logged as other events are. The default hook writes to stderr itself, and a stalled reader would
/// block the panicking thread.
pub fn log_panics() {
    std::panic::set_hook(Box::new(|panic| {
        let message = panic.payload_as_str().unwrap_or("no message");
        let at = panic.location().map(ToString::to_string);
        let backtrace = Backtrace::capture();
        let is_captured = backtrace.status() == BacktraceStatus::Captured;
        let backtrace = is_captured.then(|| backtrace.to_string());
        let (at, backtrace) = (at.as_deref(), backtrace.as_deref());
        tracing::error!(at, backtrace, "a thread panicked: {message}");
    }));
}

/// Writes one line to stderr, in order with the log lines once the log has started. Failure is ignored: there is
/// nowhere left to report it.
pub fn say(line: &str) {
    let line = format!("{line}\n");
    match QUEUE.get() {
        Some(queue) => queue.clone().write_all(line.as_bytes()).ok(),
        None => io::stderr().write_all(line.as_bytes()).ok(),
    };
}

/// Returns the number of lines that were dropped since the process started.
pub fn n_lost_lines() -> u64 {
    let unqueued = QUEUE
        .get()
        .map_or(0, |queue| queue.error_counter().dropped_lines());
    unqueued as u64 + N_UNWRITTEN.load(Ordering::Relaxed)
}

/// Stderr for the thread that may wait for it. It goes without the lock of the standard library, which a blocked
/// write would hold against all other threads.
struct Stderr {
    /// Whether stderr took nothing since the process began to end.
    is_stuck: bool,
}

impl Stderr {
    /// Returns once a piece can be written without blocking, or cannot be written at all. Fails with
    /// [`ErrorKind::TimedOut`] if the process ends and stderr takes nothing.
    fn wait(&mut self) -> io::Result<()> {
        let (stderr, mut end) = (io::stderr(), None);
        let look_ns = match self.is_stuck {
            true => 0,
            false => i64::from(LOOK.subsec_nanos()),
        };
        let look = Timespec {
            tv_sec: 0,
            tv_nsec: look_ns,
        };
        loop {
            let ready = poll(&mut [PollFd::new(&stderr, PollFlags::OUT)], Some(&look));
            match ready {
                Ok(0) | Err(Errno::INTR) => {}
                Ok(_) => return Ok(()),
                Err(error) => return Err(error.into()),
            }
            if ENDS.load(Ordering::Relaxed) {
                let end = *end.get_or_insert_with(|| Instant::now() + LAST_WAIT);
                self.is_stuck |= Instant::now() >= end;
                if self.is_stuck {
                    return Err(ErrorKind::TimedOut.into());
                }
            }
        }
    }
}

impl Write for Stderr {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.wait()?;
        let piece = &bytes[..bytes.len().min(PIECE_BYTES)];
        Ok(rustix::io::write(io::stderr(), piece)?)
    }

    fn write_all(&mut self, line: &[u8]) -> io::Result<()> {
        let mut rest = line;
        while !rest.is_empty() {
            match self.write(rest) {
                Ok(n) if n > 0 => rest = &rest[n..],
                Err(error) if error.kind() == ErrorKind::Interrupted => {}
                ended => {
                    N_UNWRITTEN.fetch_add(1, Ordering::Relaxed);
                    return ended.and(Err(ErrorKind::WriteZero.into()));
                }
            }
        }
        Ok(())
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}
