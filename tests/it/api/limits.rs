//! Oversized, compressed and dishonest requests are refused early (docs/explanation/promises.md,
//! "Size limits"). Most are written to a raw TCP connection, because HTTP clients do not send them.

use serde_json::json;
use tokio::io::{AsyncReadExt, AsyncWriteExt};
use tokio::net::TcpStream;
use tokio::time::{Duration, timeout};

use crate::common::TestApp;
use crate::common::app::code_of;
use crate::common::clip::TINY;

/// Sends the parts and returns the response up to the end of its head. Stops after 5 s of silence.
async fn exchange(app: &TestApp, parts: &[&[u8]]) -> String {
    let authority = app.address("").replace("http://", "");
    let mut connection = TcpStream::connect(&authority).await.unwrap();
    for part in parts {
        // The service may close the connection early. Its response can still be read.
        if connection.write_all(part).await.is_err() {
            break;
        }
    }
    let mut answer = Vec::new();
    let mut chunk = [0; 4096];
    while let Ok(Ok(n)) = timeout(Duration::from_secs(5), connection.read(&mut chunk)).await {
        answer.extend_from_slice(&chunk[..n]);
        if n == 0 || answer.windows(4).any(|w| w == b"\r\n\r\n") {
            break;
        }
    }
    String::from_utf8_lossy(&answer).into_owned()
}

fn head(method: &str, address: &str, more: &str) -> Vec<u8> {
    format!("{method} {address} HTTP/1.1\r\nhost: 127.0.0.1\r\n{more}\r\n").into_bytes()
}

#[tokio::test]
async fn heads_and_addresses_have_a_maximum_length() {
    let app = TestApp::idle().await;
    let large = head(
        "GET",
        "/healthz",
        &format!("x-large: {}\r\n", "x".repeat(100_000)),
    );
    assert!(exchange(&app, &[&large]).await.starts_with("HTTP/1.1 431"));
    let many: String = (0..2000).map(|k| format!("x-{k}: y\r\n")).collect();
    let many = head("GET", "/healthz", &many);
    assert!(exchange(&app, &[&many]).await.starts_with("HTTP/1.1 431"));
    let long = format!("/v1/footage?name={}", "x".repeat(9000));
    let answer = app.get(&long).send().await.unwrap();
    assert_eq!(code_of(answer, 414).await, "address_too_long");
    assert_eq!(app.get("/healthz").send().await.unwrap().status(), 200);
    app.assert_sound().await;
}

#[tokio::test]
async fn too_large_content_length_is_refused_before_the_body() {
    let app = TestApp::idle().await;
    for kind in [
        "application/octet-stream",
        "multipart/form-data; boundary=x",
    ] {
        let more = format!("content-type: {kind}\r\ncontent-length: 99999999999999\r\n");
        let answer = exchange(&app, &[&head("POST", "/v1/footage", &more)]).await;
        assert!(answer.starts_with("HTTP/1.1 413"), "{kind}: {answer}");
    }
    app.assert_sound().await;
}

#[tokio::test]
async fn chunked_body_is_cut_off_at_the_limit() {
    let app = TestApp::start(&["--max-upload-bytes", "1000"]).await;
    let more = "transfer-encoding: chunked\r\n";
    let chunk = [&b"258\r\n"[..], &[7; 600], b"\r\n"].concat();
    let all = [&head("POST", "/v1/footage", more), &chunk[..], &chunk].map(<[u8]>::to_vec);
    // The body never ends.
    let all: Vec<&[u8]> = all.iter().map(Vec::as_slice).collect();
    let answer = exchange(&app, &all).await;
    assert!(answer.starts_with("HTTP/1.1 413"), "{answer}");
    app.assert_sound().await;
}

#[tokio::test]
async fn wrong_content_length_leaves_no_files() {
    let app = TestApp::idle().await;
    let more = |length: usize| format!("content-length: {length}\r\nconnection: close\r\n");
    let less = head("POST", "/v1/footage", &more(TINY.len() / 2));
    let answer = exchange(&app, &[&less, &TINY]).await;
    assert!(answer.starts_with("HTTP/1.1 422"), "{answer}");
    for bad in [
        "content-length: -1\r\n",
        "content-length: 10\r\ncontent-length: 20\r\n",
        "content-length: 10\r\ntransfer-encoding: x\r\n",
    ] {
        let answer = exchange(&app, &[&head("POST", "/v1/footage", bad)]).await;
        assert!(answer.starts_with("HTTP/1.1 400"), "{bad}: {answer}");
    }
    let authority = app.address("").replace("http://", "");
    let mut connection = TcpStream::connect(&authority).await.unwrap();
    let more = head("POST", "/v1/footage", &more(TINY.len() + 1000));
    connection
        .write_all(&[&more, TINY.as_slice()].concat())
        .await
        .unwrap();
    connection.shutdown().await.unwrap();
    let mut answer = String::new();
    connection.read_to_string(&mut answer).await.unwrap();
    assert!(
        answer.is_empty() || answer.contains("body_cut_off"),
        "{answer}"
    );
    assert_eq!(app.json("/v1/footage").await["items"], json!([]));
    app.assert_sound().await;
}

#[tokio::test]
async fn compressed_body_is_refused_on_every_route() {
    let app = TestApp::idle().await;
    for path in [
        "/v1/footage",
        "/v1/analyses",
        "/v1/flocks",
        "/v1/fish",
        "/v1/uploads",
    ] {
        let packed = app.post(path).header("content-encoding", "gzip");
        let answer = packed.body(vec![0x1f, 0x8b, 8, 0]).send().await.unwrap();
        assert_eq!(
            code_of(answer, 415).await,
            "unsupported_media_type",
            "{path}"
        );
    }
    app.assert_sound().await;
}

#[tokio::test]
async fn form_of_ten_thousand_parts_is_refused_at_the_first_unknown_one() {
    let app = TestApp::idle().await;
    let part = |name: &str, value: &[u8]| {
        let head = format!("--x\r\ncontent-disposition: form-data; name=\"{name}\"\r\n\r\n");
        [head.as_bytes(), value, b"\r\n"].concat()
    };
    // Start with the required part, so that only the others are wrong.
    let mut parts = part("video", &TINY);
    for k in 0..10_000 {
        parts.extend(part(&format!("f{k}"), b"v"));
    }
    parts.extend(b"--x--\r\n");
    let answer = app
        .post("/v1/footage")
        .header("content-type", "multipart/form-data; boundary=x");
    let answer = answer.body(parts).send().await.unwrap();
    assert_eq!(code_of(answer, 400).await, "malformed_request");
    app.assert_sound().await;
}

#[tokio::test]
async fn json_two_hundred_deep_is_refused() {
    let app = TestApp::idle().await;
    let deep = format!("{}1{}", "{\"params\":".repeat(200), "}".repeat(200));
    for path in ["/v1/analyses", "/v1/flocks", "/v1/fish"] {
        let answer = app.post(path).header("content-type", "application/json");
        let answer = answer.body(deep.clone()).send().await.unwrap();
        let status = answer.status().as_u16();
        assert!([400, 422].contains(&status), "{path}: {status}");
        code_of(answer, status).await;
    }
    app.assert_sound().await;
}
