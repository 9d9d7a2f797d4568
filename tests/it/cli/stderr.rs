//! The service keeps answering when its stderr is blocked: the reader has died or stalled, or the disk is
//! full. Lines that cannot be written are dropped and counted.

use std::fs::File;
use std::io::{PipeReader, Read, pipe};
use std::net::TcpListener;
use std::os::fd::AsRawFd;
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use rustix::fs::{Mode, OFlags, open};
use rustix::io::write;
use rustix::process::{Pid, Signal, kill_process};

use crate::common::{Place, client};

/// Time limit for one start, response or stop. Free choice, longer than any of them takes.
const PATIENCE: Duration = Duration::from_secs(20);

/// A running service with a given stderr.
pub(super) struct Service {
    child: Child,
    pub(super) base: String,
    _place: Place,
}

impl Service {
    /// Starts the service and waits until it responds.
    async fn start(stderr: impl Into<Stdio>, filter: &str) -> Service {
        Service::start_with(Stdio::null(), stderr, &["--log", filter]).await
    }

    pub(super) async fn start_with(
        stdout: impl Into<Stdio>,
        stderr: impl Into<Stdio>,
        flags: &[&str],
    ) -> Service {
        let place = Place::local();
        let free = TcpListener::bind("127.0.0.1:0").unwrap();
        let bind = free.local_addr().unwrap().to_string();
        drop(free);
        let child = Command::new(env!("CARGO_BIN_EXE_flockreel"))
            .args(["serve", "--no-sample", "--bind", &bind])
            .args(flags)
            .args(place.flags())
            .stdout(stdout)
            .stderr(stderr)
            .spawn()
            .unwrap();
        let service = Service {
            child,
            base: format!("http://{bind}"),
            _place: place,
        };
        let start = Instant::now();
        while client()
            .get(format!("{}/healthz", service.base))
            .send()
            .await
            .is_err()
        {
            assert!(start.elapsed() < PATIENCE, "it does not start");
            tokio::time::sleep(Duration::from_millis(20)).await;
        }
        service
    }

    /// Sends requests that the service logs, and asserts that each is answered.
    async fn assert_answers(&self, n_requests: usize) {
        let client = client();
        for _ in 0..n_requests {
            let request = client.get(format!("{}/v1/footage", self.base));
            let answer = request.timeout(PATIENCE).send().await.unwrap();
            assert_eq!(answer.status(), 200);
        }
    }

    async fn n_lost_lines(&self) -> u64 {
        let metrics = client().get(format!("{}/metrics", self.base));
        let metrics = metrics.send().await.unwrap().text().await.unwrap();
        let lost = metrics
            .lines()
            .find_map(|line| line.strip_prefix("flockreel_log_lines_lost_total "));
        lost.unwrap().parse().unwrap()
    }

    /// Waits until at least `n_lines` lines are counted as lost.
    async fn assert_lost_lines(&self, n_lines: u64) {
        let start = Instant::now();
        while self.n_lost_lines().await < n_lines {
            assert!(start.elapsed() < PATIENCE, "lost lines are not counted");
            tokio::time::sleep(Duration::from_millis(20)).await;
        }
    }

    /// Sends SIGTERM, waits for the end and returns the exit code.
    pub(super) fn terminate(&mut self) -> Option<i32> {
        kill_process(Pid::from_child(&self.child), Signal::TERM).unwrap();
        let start = Instant::now();
        loop {
            if let Some(ended) = self.child.try_wait().unwrap() {
                return ended.code();
            }
            assert!(start.elapsed() < PATIENCE, "it does not stop");
            std::thread::sleep(Duration::from_millis(20));
        }
    }
}

impl Drop for Service {
    fn drop(&mut self) {
        // The process has already ended if the test passed.
        self.child.kill().ok();
        self.child.wait().ok();
    }
}

pub(super) fn read_all(mut stderr: PipeReader) -> String {
    let mut text = String::new();
    stderr.read_to_string(&mut text).unwrap();
    text
}

#[tokio::test(flavor = "multi_thread")]
async fn full_stderr_does_not_delay_responses() {
    let full = File::options().write(true).open("/dev/full").unwrap();
    let mut service = Service::start(full, "info").await;
    service.assert_answers(50).await;
    service.assert_lost_lines(50).await;
    assert_eq!(service.terminate(), Some(0));
}

#[tokio::test(flavor = "multi_thread")]
async fn dead_reader_of_stderr_does_not_delay_responses() {
    let (reader, stderr) = pipe().unwrap();
    let mut service = Service::start(stderr, "info").await;
    drop(reader);
    service.assert_answers(50).await;
    service.assert_lost_lines(50).await;
    assert_eq!(service.terminate(), Some(0));
}

#[tokio::test(flavor = "multi_thread")]
async fn stalled_reader_of_stderr_does_not_delay_responses() {
    let (reader, stderr) = pipe().unwrap();
    // Both streams go to the stalled reader, as with `2>&1`.
    let stdout = stderr.try_clone().unwrap();
    let mut service = Service::start_with(stdout, stderr, &["--log", "trace"]).await;
    let start = Instant::now();
    while service.n_lost_lines().await == 0 {
        service.assert_answers(50).await;
        assert!(start.elapsed() < 6 * PATIENCE, "no line was lost");
    }
    fill(&reader);
    assert_eq!(service.terminate(), Some(0));
    drop(reader);
}

/// Writes to a pipe until not a single byte fits.
fn fill(pipe: &PipeReader) {
    let path = format!("/proc/self/fd/{}", pipe.as_raw_fd());
    let filler = open(path, OFlags::WRONLY | OFlags::NONBLOCK, Mode::empty()).unwrap();
    while write(&filler, b" ").is_ok() {}
}

#[tokio::test(flavor = "multi_thread")]
async fn log_lines_are_complete_and_in_order() {
    let (reader, stderr) = pipe().unwrap();
    let mut service = Service::start(stderr, "info").await;
    let log = std::thread::spawn(move || read_all(reader));
    service.assert_answers(500).await;
    assert_eq!(service.n_lost_lines().await, 0);
    assert_eq!(service.terminate(), Some(0));
    let log = log.join().unwrap();
    let at = |words: &str| log.find(words).unwrap_or_else(|| panic!("{words}: {log}"));
    assert!(at("the page is at") < at("request answered"));
    assert!(at("request answered") < at("stopping"));
    assert_eq!(log.matches("route=\"/v1/footage\"").count(), 500, "{log}");
}
