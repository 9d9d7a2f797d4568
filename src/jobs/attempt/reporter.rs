//! Progress and cancellation in the process of an attempt. Progress goes to stdout, a few lines per second.

use std::io::{self, Write};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Mutex, PoisonError};
use std::time::{Duration, Instant};

use super::message::Message;
use flockreel_core::progress::Progress;

/// Least interval between two lines about the same stage. Free choice; the worker looks twice per second.
const INTERVAL: Duration = Duration::from_millis(100);

/// Sends messages to the worker and knows whether to stop.
#[derive(Debug, Default)]
pub struct Reporter {
    is_stopped: AtomicBool,
    /// The last reported stage and its time.
    last: Mutex<Option<(&'static str, Instant)>>,
}

impl Reporter {
    /// Asks the computation to stop at the next convenient point.
    pub(super) fn stop(&self) {
        self.is_stopped.store(true, Ordering::Relaxed);
    }

    /// Reports decoded frames and the time that they took.
    pub(super) fn count_decoded(&self, n_frames: u64, took: Duration) {
        self.send(&Message::Decoded(n_frames, took.as_secs_f64()));
    }

    /// Writes a message. If nobody reads it, the worker is gone, and the computation is asked to stop.
    pub(super) fn send(&self, message: &Message) {
        let line = serde_json::json!(message).to_string() + "\n";
        let mut stdout = io::stdout().lock();
        let written = stdout.write_all(line.as_bytes());
        if written.and_then(|()| stdout.flush()).is_err() {
            self.stop();
        }
    }
}

impl Progress for Reporter {
    fn report(&self, stage: &'static str, fraction: f64) {
        let mut last = self.last.lock().unwrap_or_else(PoisonError::into_inner);
        if last.is_some_and(|(before, at)| before == stage && at.elapsed() < INTERVAL) {
            return;
        }
        *last = Some((stage, Instant::now()));
        drop(last);
        self.send(&Message::Progress(stage.to_owned(), fraction));
    }

    fn cancelled(&self) -> bool {
        self.is_stopped.load(Ordering::Relaxed)
    }
}
