//! The command line as a user sees it: exit codes, error messages, no leftovers
//! (docs/reference/command-line.md). The results of its commands are tested in `film`.

mod doctor;
mod json_log;
mod start;
mod stderr;
mod traces;
mod upkeep;

use std::process::{Command, Output};

use flockreel_core::code::Code;

use crate::common::client;
use crate::common::film::Films;
use crate::common::process::Server;

fn flockreel(films: &Films, args: &str) -> Output {
    Command::new(env!("CARGO_BIN_EXE_flockreel"))
        .args(args.split_whitespace())
        .current_dir(films.folder())
        .output()
        .expect("the program starts")
}

/// Returns the sorted names of the entries of the folder.
fn names(films: &Films) -> Vec<String> {
    let entries = std::fs::read_dir(films.folder()).expect("it is there");
    let mut names: Vec<String> = entries
        .map(|entry| entry.unwrap().file_name().into_string().unwrap())
        .collect();
    names.sort();
    names
}

#[test]
fn refused_film_prints_advice_and_leaves_no_library() {
    let films = Films::new();
    films.write("text.mp4", "no film at all");
    films.run("-f lavfi -i color=gray:size=64x48:rate=25 -frames:v 40 still.mp4");
    for (film, code) in [("text.mp4", "not_a_video"), ("still.mp4", "nothing_moves")] {
        let done = flockreel(&films, &format!("analyze {film} -o deep/library"));
        let sentence = String::from_utf8(done.stderr).expect("it is text");
        assert_eq!(done.status.code(), Some(2), "{sentence}");
        let code = Code::from_name(code).expect("a code");
        let lines: Vec<&str> = sentence.lines().rev().take(2).collect();
        assert_eq!(lines[0], format!("flockreel: {}", code.advice()));
        assert!(
            lines[1].starts_with("flockreel: ") && lines[1].ends_with(&format!("({code})")),
            "{sentence}"
        );
        assert_eq!(names(&films), ["still.mp4", "text.mp4"]);
    }
}

#[test]
fn refused_film_leaves_the_picture_that_its_message_names() {
    let films = Films::new();
    films.run("-f lavfi -i mandelbrot=size=640x480:rate=25,scroll=h=0.013:v=0.007,scale=160:120 -frames:v 60 pan.mp4");
    let done = flockreel(&films, "analyze pan.mp4 -o deep/library");
    let said = String::from_utf8(done.stderr).expect("it is text");
    assert!(
        said.contains("picture of the refused frames: deep/library.refused.jpg"),
        "{said}"
    );
    assert!(said.contains("one of these may help: --ignore "), "{said}");
    let picture = std::fs::read(films.path("deep/library.refused.jpg")).expect("it is there");
    image::load_from_memory(&picture).expect("a JPEG");
    assert_eq!(names(&films), ["deep", "pan.mp4"]);
}

#[test]
fn options_named_by_advice_exist() {
    let films = Films::new();
    let quoted = |code: &Code| code.advice().split('`').skip(1).step_by(2).collect();
    let all: Vec<&str> = Code::ALL
        .iter()
        .flat_map(|code| -> Vec<&str> { quoted(code) })
        .collect();
    let options = all
        .iter()
        .filter(|text| text.starts_with("--") && !text.contains("upload"));
    assert!(options.clone().count() > 0);
    let help = flockreel(&films, "serve --help").stdout;
    let help = String::from_utf8(help).expect("it is text");
    let is_of_the_service = |option: &&&str| help.contains(&format!("{option} "));
    for option in options.filter(|option| !is_of_the_service(option)) {
        let done = flockreel(&films, &format!("analyze nowhere.mp4 -o library {option}"));
        let sentence = String::from_utf8(done.stderr).expect("it is text");
        // The option was parsed, because the error is about the film.
        assert!(
            sentence.contains("cannot read the file") && sentence.contains("nowhere.mp4"),
            "{option}: {sentence}"
        );
    }
}

