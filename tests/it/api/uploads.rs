//! Resumable uploads by tus 1.0.0, sent as raw HTTP (docs/explanation/promises.md, "No upload is lost" and
//! "Bad networks").

use std::time::Duration;

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use flockreel::jobs::clock::now_ms;
use flockreel::store::uploads::LIFETIME_MS;
use reqwest::{Method, Response, StatusCode};
use sha1::{Digest, Sha1};

use crate::common::TestApp;
use crate::common::app::code_of;
use crate::common::clip::{SWIM, TINY};
use crate::common::tus::{self, begin, header, offset, piece, send_some};

async fn film_of(app: &TestApp, answer: &Response) -> Vec<u8> {
    let footage = tus::footage(answer);
    assert_eq!(app.json(&footage).await["name"], "my fish.mp4");
    let file = app.get(&format!("{footage}/file")).send().await.unwrap();
    file.bytes().await.unwrap().to_vec()
}

#[tokio::test(flavor = "multi_thread")]
async fn interrupted_upload_continues_and_is_complete() {
    let app = TestApp::idle().await;
    let (film, size) = (&*SWIM, SWIM.len());
    let path = begin(&app.base, size).await;
    for tenth in 1..10 {
        let (at, cut) = (offset(&app.base, &path).await, size * tenth / 10);
        drop(send_some(&app.base, &path, at, size, &film[at..cut]).await);
        for _ in 0..200 {
            if offset(&app.base, &path).await == cut {
                break;
            }
            tokio::time::sleep(Duration::from_millis(5)).await;
        }
        // Bytes that arrived while the offset was queried may be lost, but the offset never exceeds them.
        assert!(offset(&app.base, &path).await <= cut);
    }
    let at = offset(&app.base, &path).await;
    assert!(at > 0, "nothing of nine pieces was kept");
    let last = piece(&app.base, &path, at, &film[at..])
        .send()
        .await
        .unwrap();
    assert_eq!(last.status(), StatusCode::NO_CONTENT);
    assert_eq!(header(&last, "upload-offset"), size.to_string());
    assert!(film_of(&app, &last).await == *film, "other bytes came out");
    assert_eq!(offset(&app.base, &path).await, size);
    app.assert_sound().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn new_request_takes_an_upload_over_from_a_hanging_one() {
    let app = TestApp::idle().await;
    let path = begin(&app.base, TINY.len()).await;
    let hanging = send_some(&app.base, &path, 0, TINY.len(), &TINY[..100]).await;
    tokio::time::sleep(Duration::from_millis(200)).await;
    let asked = tokio::time::timeout(Duration::from_secs(5), offset(&app.base, &path)).await;
    assert_eq!(asked.expect("an answer in five seconds"), 100);
    let rest = piece(&app.base, &path, 100, &TINY[100..])
        .send()
        .await
        .unwrap();
    assert_eq!(rest.status(), StatusCode::NO_CONTENT);
    drop(hanging);
    app.assert_sound().await;
}

#[tokio::test]
async fn wrong_offset_length_or_version_is_refused() {
    let app = TestApp::idle().await;
    let path = begin(&app.base, TINY.len()).await;
    let answer = piece(&app.base, &path, 7, &TINY[7..]).send().await.unwrap();
    assert_eq!(code_of(answer, 409).await, "offset_differs");
    let too_many = piece(&app.base, &path, 0, &[&TINY[..], b"x"].concat());
    assert_eq!(
        code_of(too_many.send().await.unwrap(), 413).await,
        "too_large"
    );
    let old = app.post("/v1/uploads").header("tus-resumable", "0.2.2");
    let old = old.header("upload-length", 1).send().await.unwrap();
    assert_eq!(header(&old, "tus-version"), "1.0.0");
    assert_eq!(code_of(old, 412).await, "tus_version_not_supported");
    let large = tus::request(&app.base, "POST", "/v1/uploads").header("upload-length", 1u64 << 40);
    assert_eq!(code_of(large.send().await.unwrap(), 413).await, "too_large");
    app.assert_sound().await;
}

#[tokio::test]
async fn part_with_a_wrong_checksum_is_not_stored() {
    let app = TestApp::idle().await;
    let path = begin(&app.base, TINY.len()).await;
    let with_sum = |bytes: &[u8], of: &[u8]| {
        let sum = format!("sha1 {}", STANDARD.encode(Sha1::digest(of)));
        piece(&app.base, &path, 0, bytes).header("upload-checksum", sum)
    };
    let wrong = with_sum(&TINY[..50], b"other").send().await.unwrap();
    assert_eq!(code_of(wrong, 460).await, "checksum_mismatch");
    assert_eq!(offset(&app.base, &path).await, 0);
    let right = with_sum(&TINY, &TINY).send().await.unwrap();
    assert!(film_of(&app, &right).await == *TINY);
    app.assert_sound().await;
}

#[tokio::test]
async fn cancelled_refused_and_expired_uploads_are_deleted() {
    let app = TestApp::idle().await;
    let gone = async |path: &str| {
        tus::request(&app.base, "HEAD", path)
            .send()
            .await
            .unwrap()
            .status()
            == 404
    };
    let given_up = begin(&app.base, 10).await;
    let answer = tus::request(&app.base, "DELETE", &given_up)
        .send()
        .await
        .unwrap();
    assert_eq!(answer.status(), StatusCode::NO_CONTENT);
    let refused = begin(&app.base, 10).await;
    let answer = piece(&app.base, &refused, 0, b"some words")
        .send()
        .await
        .unwrap();
    assert_eq!(code_of(answer, 422).await, "not_a_video");
    let old = begin(&app.base, 10).await;
    assert!(!gone(&old).await);
    assert_eq!(app.n_uploads().await, 1);
    let later = now_ms() + LIFETIME_MS + 1000;
    assert_eq!(app.context.store.sweep_uploads(later).await.unwrap(), 1);
    assert!(gone(&given_up).await && gone(&refused).await && gone(&old).await);
    assert_eq!(app.n_uploads().await, 0);
    app.assert_sound().await;
}

#[tokio::test]
async fn film_may_be_sent_when_the_upload_is_created() {
    let app = TestApp::idle().await;
    let known = app.upload(&TINY).await;
    let whole = tus::request(&app.base, "POST", "/v1/uploads").header("upload-length", TINY.len());
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
