//! The service and its workers as separate processes, for tests that kill them.

use std::io::{BufRead, BufReader};
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::sync::{Arc, Mutex};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use flockreel::store::blobs::hex;
use reqwest::{Client, Response, StatusCode};
use rustix::process::{Pid, Signal, kill_process};
use serde_json::{Value, json};
use sha2::{Digest, Sha256};

use super::app::json_of;
use super::clip::TINY;
use super::{Place, client};

/// A running `flockreel worker`, and the lines of its stderr.
pub(crate) struct WorkerProcess {
    pub(crate) child: Child,
    log_lines: Arc<Mutex<Vec<String>>>,
}

impl WorkerProcess {
    /// Starts the process with one worker.
    pub(crate) fn start(place: &Place) -> WorkerProcess {
        WorkerProcess::start_with(place, &[])
    }

    /// Starts the process with one worker and additional flags.
    pub(crate) fn start_with(place: &Place, flags: &[&str]) -> WorkerProcess {
        let mut child = Command::new(env!("CARGO_BIN_EXE_flockreel"))
            .args(["worker", "--workers", "1"])
            .args(place.flags())
            .args(flags)
            .stderr(Stdio::piped())
            .spawn()
            .unwrap();
        let log_lines = Arc::new(Mutex::new(Vec::new()));
        let (lines, to) = (
            BufReader::new(child.stderr.take().unwrap()).lines(),
            log_lines.clone(),
        );
        std::thread::spawn(move || lines.for_each(|line| to.lock().unwrap().push(line.unwrap())));
        WorkerProcess { child, log_lines }
    }

    /// Returns true if a line of stderr contains these words.
    pub(crate) fn has_logged(&self, words: &str) -> bool {
        self.log_lines
            .lock()
            .unwrap()
            .iter()
            .any(|line| line.contains(words))
    }

    /// Returns stderr so far.
    pub(crate) fn log(&self) -> String {
        self.log_lines.lock().unwrap().join("\n")
    }

    /// Sends a signal to the process.
    pub(crate) fn signal(&self, signal: Signal) {
        kill_process(Pid::from_child(&self.child), signal).unwrap();
    }

    /// Sends SIGTERM, waits for the end and returns the exit code.
    pub(crate) fn terminate(mut self) -> Option<i32> {
        self.signal(Signal::TERM);
        self.child.wait().unwrap().code()
    }
}

impl Drop for WorkerProcess {
    fn drop(&mut self) {
        if std::thread::panicking() {
            eprintln!("the log of a worker:\n{}", self.log());
        }
        // The process has already ended if the test passed.
        self.child.kill().ok();
        self.child.wait().ok();
    }
}

/// A running `flockreel serve --no-sample`, with a client for it.
pub(crate) struct Server {
    child: Child,
    log: JoinHandle<String>,
    client: Client,
    pub(crate) base: String,
}

impl Server {
    /// Starts the service on a data folder and waits for its address.
    pub(crate) fn start(data: &Path) -> Server {
        Server::start_with(data, &[])
    }

    /// Starts the service on a place.
    pub(crate) fn start_at(place: &Place) -> Server {
        let flags = place.server_flags();
        let flags: Vec<&str> = flags.iter().map(String::as_str).collect();
        Server::start_with(place.data(), &flags)
    }

    /// Starts the service with additional flags.
    pub(crate) fn start_with(data: &Path, flags: &[&str]) -> Server {
        Server::start_in(data, flags, &[])
    }

    /// Starts the service with additional flags and environment variables.
    pub(crate) fn start_in(data: &Path, flags: &[&str], variables: &[(&str, &str)]) -> Server {
        let mut service = Command::new(env!("CARGO_BIN_EXE_flockreel"));
        service.envs(variables.iter().copied());
        Server::started(service, data, flags)
    }

    /// Starts the service under another program, such as strace. `before` is its command line.
    pub(crate) fn start_under(before: &[&str], data: &Path) -> Server {
        let mut service = Command::new(before[0]);
        service
            .args(&before[1..])
            .arg(env!("CARGO_BIN_EXE_flockreel"));
        Server::started(service, data, &[])
    }

    fn started(mut service: Command, data: &Path, flags: &[&str]) -> Server {
        let mut child = service
            .args(["serve", "--no-sample", "--bind", "127.0.0.1:0", "--data"])
            .arg(data)
            .args(flags)
            .stderr(Stdio::piped())
            .spawn()
            .unwrap();
        let mut lines = BufReader::new(child.stderr.take().unwrap()).lines();
        let mut log = String::new();
        let base = lines.by_ref().find_map(|line| {
            let line = line.unwrap();
            log = format!("{log}{line}\n");
            let (_, address) = line.split_once("the page is at ")?;
            // A line of a JSON log goes on after the address.
            let (address, _) = address.split_once("/\"").unwrap_or((address, ""));
            Some(address.trim_end_matches('/').to_owned())
        });
        let base = base.unwrap_or_else(|| panic!("no address was given:\n{log}"));
        // Keep reading, so that a full pipe does not block the service.
        let log = std::thread::spawn(move || {
            let lines = lines.map_while(Result::ok);
            lines.fold(log, |log, line| format!("{log}{line}\n"))
        });
        Server {
            child,
            log,
            client: client(),
            base,
        }
    }

