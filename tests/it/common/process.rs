//! The service as a process of its own, for tests that kill it.

use std::io::{BufRead, BufReader};
use std::process::{Child, Command, Stdio};
use std::sync::{Arc, Mutex};

use rustix::process::{Pid, Signal, kill_process};

use super::Place;

/// A running `flockreel worker`, and what it has said.
pub(crate) struct WorkerProcess {
    pub(crate) child: Child,
    said: Arc<Mutex<Vec<String>>>,
}

impl WorkerProcess {
    /// Starts it over its things, with one worker.
    pub(crate) fn start(place: &Place) -> WorkerProcess {
        let mut child = Command::new(env!("CARGO_BIN_EXE_flockreel"))
            .args(["worker", "--workers", "1"])
            .args(place.flags())
            .stderr(Stdio::piped())
            .spawn()
            .unwrap();
        let said = Arc::new(Mutex::new(Vec::new()));
        let (lines, to) = (
            BufReader::new(child.stderr.take().unwrap()).lines(),
            said.clone(),
        );
        std::thread::spawn(move || lines.for_each(|line| to.lock().unwrap().push(line.unwrap())));
        WorkerProcess { child, said }
    }

    /// Whether it has said something with these words.
    pub(crate) fn has_said(&self, words: &str) -> bool {
        self.said
            .lock()
            .unwrap()
            .iter()
            .any(|line| line.contains(words))
    }

    /// All that it has said.
    pub(crate) fn said(&self) -> String {
        self.said.lock().unwrap().join("\n")
    }

    /// Sends a signal.
    pub(crate) fn signal(&self, signal: Signal) {
        kill_process(Pid::from_child(&self.child), signal).unwrap();
    }

    /// SIGTERM; returns the exit code.
    pub(crate) fn terminate(mut self) -> Option<i32> {
        self.signal(Signal::TERM);
        self.child.wait().unwrap().code()
    }
}

impl Drop for WorkerProcess {
    fn drop(&mut self) {
        // Already gone, where the test ended well.
        self.child.kill().ok();
        self.child.wait().ok();
    }
}

/// A running `flockreel serve` without a sample.
pub(crate) struct Server {
    child: Child,
    pub(crate) base: String,
}

impl Server {
    /// Starts it over its things and waits for its address.
    pub(crate) fn start(place: &Place) -> Server {
        Server::start_with(place, &[])
    }

    /// The same with further flags.
    pub(crate) fn start_with(place: &Place, flags: &[&str]) -> Server {
        let mut child = Command::new(env!("CARGO_BIN_EXE_flockreel"))
            .args(["serve", "--no-sample", "--bind", "127.0.0.1:0"])
            .args(place.flags())
            .args(flags)
            .stderr(Stdio::piped())
            .spawn()
            .unwrap();
        let mut lines = BufReader::new(child.stderr.take().unwrap()).lines();
        let base = lines.by_ref().find_map(|line| {
            let line = line.unwrap();
            let (_, address) = line.split_once("the page is at ")?;
            Some(address.trim_end_matches('/').to_owned())
        });
        // What it says later must not block it.
        std::thread::spawn(move || lines.for_each(drop));
        Server {
            child,
            base: base.expect("the server ended before it gave its address"),
        }
    }

    /// SIGKILL.
    pub(crate) fn kill(mut self) {
        self.child.kill().unwrap();
        self.child.wait().unwrap();
    }

    /// SIGTERM; returns the exit code.
    pub(crate) fn terminate(mut self) -> Option<i32> {
        kill_process(Pid::from_child(&self.child), Signal::TERM).unwrap();
        self.child.wait().unwrap().code()
    }
}

impl Drop for Server {
    fn drop(&mut self) {
        // Already gone, where the test ended well.
        self.child.kill().ok();
        self.child.wait().ok();
    }
}