#[test]
fn invalid_hint_is_shown_with_an_example() {
    let films = Films::new();
    for (option, example) in [
        ("--animal-at 120", "such as 120:310,95: 120"),
        ("--animal-at 1:2", "such as 120:310,95: 1:2"),
        ("--ignore 1,2,3", "10,20,200,40@0-2.5: 1,2,3"),
        ("--ignore 1,2,3,4@5", "10,20,200,40@0-2.5: 1,2,3,4@5"),
    ] {
        let done = flockreel(&films, &format!("analyze nowhere.mp4 -o library {option}"));
        let sentence = String::from_utf8(done.stderr).expect("it is text");
        assert_eq!(done.status.code(), Some(2), "{sentence}");
        assert!(sentence.contains(example), "{option}: {sentence}");
    }
}

#[test]
fn missing_film_is_named() {
    let films = Films::new();
    let done = flockreel(&films, "analyze nowhere.mp4 -o library");
    let sentence = String::from_utf8(done.stderr).expect("it is text");
    assert_eq!(done.status.code(), Some(2), "{sentence}");
    assert!(sentence.contains("nowhere.mp4"), "{sentence}");
    assert!(names(&films).is_empty());
}

#[test]
fn folder_without_a_library_is_named() {
    let films = Films::new();
    for command in ["flock", "fish", "matrix", "sprites"] {
        let done = flockreel(&films, &format!("{command} nowhere -o out.mp4"));
        let sentence = String::from_utf8(done.stderr).expect("it is text");
        assert_eq!(done.status.code(), Some(2), "{command}: {sentence}");
        let named = sentence.contains("cannot read the library: nowhere") || command == "matrix";
        assert!(named, "{command}: {sentence}");
        assert!(names(&films).is_empty(), "{command}");
    }
}

#[test]
fn address_beyond_loopback_needs_a_token() {
    let films = Films::new();
    let serve = "serve --no-sample --bind 0.0.0.0:0 --data data";
    let done = flockreel(&films, serve);
    let sentence = String::from_utf8(done.stderr).expect("it is text");
    assert_eq!(done.status.code(), Some(2), "{sentence}");
    let last = sentence.lines().last().expect("it says why");
    assert!(
        last.contains("needs a token") && last.ends_with("0.0.0.0:0"),
        "{sentence}"
    );

    let made = flockreel(
        &films,
        "token create --name lab --expires 30d --quota 7 --data data --json",
    );
    let made: serde_json::Value = serde_json::from_slice(&made.stdout).expect("it is JSON");
    assert_eq!(
        (&made["scope"], &made["quota"]),
        (&"write".into(), &7.into())
    );
    let revoke = format!("token revoke {} --data data", made["id"].as_str().unwrap());
    assert_eq!(flockreel(&films, &revoke).status.code(), Some(0));
    assert_eq!(flockreel(&films, &revoke).status.code(), Some(2));
    let list = flockreel(&films, "token list --data data");
    let list = String::from_utf8(list.stdout).expect("it is text");
    assert!(list.contains("ended") && list.contains("lab"), "{list}");
    assert_eq!(
        flockreel(&films, serve).status.code(),
        Some(2),
        "a revoked token opens nothing"
    );
}

#[tokio::test(flavor = "multi_thread")]
async fn json_log_names_the_request_and_no_signature() {
    let data = tempfile::tempdir().expect("a temporary folder");
    let flags = ["--log-format", "json", "--metrics-bind", "127.0.0.1:0"];
    let server = Server::start_with(data.path(), &flags);
    let url = format!("{}/v1/jobs?limit=1&signature=secret", server.base);
    let ask = client().get(url).header("x-request-id", "lab-1");
    assert_eq!(ask.send().await.expect("an answer").status(), 422);
    let log = server.terminate_and_read();
    assert!(!log.contains("secret"), "{log}");
    let (_, metrics) = log
        .split_once("the metrics are at http://127.0.0.1:")
        .expect(&log);
    assert!(!metrics.starts_with('0'), "{log}");
    let lines = log
        .lines()
        .filter_map(|line| serde_json::from_str(line).ok());
    let lines: Vec<serde_json::Value> = lines.collect();
    let answered = lines
        .iter()
        .find(|line| line["message"] == "request answered");
    let answered = answered.unwrap_or_else(|| panic!("{log}"));
    assert_eq!(answered["span"]["request_id"], "lab-1", "{answered}");
    assert_eq!(
        (&answered["route"], &answered["status"]),
        (&"/v1/jobs".into(), &422.into())
    );
}
