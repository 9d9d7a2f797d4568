//! Log lines as JSON: with `--log-format json` every line on stderr is an object, also messages of commands, errors of
//! the command line, and panics. The lines of a request and of its jobs have the trace id of the request.

use std::io::pipe;
use std::process::{Command, Output, Stdio};
use std::time::Duration;

use flockreel::logging::{self, LogFormat};
use reqwest::StatusCode;
use serde_json::{Value, json};

use super::stderr::{Service, read_all};
use crate::common::app::json_of;
use crate::common::client;
use crate::common::clip::TINY;

/// Returns the lines of a log. Panics if a line is not an object with a time, a level and a message.
fn objects(log: &str) -> Vec<Value> {
    let object = |line: &str| {
        let object: Value =
            serde_json::from_str(line).unwrap_or_else(|error| panic!("{error}: {line}"));
        for name in ["timestamp", "level", "message"] {
            assert!(object[name].is_string(), "{name}: {line}");
        }
        object
    };
    log.lines().map(object).collect()
}

fn flockreel(args: &[&str], variables: &[(&str, &str)]) -> Output {
    let folder = tempfile::tempdir().unwrap();
    Command::new(env!("CARGO_BIN_EXE_flockreel"))
        .args(args)
        .envs(variables.iter().copied())
        .current_dir(folder.path())
        .output()
        .unwrap()
}

#[tokio::test(flavor = "multi_thread")]
async fn every_line_of_a_service_is_an_object_and_jobs_have_the_trace_of_their_request() {
    const TRACE_ID: &str = "4bf92f3577b34da6a3ce929d0e0e4736";
    let (reader, stderr) = pipe().unwrap();
    let flags = ["--log-format", "json", "--metrics-bind", "127.0.0.1:0"];
    let mut service = Service::start_with(Stdio::null(), stderr, &flags).await;
    let log = std::thread::spawn(move || read_all(reader));
    let client = client();
    let post = |path: &str| client.post(format!("{}{path}", service.base));
    let footage = post("/v1/footage").body(TINY.clone()).send().await.unwrap();
    let footage = json_of(footage, StatusCode::CREATED).await;
    let analysis = post("/v1/analyses")
        .header("traceparent", format!("00-{TRACE_ID}-00f067aa0ba902b7-01"))
        .json(&json!({"footage_id": footage["id"]}));
    let analysis = json_of(analysis.send().await.unwrap(), StatusCode::ACCEPTED).await;
    let job = format!(
        "{}/v1/jobs/{}",
        service.base,
        analysis["job_id"].as_str().unwrap()
    );
    let ended = async || {
        let job = client.get(&job).send().await.unwrap();
        !job.json::<Value>().await.unwrap()["finished_at"].is_null()
    };
    while !ended().await {
        tokio::time::sleep(Duration::from_millis(50)).await;
    }
    assert_eq!(service.terminate(), Some(0));
    let lines = objects(&log.join().unwrap());
    for start in ["the page is at http", "the metrics are at http", "stopping"] {
        let is_there = |line: &Value| line["message"].as_str().unwrap().starts_with(start);
        assert!(lines.iter().any(is_there), "{start}: {lines:#?}");
    }
    let traced = |name: &str| {
        let spans = lines.iter().map(|line| &line["span"]);
        let spans = spans.filter(|span| span["name"] == name && span["trace_id"] == TRACE_ID);
        spans.cloned().collect::<Vec<Value>>()
    };
    assert!(!traced("request").is_empty(), "{lines:#?}");
    let jobs = traced("job");
    assert!(!jobs.is_empty(), "{lines:#?}");
    assert!(
        jobs.iter().all(|span| span["job.id"] == analysis["job_id"]),
        "{jobs:?}"
    );
}

#[test]
fn every_line_of_a_command_is_an_object() {
    let folder = tempfile::tempdir().unwrap();
    let settings = folder.path().join("flockreel.toml");
    std::fs::write(&settings, "log-format = 'json'\n").unwrap();
    let settings = settings.to_str().unwrap();
    let variable = [("FLOCKREEL_LOG_FORMAT", "json")];
    for (args, variables, status) in [
        (
            &["serve", "--bogus", "--log-format", "json"][..],
            &[][..],
            2,
        ),
        (
            &["serve", "--log-format=json", "--bind", "nonsense"],
            &[],
            2,
        ),
        (&["serve", "--bind", "nonsense"], &variable, 2),
        (
            &["serve", "--bind", "nonsense", "--config", settings],
            &[],
            2,
        ),
        (&["serve", "--config", "absent.toml"], &variable, 2),
        (&["serve", "--log", "a=b=c"], &variable, 2),
        (&["analyze", "absent.mp4", "-o", "library"], &variable, 2),
        (&["check", "--data", "/dev/null/data"], &variable, 2),
        (
            &[
                "sample",
                "-o",
                "sample.mp4",
                "--frames",
                "8",
                "--size",
                "64x64",
            ],
            &variable,
            0,
        ),
    ] {
        let done = flockreel(args, variables);
        let log = String::from_utf8(done.stderr).unwrap();
        assert_eq!(done.status.code(), Some(status), "{args:?}: {log}");
        let lines = objects(&log);
        let has_errors = lines.iter().any(|line| line["level"] == "ERROR");
        assert!(
            !lines.is_empty() && has_errors == (status != 0),
            "{args:?}: {log}"
        );
    }
}

#[test]
fn invalid_arguments_print_their_usage_as_text_by_default() {
    let done = flockreel(&["serve", "--bogus"], &[]);
    let text = String::from_utf8(done.stderr).unwrap();
    assert_eq!(done.status.code(), Some(2), "{text}");
    assert!(
        text.starts_with("error: ") && text.contains("Usage: "),
        "{text}"
    );
}

#[test]
fn panic_is_an_object() {
    let done = Command::new(std::env::current_exe().unwrap())
        .args([
            "cli::json_log::panicking_process",
            "--exact",
            "--ignored",
            "--nocapture",
        ])
        .env("RUST_BACKTRACE", "1")
        .output()
        .unwrap();
    let log = String::from_utf8(done.stderr).unwrap();
    let lines = objects(&log);
    assert!(
        lines
            .iter()
            .any(|line| line["message"] == "a thread panicked: on purpose"),
        "{log}"
    );
}

#[test]
#[ignore = "the process of the test `panic_is_an_object`"]
fn panicking_process() {
    let _log = logging::start("warn", LogFormat::Json, None);
    logging::log_panics();
    let ended = std::thread::spawn(|| panic!("on purpose")).join();
    assert!(ended.is_err());
}
