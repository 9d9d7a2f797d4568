//! Log lines on stderr, written without ever delaying a response. A bounded queue passes the lines to one
//! thread, and only that thread waits for stderr. Lines are dropped and counted if the queue is full or
//! stderr takes no more bytes. A dead or stalled reader of stderr must not stop the service.
//!
//! In the JSON format every line is an object, also those that are not events: messages of commands, errors of
//! the command line, and panics.

use std::backtrace::{Backtrace, BacktraceStatus};
use std::io::{self, ErrorKind, IsTerminal, Write};
use std::sync::OnceLock;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::time::{Duration, Instant};

use clap::ValueEnum;
use rustix::event::{PollFd, PollFlags, Timespec, poll};
use rustix::io::Errno;
use tracing::Level;
use tracing_appender::non_blocking::{NonBlocking, NonBlockingBuilder, WorkerGuard};
use tracing_subscriber::fmt::format::Writer;
use tracing_subscriber::fmt::time::{FormatTime, SystemTime};
use tracing_subscriber::layer::SubscriberExt;
use tracing_subscriber::util::SubscriberInitExt;
use tracing_subscriber::{EnvFilter, Layer};

use crate::traces::Exporter;

/// Maximum number of lines that wait for stderr: a few megabytes, or seconds of a busy service.
const MAX_QUEUED_LINES: usize = 8192;
/// Largest write that a pipe with free space takes without blocking, bytes (PIPE_BUF of Linux).
const MAX_WRITE_BYTES: usize = 4096;
/// Interval at which the writer thread checks whether the process is ending. It must be less than the 100 ms
/// that `WorkerGuard` waits for space in a full queue.
const POLL_INTERVAL: Duration = Duration::from_millis(20);
/// Time that an ending process waits for a stderr that takes no bytes. Free choice.
const SHUTDOWN_WAIT: Duration = Duration::from_millis(50);

static QUEUE: OnceLock<NonBlocking> = OnceLock::new();
/// Filter and format of the log, once it has started.
static SETTINGS: OnceLock<(String, LogFormat)> = OnceLock::new();
/// Whether lines are JSON. Known before the log starts, for errors of the command line.
static IS_JSON: AtomicBool = AtomicBool::new(false);
/// Number of lines that stderr did not take.
static N_UNWRITTEN: AtomicU64 = AtomicU64::new(0);
/// Whether the process is ending.
static IS_ENDING: AtomicBool = AtomicBool::new(false);

/// Format of log lines.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum LogFormat {
    /// Plain text for people.
    Text,
    /// One JSON object per line, with the ids of the request and the job.
    Json,
}

/// The running log. Dropping it writes the queued lines, within about a second.
#[must_use]
#[derive(Debug)]
pub struct Log {
    _writer: WorkerGuard,
}

impl Drop for Log {
    fn drop(&mut self) {
        IS_ENDING.store(true, Ordering::Relaxed);
    }
}

/// Selects the format of lines that are written before the log starts.
pub fn set_format(format: LogFormat) {
    IS_JSON.store(format == LogFormat::Json, Ordering::Relaxed);
}

/// Returns whether lines are JSON objects.
pub fn is_json() -> bool {
    IS_JSON.load(Ordering::Relaxed)
}

/// Returns the filter if its syntax is that of `tracing_subscriber::EnvFilter`.
pub fn check_filter(filter: &str) -> Result<String, String> {
    let parsed = EnvFilter::try_new(filter);
    parsed.map_or_else(|error| Err(error.to_string()), |_| Ok(filter.to_owned()))
}

/// Starts the log of the process and its export of traces. Call it once. `filter` has passed [`check_filter`]; any
/// other logs errors only.
pub fn start(filter: &str, format: LogFormat, exporter: Option<&Exporter>) -> Log {
    let (queue, writer) = NonBlockingBuilder::default()
        .lossy(true)
        .buffered_lines_limit(MAX_QUEUED_LINES)
        .thread_name("log")
        .finish(Stderr { is_stuck: false });
    let queue = QUEUE.get_or_init(|| queue).clone();
    SETTINGS.get_or_init(|| (filter.to_owned(), format));
    set_format(format);
    let lines = tracing_subscriber::fmt::layer()
        .with_writer(queue)
        .with_ansi(io::stderr().is_terminal())
        .with_target(false)
        .log_internal_errors(false);
    let lines = match format {
        LogFormat::Text => lines.boxed(),
        LogFormat::Json => lines
            .json()
            .flatten_event(true)
            .with_span_list(false)
            .boxed(),
    };
    let filter = EnvFilter::try_new(filter).unwrap_or_default();
    tracing_subscriber::registry()
        .with(lines.with_filter(filter))
        .with(exporter.map(Exporter::layer))
        .init();
    Log { _writer: writer }
}

