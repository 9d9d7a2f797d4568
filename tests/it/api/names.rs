//! Names from clients are only labels (docs/explanation/promises.md, "Names are labels"). Stored files have
//! names chosen by the service, and the name in a download's header is escaped.

use std::path::Path;

use crate::common::TestApp;
use crate::common::app::json_of;
use crate::common::clip::TINY;
use reqwest::StatusCode;
use reqwest::multipart::{Form, Part};

/// Names with a meaning for shells, paths, headers, terminals, web pages or ffmpeg.
fn names() -> Vec<String> {
    let names = [
        "../../../../etc/passwd",
        "..\\..\\windows\\system32",
        "/etc/shadow",
        "a\0b.mp4",
        "a\r\nset-cookie: x=y\r\n\r\n<html>",
        "\u{202e}4pm.exe\u{2066}",
        "-i",
        "-f lavfi -i color",
        "concat:a.mp4|b.mp4",
        "http://127.0.0.1:1/x",
        "<script>alert(1)</script>",
        "\"; filename=\"evil.html",
        "$(touch x)`touch y`;&|",
        "fish\u{1b}[31m.mp4",
        "魚の動画 🐟.mp4",
        "%2e%2e%2f",
        ".",
        "..",
        "CON",
        " ",
    ];
    let mut names: Vec<String> = names.map(str::to_owned).to_vec();
    names.push("x".repeat(300));
    names
}

#[tokio::test]
async fn file_names_from_clients_are_only_labels() {
    let app = TestApp::idle().await;
    for (k, name) in names().into_iter().enumerate() {
        // Make each film different, because equal films are stored once.
        let film = [
            TINY.as_slice(),
            b"\0\0\0\x0cfree",
            &(k as u32).to_be_bytes(),
        ]
        .concat();
        let answer = match k % 2 {
            0 => {
                let path = format!("/v1/footage?name={}", encoded(&name));
                app.post(&path).body(film).send().await
            }
            _ => {
                let part = Part::bytes(film).file_name(name.clone());
                let form = Form::new().part("video", part);
                app.post("/v1/footage").multipart(form).send().await
            }
        };
        let answer = answer.unwrap();
        if answer.status() == StatusCode::BAD_REQUEST {
            // Multipart forms cannot carry these characters.
            assert!(name.contains(['\0', '\u{1b}']), "{name:?}");
            continue;
        }
        let footage = json_of(answer, StatusCode::CREATED).await;
        let label = footage["name"].as_str().unwrap();
        assert!(
            !label.contains(['/', '\\', '\r', '\n', '\0', '\u{1b}', '\u{202e}']),
            "{label:?}"
        );
        assert!(label.chars().count() <= 200);
        let path = format!("/v1/footage/{}/file", footage["id"].as_str().unwrap());
        let file = app.get(&path).send().await.unwrap();
        assert_eq!(file.headers()["x-content-type-options"], "nosniff");
        let disposition = file.headers()["content-disposition"].to_str().unwrap();
        assert_is_one_attachment(disposition, &name);
    }
    for name in stored_names(app.folder()) {
        let is_ours = name
            .chars()
            .all(|c| c.is_ascii_alphanumeric() || ".-_".contains(c));
        assert!(is_ours, "{name:?}");
    }
    app.assert_sound().await;
}

/// Percent-encodes every byte.
fn encoded(name: &str) -> String {
    name.bytes().map(|byte| format!("%{byte:02X}")).collect()
}

/// Asserts that the header is `attachment; filename="..."`, optionally followed by an encoded name.
fn assert_is_one_attachment(disposition: &str, name: &str) {
    let rest = disposition.strip_prefix("attachment; filename=\"");
    let rest = rest.unwrap_or_else(|| panic!("{name:?}: {disposition}"));
    let (plain, rest) = rest.split_once('"').unwrap();
    assert!(
        !plain.is_empty() && plain.is_ascii() && !plain.contains('\\'),
        "{disposition}"
    );
    let encoded = rest.strip_prefix("; filename*=UTF-8''").unwrap_or(rest);
    assert!(
        !encoded.contains(['"', ';', ' ', '<', '/']),
        "{disposition}"
    );
}

/// Returns the names of all files and folders below a folder.
fn stored_names(folder: &Path) -> Vec<String> {
    let mut names = Vec::new();
    for entry in std::fs::read_dir(folder).unwrap() {
        let entry = entry.unwrap();
        names.push(entry.file_name().into_string().unwrap());
        if entry.file_type().unwrap().is_dir() {
            names.extend(stored_names(&entry.path()));
        }
    }
    names
}
