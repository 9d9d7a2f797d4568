//! Resumable uploads by tus 1.0.0, sent as raw HTTP (docs/explanation/promises.md, "No upload is lost" and
//! "Bad networks").

use std::time::Duration;

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use flockreel::jobs::clock::now_ms;
use flockreel::store::uploads::LIFETIME_MS;
use reqwest::{Method, RequestBuilder, Response, StatusCode};
use sha1::{Digest, Sha1};
use tokio::io::AsyncWriteExt;
use tokio::net::TcpStream;

use crate::common::TestApp;
use crate::common::app::code_of;
use crate::common::clip::{SWIM, TINY};

fn tus(app: &TestApp, method: &str, path: &str) -> RequestBuilder {
    let method = Method::from_bytes(method.as_bytes()).unwrap();
    let request = app.client.request(method, app.address(path));
    request.header("tus-resumable", "1.0.0")
}

/// Creates an upload and returns its path.
async fn begin(app: &TestApp, size_bytes: usize) -> String {
    let label = STANDARD.encode("../my fish.mp4");
    let answer = tus(app, "POST", "/v1/uploads")
        .header("upload-length", size_bytes)
        .header(
            "upload-metadata",
            format!("filename {label},filetype dmlkZW8="),
        );
    let answer = answer.send().await.unwrap();
    assert_eq!(answer.status(), StatusCode::CREATED);
    assert!(header(&answer, "upload-expires").ends_with(" GMT"));
    header(&answer, "location")
}

fn header(answer: &Response, name: &str) -> String {
    answer.headers()[name].to_str().unwrap().to_owned()
}

fn piece(app: &TestApp, path: &str, offset: usize, bytes: &[u8]) -> RequestBuilder {
    tus(app, "PATCH", path)
        .header("content-type", "application/offset+octet-stream")
        .header("upload-offset", offset)
        .body(bytes.to_vec())
}

async fn offset(app: &TestApp, path: &str) -> usize {
    let answer = tus(app, "HEAD", path).send().await.unwrap();
    assert_eq!(answer.status(), StatusCode::OK);
    assert_eq!(header(&answer, "cache-control"), "no-store");
    header(&answer, "upload-offset").parse().unwrap()
}

/// Sends the head of a PATCH for the bytes `at..all`, then only `some` bytes. Returns the open connection.
async fn send_some(app: &TestApp, path: &str, at: usize, all: usize, some: &[u8]) -> TcpStream {
    let authority = app.address("").replace("http://", "");
    let mut connection = TcpStream::connect(&authority).await.unwrap();
    let head = format!(
        "PATCH {path} HTTP/1.1\r\nhost: {authority}\r\ntus-resumable: 1.0.0\r\nupload-offset: {at}\r\n\
         content-type: application/offset+octet-stream\r\ncontent-length: {}\r\n\r\n",
        all - at
    );
    connection.write_all(head.as_bytes()).await.unwrap();
    connection.write_all(some).await.unwrap();
    connection.flush().await.unwrap();
    connection
}

async fn film_of(app: &TestApp, answer: &Response) -> Vec<u8> {
    let link = header(answer, "link");
    let footage = link.split(['<', '>']).nth(1).unwrap();
    assert_eq!(app.json(footage).await["name"], "my fish.mp4");
    let file = app.get(&format!("{footage}/file")).send().await.unwrap();
    file.bytes().await.unwrap().to_vec()
}