    pub(crate) async fn get(&self, path: &str) -> Response {
        let request = self.client.get(format!("{}{path}", self.base));
        request.send().await.unwrap()
    }

    /// GETs JSON.
    pub(crate) async fn json(&self, path: &str) -> Value {
        self.get(path).await.json().await.unwrap()
    }

    pub(crate) async fn delete(&self, path: &str) -> Response {
        let request = self.client.delete(format!("{}{path}", self.base));
        request.send().await.unwrap()
    }

    /// Returns the resident memory of the process, bytes.
    pub(crate) fn resident_bytes(&self) -> u64 {
        let status = std::fs::read_to_string(format!("/proc/{}/status", self.child.id())).unwrap();
        let line = status.lines().find_map(|line| line.strip_prefix("VmRSS:"));
        let kib = line.unwrap().trim().trim_end_matches(" kB");
        kib.parse::<u64>().unwrap() << 10
    }

    /// Uploads a film and returns the response.
    pub(crate) async fn upload(&self, film: Vec<u8>) -> Response {
        let request = self.client.post(format!("{}/v1/footage", self.base));
        request.body(film).send().await.unwrap()
    }

    /// POSTs JSON, asserts status 202 and returns the response body.
    pub(crate) async fn accept(&self, path: &str, request_body: Value) -> Value {
        let request = self.client.post(format!("{}{path}", self.base));
        let answer = request.json(&request_body).send().await.unwrap();
        json_of(answer, StatusCode::ACCEPTED).await
    }

    /// Uploads a film, asserts status 201, and queues its analysis.
    pub(crate) async fn analyze(&self, film: Vec<u8>) -> Value {
        let footage = json_of(self.upload(film).await, StatusCode::CREATED).await;
        let request_body = json!({"footage_id": footage["id"]});
        self.accept("/v1/analyses", request_body).await
    }

    /// Polls the job until `is_so` holds and returns it. Panics after four minutes.
    pub(crate) async fn job_when(&self, id: &Value, is_so: impl Fn(&Value) -> bool) -> Value {
        let path = format!("/v1/jobs/{}", id.as_str().unwrap());
        let start = Instant::now();
        loop {
            let job = self.json(&path).await;
            if is_so(&job) {
                return job;
            }
            assert!(start.elapsed() < Duration::from_secs(240), "{job}");
            tokio::time::sleep(Duration::from_millis(20)).await;
        }
    }

    /// Waits until the job has ended and returns it.
    pub(crate) async fn ended(&self, id: &Value) -> Value {
        self.job_when(id, |job| !job["finished_at"].is_null()).await
    }

    /// Returns the id of the process.
    pub(crate) fn pid(&self) -> u32 {
        self.child.id()
    }

    /// Sends SIGKILL and waits for the end.
    pub(crate) fn kill(mut self) {
        self.child.kill().unwrap();
        self.child.wait().unwrap();
    }

    /// Sends SIGTERM without waiting for the end.
    pub(crate) fn send_sigterm(&self) {
        kill_process(Pid::from_child(&self.child), Signal::TERM).unwrap();
    }

    /// Sends SIGTERM, waits for the end and returns the exit code.
    pub(crate) fn terminate(mut self) -> Option<i32> {
        self.send_sigterm();
        self.child.wait().unwrap().code()
    }

    /// Sends SIGTERM, waits for the end and returns the stderr since the start message.
    pub(crate) fn terminate_and_read(mut self) -> String {
        self.send_sigterm();
        self.child.wait().unwrap();
        let log = std::mem::replace(&mut self.log, std::thread::spawn(String::new));
        log.join().unwrap()
    }

    /// Waits for the end and returns the exit code.
    pub(crate) fn wait(mut self) -> Option<i32> {
        self.child.wait().unwrap().code()
    }
}

impl Drop for Server {
    fn drop(&mut self) {
        // The process has already ended if the test passed.
        self.child.kill().ok();
        self.child.wait().ok();
    }
}

/// Returns `TINY` with a `free` box that contains `number`. Players ignore the box, but the hash differs.
pub(crate) fn numbered_film(number: usize) -> Vec<u8> {
    let text = format!("film {number:08}");
    let n_bytes = u32::try_from(text.len() + 8).unwrap().to_be_bytes();
    [&TINY[..], &n_bytes, b"free", text.as_bytes()].concat()
}

/// Returns the SHA-256 in hexadecimal.
pub(crate) fn sha256(bytes: &[u8]) -> String {
    hex(&Sha256::digest(bytes))
}

/// Returns the command lines of all processes that mention the folder.
pub(crate) fn processes_of(folder: &Path) -> Vec<String> {
    let folder = folder.to_str().unwrap();
    let lines = command_lines().into_iter().map(|(_, line)| line);
    lines.filter(|line| line.contains(folder)).collect()
}

/// Returns the ids and command lines of all processes.
pub(crate) fn command_lines() -> Vec<(i32, String)> {
    let entries = std::fs::read_dir("/proc").unwrap().flatten();
    let lines = entries.filter_map(|entry| {
        let pid = entry.file_name().to_str()?.parse().ok()?;
        let line = std::fs::read(entry.path().join("cmdline")).ok()?;
        Some((pid, String::from_utf8_lossy(&line).replace('\0', " ")))
    });
    lines.collect()
}
