//! An answered upload survives a power cut (docs/explanation/promises.md, "No upload is lost"). Killing the
//! service cannot show this, because the kernel keeps what a killed process wrote. Instead the service runs
//! under strace, and the test checks the order of its write, sync, rename and response calls.

use std::path::Path;
use std::process::Command;
use std::time::{Duration, Instant};

use tempfile::TempDir;

use crate::common::client;
use crate::common::clip::TINY;
use crate::common::process::Server;

/// A service under strace.
struct Traced {
    folder: TempDir,
    server: Server,
}

impl Traced {
    /// Starts the service. Returns `None` if strace is missing or not permitted.
    fn start() -> Option<Traced> {
        let traces = Command::new("strace").args(["-qq", "true"]).output();
        if !traces.is_ok_and(|done| done.status.success()) {
            println!("skipped: strace is not installed or may not trace here");
            return None;
        }
        let folder = tempfile::tempdir().unwrap();
        let calls = "trace=fsync,fdatasync,rename,renameat,renameat2,write,writev,sendto,sendmsg";
        let log = folder.path().join("trace");
        let log = log.to_str().unwrap();
        let strace = ["strace", "-D", "-f", "-qq", "-y", "-e", calls, "-o", log];
        let server = Server::start_under(&strace, &folder.path().join("data"));
        Some(Traced { folder, server })
    }

    fn url(&self, path: &str) -> String {
        format!("{}{path}", self.server.base)
    }

    /// Returns the system calls from the first that contains `start` to the first that contains `answer`,
    /// both included. Waits for them up to 20 s.
    fn calls(&self, start: &str, answer: &str) -> Vec<String> {
        let begun = Instant::now();
        loop {
            let trace = std::fs::read_to_string(self.folder.path().join("trace")).unwrap();
            let calls = trace.lines().skip_while(|call| !call.contains(start));
            let calls: Vec<String> = calls.map(str::to_owned).collect();
            if let Some(end) = calls.iter().position(|call| call.contains(answer)) {
                return calls[..=end].to_vec();
            }
            assert!(begun.elapsed() < Duration::from_secs(20), "{trace}");
            std::thread::sleep(Duration::from_millis(50));
        }
    }
}

/// A required system call: the start of its name, and a text that it contains.
type Wanted<'a> = (&'a str, &'a str);

/// Asserts that the required calls occur in this order; others may occur between them.
fn assert_in_order(calls: &[String], wanted: &[Wanted]) {
    let mut rest = calls.iter();
    for (name, text) in wanted {
        let is_it = |call: &String| call.contains(&format!(" {name}")) && call.contains(text);
        assert!(
            rest.any(is_it),
            "no {name} of {text} after those before it in: {wanted:?}"
        );
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn upload_is_on_disk_before_its_201() {
    let Some(traced) = Traced::start() else {
        return;
    };
    let sent = client().post(traced.url("/v1/footage"));
    let answer = sent.body(TINY.clone()).send().await.unwrap();
    assert_eq!(answer.status(), 201);
    let footage: serde_json::Value = answer.json().await.unwrap();
    let calls = traced.calls("/data/tmp/", "HTTP/1.1 201");
    let folder = format!("blobs/footage/{}", footage["id"].as_str().unwrap());
    let mut renames = calls.iter().filter(|call| call.contains(" rename"));
    let renamed = renames.find(|call| call.contains(&folder));
    let draft = draft_of(renamed.expect("the film is renamed into place"));
    assert_in_order(
        &calls,
        &[
            ("fsync(", &format!("{draft}/video>")),
            ("fsync(", &format!("{draft}/poster.jpg>")),
            ("fsync(", &format!("{draft}>")),
            ("rename", &folder),
            ("fsync(", "/data/blobs/footage>"),
            ("f", "flockreel.db-wal>) "),
            ("", "HTTP/1.1 201"),
        ],
    );
    let place = traced.folder.path().join("data").join(folder);
    assert!(Path::new(&place).join("video").is_file());
}

/// Returns the source folder of a rename call, as a path that starts at `/data`.
fn draft_of(rename: &str) -> String {
    let from = rename.split('"').nth(1).unwrap();
    from[from.find("/data/tmp/").unwrap()..].to_owned()
}

#[tokio::test(flavor = "multi_thread")]
async fn confirmed_bytes_of_a_resumable_upload_are_on_disk() {
    let Some(traced) = Traced::start() else {
        return;
    };
    let client = client();
    let begin = client
        .post(traced.url("/v1/uploads"))
        .header("upload-length", TINY.len());
    let begun = begin.header("tus-resumable", "1.0.0").send().await.unwrap();
    let upload = begun.headers()["location"].to_str().unwrap().to_owned();
    let piece = client
        .patch(traced.url(&upload))
        .header("tus-resumable", "1.0.0")
        .header("content-type", "application/offset+octet-stream")
        .header("upload-offset", 0)
        .body(TINY[..1000].to_vec());
    assert_eq!(piece.send().await.unwrap().status(), 204);
    let file = upload.replace("/v1", "/data");
    let calls = traced.calls(&file, "HTTP/1.1 204");
    assert_in_order(
        &calls,
        &[
            ("write(", &file),
            ("fsync(", &file),
            ("f", "flockreel.db-wal>) "),
            ("", "HTTP/1.1 204"),
        ],
    );
}
