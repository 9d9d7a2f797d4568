//! `doctor` reports what the machine supports, and `--sandbox strict` refuses to start if a sandbox layer is
//! missing (docs/explanation/promises.md, "Sandbox"). A seccomp filter simulates a kernel without Landlock.

use std::process::{Command, Output};

use serde_json::Value;

use super::flockreel;
use crate::common::film::Films;
use crate::media::sandbox::compile_attack;

/// Runs the program as on a kernel without Landlock.
fn without_landlock(films: &Films, args: &[&str]) -> Output {
    let attack = compile_attack(films.folder());
    Command::new(attack)
        .arg("--without-landlock")
        .arg(env!("CARGO_BIN_EXE_flockreel"))
        .args(args)
        .current_dir(films.folder())
        .output()
        .expect("the program starts")
}

fn findings(done: &Output) -> Value {
    let text = String::from_utf8_lossy(&done.stdout);
    serde_json::from_str(&text).unwrap_or_else(|error| panic!("{error}: {text}"))
}

fn finding<'a>(all: &'a Value, name: &str) -> &'a Value {
    let mut findings = all["findings"].as_array().unwrap().iter();
    let found = findings.find(|finding| finding["name"] == name);
    found.unwrap_or_else(|| panic!("{name} is not among them: {all}"))
}

#[test]
fn doctor_lists_every_layer_and_exits_with_1_if_one_is_missing() {
    let films = Films::new();
    let done = flockreel(&films, "doctor --json");
    let here = findings(&done);
    assert_eq!(done.status.code(), Some(i32::from(here["ok"] != true)));
    let version = finding(&here, "ffmpeg")["found"]
        .as_str()
        .unwrap()
        .to_owned();
    assert!(version.starts_with("ffmpeg version "), "{version}");
    for name in [
        "codecs",
        "vectors",
        "cores",
        "disk",
        "sandbox.limits",
        "sandbox.calls",
    ] {
        finding(&here, name);
    }

    let done = without_landlock(&films, &["--json", "doctor"]);
    assert_eq!(done.status.code(), Some(1));
    let lacking = findings(&done);
    for name in ["sandbox.files", "sandbox.network", "sandbox.signals"] {
        let finding = finding(&lacking, name);
        assert_eq!(finding["ok"], false, "{finding}");
        assert!(finding["meaning"].is_string(), "{finding}");
    }
    assert_eq!(finding(&lacking, "sandbox.limits")["ok"], true);

    let done = flockreel(&films, "doctor --ffmpeg nowhere --json");
    assert_eq!(done.status.code(), Some(1));
    assert_eq!(finding(&findings(&done), "ffmpeg")["ok"], false);
}

#[test]
fn strict_service_does_not_start_without_a_layer() {
    let films = Films::new();
    let args = [
        "serve",
        "--no-sample",
        "--bind",
        "127.0.0.1:0",
        "--sandbox",
        "strict",
    ];
    let done = without_landlock(&films, &args);
    let said = String::from_utf8_lossy(&done.stderr);
    assert_eq!(done.status.code(), Some(2), "{said}");
    let sentence = said.lines().last().unwrap();
    assert!(
        sentence.contains("--sandbox strict") && sentence.contains("files"),
        "{sentence}"
    );
}

#[test]
fn films_are_made_on_a_kernel_without_landlock() {
    let films = Films::new();
    let sample = [
        "sample", "-o", "film.mp4", "--frames", "5", "--size", "64x64",
    ];
    let done = without_landlock(&films, &sample);
    assert!(
        done.status.success(),
        "{}",
        String::from_utf8_lossy(&done.stderr)
    );
    assert!(films.path("film.mp4").is_file());
}