/// Logs panics like other events. The default hook writes to stderr directly, so a stalled reader would block
/// the panicking thread.
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

/// Writes a message for people to stderr, in order with the log lines once the log has started. In the JSON format
/// the message becomes an event, whatever the filter. Errors are ignored, because there is nowhere left to report
/// them.
pub fn say(message: &str) {
    say_at(Level::INFO, message);
}

/// Writes an error message to stderr, as [`say`] does.
pub fn say_error(message: &str) {
    say_at(Level::ERROR, message);
}

fn say_at(level: Level, message: &str) {
    if is_json() {
        write_line(&json_line(level, message));
    } else {
        write_line(message);
    }
}

/// Returns an event in the format of the log. The name of the program, with which messages begin, is left out.
fn json_line(level: Level, message: &str) -> String {
    let mut timestamp = String::new();
    // Writing to a string succeeds.
    SystemTime
        .format_time(&mut Writer::new(&mut timestamp))
        .ok();
    let message = serde_json::Value::from(message.trim_start_matches("flockreel: "));
    format!(r#"{{"timestamp":"{timestamp}","level":"{level}","message":{message}}}"#)
}

fn write_line(line: &str) {
    let line = format!("{line}\n");
    match QUEUE.get() {
        Some(queue) => queue.clone().write_all(line.as_bytes()).ok(),
        None => io::stderr().write_all(line.as_bytes()).ok(),
    };
}

/// Returns the command-line arguments that give a child process the log of this process; none before it has started.
pub fn arguments() -> Vec<String> {
    let Some((filter, format)) = SETTINGS.get() else {
        return Vec::new();
    };
    let format = format.to_possible_value();
    let format = format.map_or_else(String::new, |value| value.get_name().to_owned());
    vec![format!("--log={filter}"), format!("--log-format={format}")]
}

/// Writes a line from the stderr of a child process whose log has the same format. In a log of JSON objects, another
/// line, such as the last words of the standard library, becomes an event.
pub fn relay(line: &str) {
    if is_json() && !line.starts_with('{') {
        tracing::warn!("a child process says: {line}");
    } else {
        write_line(line);
    }
}

/// Returns the number of lines that were dropped since the process started.
pub fn n_lost_lines() -> u64 {
    let unqueued = QUEUE
        .get()
        .map_or(0, |queue| queue.error_counter().dropped_lines());
    unqueued as u64 + N_UNWRITTEN.load(Ordering::Relaxed)
}

/// Stderr for the writer thread, which may block. It bypasses the lock of the standard library, because a
/// blocked write would hold that lock against all other threads.
struct Stderr {
    /// Whether stderr took nothing since the process began to end.
    is_stuck: bool,
}

impl Stderr {
    /// Waits until a write would not block, or until it would fail. Returns [`ErrorKind::TimedOut`] if the
    /// process ends and stderr takes nothing.
    fn wait(&mut self) -> io::Result<()> {
        let (stderr, mut deadline) = (io::stderr(), None);
        let interval_ns = if self.is_stuck {
            0
        } else {
            i64::from(POLL_INTERVAL.subsec_nanos())
        };
        let interval = Timespec {
            tv_sec: 0,
            tv_nsec: interval_ns,
        };
        loop {
            let ready = poll(&mut [PollFd::new(&stderr, PollFlags::OUT)], Some(&interval));
            match ready {
                Ok(0) | Err(Errno::INTR) => {}
                Ok(_) => return Ok(()),
                Err(error) => return Err(error.into()),
            }
            if IS_ENDING.load(Ordering::Relaxed) {
                let deadline = *deadline.get_or_insert_with(|| Instant::now() + SHUTDOWN_WAIT);
                self.is_stuck |= Instant::now() >= deadline;
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
        let part = &bytes[..bytes.len().min(MAX_WRITE_BYTES)];
        Ok(rustix::io::write(io::stderr(), part)?)
    }

    fn write_all(&mut self, line: &[u8]) -> io::Result<()> {
        let mut rest = line;
        while !rest.is_empty() {
            match self.write(rest) {
                Ok(n) if n > 0 => rest = &rest[n..],
                Err(error) if error.kind() == ErrorKind::Interrupted => {}
                failed => {
                    N_UNWRITTEN.fetch_add(1, Ordering::Relaxed);
                    return failed.and(Err(ErrorKind::WriteZero.into()));
                }
            }
        }
        Ok(())
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}