#[tokio::test(flavor = "multi_thread")]
async fn interrupted_upload_continues_and_is_complete() {
    let app = TestApp::idle().await;
    let (film, size) = (&*SWIM, SWIM.len());
    let path = begin(&app, size).await;
    for tenth in 1..10 {
        let (at, cut) = (offset(&app, &path).await, size * tenth / 10);
        drop(send_some(&app, &path, at, size, &film[at..cut]).await);
        for _ in 0..200 {
            if offset(&app, &path).await == cut {
                break;
            }
            tokio::time::sleep(Duration::from_millis(5)).await;
        }
        // Bytes that arrived while the offset was queried may be lost, but the offset never exceeds them.
        assert!(offset(&app, &path).await <= cut);
    }
    let at = offset(&app, &path).await;
    assert!(at > 0, "nothing of nine pieces was kept");
    let last = piece(&app, &path, at, &film[at..]).send().await.unwrap();
    assert_eq!(last.status(), StatusCode::NO_CONTENT);
    assert_eq!(header(&last, "upload-offset"), size.to_string());
    assert!(film_of(&app, &last).await == *film, "other bytes came out");
    assert_eq!(offset(&app, &path).await, size);
    app.assert_sound().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn new_request_takes_an_upload_over_from_a_hanging_one() {
    let app = TestApp::idle().await;
    let path = begin(&app, TINY.len()).await;
    let hanging = send_some(&app, &path, 0, TINY.len(), &TINY[..100]).await;
    tokio::time::sleep(Duration::from_millis(200)).await;
    let asked = tokio::time::timeout(Duration::from_secs(5), offset(&app, &path)).await;
    assert_eq!(asked.expect("an answer in five seconds"), 100);
    let rest = piece(&app, &path, 100, &TINY[100..]).send().await.unwrap();
    assert_eq!(rest.status(), StatusCode::NO_CONTENT);
    drop(hanging);
    app.assert_sound().await;
}

#[tokio::test]
async fn wrong_offset_length_or_version_is_refused() {
    let app = TestApp::idle().await;
    let path = begin(&app, TINY.len()).await;
    let answer = piece(&app, &path, 7, &TINY[7..]).send().await.unwrap();
    assert_eq!(code_of(answer, 409).await, "offset_differs");
    let too_many = piece(&app, &path, 0, &[&TINY[..], b"x"].concat());
    assert_eq!(
        code_of(too_many.send().await.unwrap(), 413).await,
        "too_large"
    );
    let old = app.post("/v1/uploads").header("tus-resumable", "0.2.2");
    let old = old.header("upload-length", 1).send().await.unwrap();
    assert_eq!(header(&old, "tus-version"), "1.0.0");
    assert_eq!(code_of(old, 412).await, "tus_version_not_supported");
    let large = tus(&app, "POST", "/v1/uploads").header("upload-length", 1u64 << 40);
    assert_eq!(code_of(large.send().await.unwrap(), 413).await, "too_large");
    app.assert_sound().await;
}

#[tokio::test]
async fn part_with_a_wrong_checksum_is_not_stored() {
    let app = TestApp::idle().await;
    let path = begin(&app, TINY.len()).await;
    let with_sum = |bytes: &[u8], of: &[u8]| {
        let sum = format!("sha1 {}", STANDARD.encode(Sha1::digest(of)));
        piece(&app, &path, 0, bytes).header("upload-checksum", sum)
    };
    let wrong = with_sum(&TINY[..50], b"other").send().await.unwrap();
    assert_eq!(code_of(wrong, 460).await, "checksum_mismatch");
    assert_eq!(offset(&app, &path).await, 0);
    let right = with_sum(&TINY, &TINY).send().await.unwrap();
    assert!(film_of(&app, &right).await == *TINY);
    app.assert_sound().await;
}

#[tokio::test]
async fn cancelled_refused_and_expired_uploads_are_deleted() {
    let app = TestApp::idle().await;
    let gone = async |path: &str| tus(&app, "HEAD", path).send().await.unwrap().status() == 404;
    let given_up = begin(&app, 10).await;
    let answer = tus(&app, "DELETE", &given_up).send().await.unwrap();
    assert_eq!(answer.status(), StatusCode::NO_CONTENT);
    let refused = begin(&app, 10).await;
    let answer = piece(&app, &refused, 0, b"some words")
        .send()
        .await
        .unwrap();
    assert_eq!(code_of(answer, 422).await, "not_a_video");
    let old = begin(&app, 10).await;
    assert!(!gone(&old).await);
    assert_eq!(app.n_uploads(), 1);
    let later = now_ms() + LIFETIME_MS + 1000;
    assert_eq!(app.context.store.sweep_uploads(later).await.unwrap(), 1);
    assert!(gone(&given_up).await && gone(&refused).await && gone(&old).await);
    assert_eq!(app.n_uploads(), 0);
    app.assert_sound().await;
}

#[tokio::test]
async fn film_may_be_sent_when_the_upload_is_created() {
    let app = TestApp::idle().await;
    let known = app.upload(&TINY).await;
    let whole = tus(&app, "POST", "/v1/uploads").header("upload-length", TINY.len());
    let whole = whole.header("content-type", "application/offset+octet-stream");
    let answer = whole.body(TINY.clone()).send().await.unwrap();
    assert_eq!(answer.status(), StatusCode::CREATED);
    let link = format!("</v1/footage/{known}>; rel=\"related\"");
    assert_eq!(header(&answer, "link"), link);
    let said = app
        .client
        .request(Method::OPTIONS, app.address("/v1/uploads"));
    let said = said.send().await.unwrap();
    assert!(header(&said, "tus-extension").contains("creation-with-upload"));
    app.assert_sound().await;
}
