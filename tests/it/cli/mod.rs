//! The command line from outside: exit codes, one clear sentence, nothing left behind (DESIGN.md,
//! Command line). What it makes of a film is tested in `film`.

mod doctor;

use std::process::{Command, Output};

use crate::common::film::Films;

fn flockreel(films: &Films, args: &str) -> Output {
    Command::new(env!("CARGO_BIN_EXE_flockreel"))
        .args(args.split_whitespace())
        .current_dir(films.folder())
        .output()
        .expect("the program starts")
}

/// What is in the folder, by name.
fn names(films: &Films) -> Vec<String> {
    let entries = std::fs::read_dir(films.folder()).expect("it is there");
    let mut names: Vec<String> = entries
        .map(|entry| entry.unwrap().file_name().into_string().unwrap())
        .collect();
    names.sort();
    names
}

#[test]
fn a_film_that_is_refused_gets_one_sentence_and_leaves_nothing_behind() {
    let films = Films::new();
    films.write("text.mp4", "no film at all");
    films.run("-f lavfi -i color=gray:size=64x48:rate=25 -frames:v 40 still.mp4");
    for (film, code) in [("text.mp4", "not_a_video"), ("still.mp4", "nothing_moves")] {
        let done = flockreel(&films, &format!("analyze {film} -o deep/library"));
        let sentence = String::from_utf8(done.stderr).expect("it is text");
        assert_eq!(done.status.code(), Some(2), "{sentence}");
        let last = sentence.lines().last().expect("it says why");
        assert!(
            last.starts_with("flockreel: ") && last.ends_with(&format!("({code})")),
            "{sentence}"
        );
        assert_eq!(names(&films), ["still.mp4", "text.mp4"]);
    }
}

#[test]
fn a_film_that_is_not_there_is_named() {
    let films = Films::new();
    let done = flockreel(&films, "analyze nowhere.mp4 -o library");
    let sentence = String::from_utf8(done.stderr).expect("it is text");
    assert_eq!(done.status.code(), Some(2), "{sentence}");
    assert!(sentence.contains("nowhere.mp4"), "{sentence}");
    assert!(names(&films).is_empty());
}

#[test]
fn a_folder_that_is_no_library_is_named() {
    let films = Films::new();
    for command in ["flock", "fish", "matrix", "sprites"] {
        let done = flockreel(&films, &format!("{command} nowhere -o out.mp4"));
        let sentence = String::from_utf8(done.stderr).expect("it is text");
        assert_eq!(done.status.code(), Some(2), "{command}: {sentence}");
        let named = sentence.contains("not a library: nowhere") || command == "matrix";
        assert!(named, "{command}: {sentence}");
        assert!(names(&films).is_empty(), "{command}");
    }
}

#[test]
fn beyond_this_machine_nothing_is_served_without_a_token() {
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
