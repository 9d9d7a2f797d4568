//! Errors at the start name the setting and the reason: a data folder that cannot be, a database that does not answer.

use std::io::{BufRead, BufReader};
use std::net::TcpListener;
use std::process::{Command, Stdio};

use crate::common::process::Server;

fn flockreel() -> Command {
    Command::new(env!("CARGO_BIN_EXE_flockreel"))
}

#[test]
fn impossible_data_folder_is_named_with_the_reason() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("file");
    std::fs::write(&file, "no folder").unwrap();
    let damaged = folder.path().join("damaged");
    std::fs::create_dir_all(damaged.join("flockreel.db")).unwrap();
    for (data, named, reason) in [
        (file.join("data"), file.join("data"), "Not a directory"),
        (file.clone(), file.clone(), "File exists"),
        (
            "/proc/data".into(),
            "/proc/data".into(),
            "No such file or directory",
        ),
        (
            damaged.clone(),
            damaged.join("flockreel.db"),
            "unable to open database file",
        ),
    ] {
        for command in [
            &["serve", "--no-sample", "--bind", "127.0.0.1:0"][..],
            &["token", "list"],
        ] {
            let done = flockreel()
                .args(command)
                .arg("--data")
                .arg(&data)
                .output()
                .unwrap();
            let text = String::from_utf8(done.stderr).unwrap();
            assert_eq!(done.status.code(), Some(2), "{text}");
            let line = text.lines().last().unwrap_or_default();
            assert!(
                line.starts_with("flockreel: ") && line.contains(reason),
                "{text}"
            );
            assert!(line.ends_with(&format!(": {}", named.display())), "{text}");
        }
    }
}

#[test]
fn service_that_requires_tokens_says_how_to_create_the_first() {
    let folder = tempfile::tempdir().unwrap();
    let hint = "flockreel token create --name NAME";
    let log = |flags: &[&str]| Server::start_with(folder.path(), flags).terminate_and_read();
    assert!(!log(&[]).contains(hint));
    let first = log(&["--auth", "required"]);
    assert!(first.contains(hint), "{first}");
    let create = ["token", "create", "--name", "me", "--data"];
    let created = flockreel()
        .args(create)
        .arg(folder.path())
        .status()
        .unwrap();
    assert!(created.success());
    assert!(!log(&["--auth", "required"]).contains(hint));
}

#[test]
fn wait_for_a_database_that_does_not_answer_is_logged() {
    let refusing = TcpListener::bind("127.0.0.1:0")
        .unwrap()
        .local_addr()
        .unwrap();
    let silent = TcpListener::bind("127.0.0.1:0").unwrap();
    for address in [refusing, silent.local_addr().unwrap()] {
        let folder = tempfile::tempdir().unwrap();
        let mut child = flockreel()
            .args(["serve", "--no-sample", "--bind", "127.0.0.1:0", "--data"])
            .arg(folder.path())
            .env(
                "FLOCKREEL_DATABASE",
                format!("postgres://ann:secret@{address}/flockreel"),
            )
            .stderr(Stdio::piped())
            .spawn()
            .unwrap();
        let lines = BufReader::new(child.stderr.take().unwrap()).lines();
        let mut text = String::new();
        let is_said = lines.map_while(Result::ok).any(|line| {
            text = format!("{text}{line}\n");
            line.contains(&format!("waiting for the database at {address}, "))
        });
        child.kill().unwrap();
        child.wait().unwrap();
        assert!(is_said && text.contains(" s left"), "{text}");
        assert!(!text.contains("secret"), "{text}");
    }
}
