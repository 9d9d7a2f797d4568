//! Pictures: the poster of footage, made when footage is taken in, and files of pictures that are made to cost much.

use std::time::{Duration, Instant};

use flockreel::store::tokens::Scope;
use reqwest::StatusCode;

use crate::common::TestApp;
use crate::common::app::{code_of, json_of};
use crate::common::clip::{SWIM, TINY};
use crate::common::pictures::zip_of_grays;
use crate::common::process::command_lines;
use crate::common::results::store_film;

#[tokio::test]
async fn every_kind_of_footage_has_a_poster() {
    let app = TestApp::idle().await;
    for (film, width) in [
        (&TINY[..], 64),
        (&SWIM[..], 320),
        (&zip_of_grays(12)[..], 64),
    ] {
        let path = format!("/v1/footage/{}/poster.jpg", app.upload(film).await);
        let answer = app.get(&path).send().await.unwrap();
        assert_eq!(answer.status(), 200);
        assert_eq!(answer.headers()["content-type"], "image/jpeg");
        assert!(answer.headers().contains_key("etag"));
        let picture = image::load_from_memory(&answer.bytes().await.unwrap());
        assert_eq!(picture.unwrap().width(), width);
    }
    app.assert_sound().await;
}

#[tokio::test]
async fn footage_without_a_poster_answers_not_found() {
    let app = TestApp::idle().await;
    let id = store_film(&app, &TINY, false).await;
    let answer = app.get(&format!("/v1/footage/{id}/poster.jpg"));
    assert_eq!(
        code_of(answer.send().await.unwrap(), 404).await,
        "not_found"
    );
    app.assert_sound().await;
}

/// Returns a TIFF whose directories share their tags: a few megabytes, and two billion tags.
fn overlapping_tiff() -> Vec<u8> {
    let (n_pages, step, n_tags) = (40_000_u32, 164_u32, 65_529_u16);
    let mut bytes = vec![0; (n_pages * step) as usize + usize::from(n_tags) * 12 + 14];
    bytes[..8].copy_from_slice(b"II*\0\x08\0\0\0");
    for page in 0..n_pages {
        let at = (8 + page * step) as usize;
        bytes[at..at + 2].copy_from_slice(&n_tags.to_le_bytes());
        let link = at + 2 + usize::from(n_tags) * 12;
        bytes[link..link + 4].copy_from_slice(&(8 + (page + 1) * step).to_le_bytes());
    }
    bytes
}

#[tokio::test]
async fn tiff_with_billions_of_tags_is_refused_at_once() {
    let app = TestApp::idle().await;
    let begun = Instant::now();
    let sent = app.post("/v1/footage").body(overlapping_tiff()).send();
    let problem = json_of(sent.await.unwrap(), StatusCode::UNPROCESSABLE_ENTITY).await;
    assert_eq!(problem["code"], "not_a_video");
    let detail = problem["detail"].as_str().unwrap();
    assert!(
        detail.contains("TIFF") && !detail.contains("ffmpeg"),
        "{detail}"
    );
    assert!(
        begun.elapsed() < Duration::from_secs(5),
        "{:?}",
        begun.elapsed()
    );
    app.assert_sound().await;
}

#[tokio::test]
async fn received_files_that_crash_their_reader_are_refused() {
    let app = TestApp::with_script("kill -SEGV $$").await;
    let sent = app.post("/v1/footage").body(TINY.to_vec()).send();
    assert_eq!(code_of(sent.await.unwrap(), 422).await, "decoder_crashed");
    app.assert_sound().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn check_that_hangs_ends_in_time_and_delays_no_other_owner() {
    let app = TestApp::with_script("sleep 300; :").await;
    let [hostile, other] = [
        app.token(Scope::Write, 1).await,
        app.token(Scope::Write, 1).await,
    ];
    let url = app.address("/v1/footage");
    let upload = |token: &str| {
        let request = app.client.post(&url).bearer_auth(token);
        tokio::spawn(request.body(TINY.to_vec()).send())
    };
    let hanging: Vec<_> = (0..6).map(|_| upload(&hostile)).collect();
    until(|| n_checks(&app) > 0).await;
    let waiting = upload(&other);
    // The check of the other owner runs beside one of the first.
    until(|| n_checks(&app) == 2).await;
    let refused = waiting.await.unwrap().unwrap();
    assert_eq!(code_of(refused, 422).await, "time_limit");
    for refused in hanging {
        let refused = refused.await.unwrap().unwrap();
        assert_eq!(code_of(refused, 422).await, "time_limit");
    }
    assert_eq!(n_checks(&app), 0);
    app.assert_sound().await;
}

/// Returns the number of running checks of files of the service.
fn n_checks(app: &TestApp) -> usize {
    let data = app.folder().to_str().unwrap();
    let lines = command_lines().into_iter();
    lines
        .filter(|(_, line)| line.contains("attempt") && line.contains(data))
        .count()
}

async fn until(is_so: impl Fn() -> bool) {
    let begun = Instant::now();
    while !is_so() {
        assert!(
            begun.elapsed() < Duration::from_secs(30),
            "it never came true"
        );
        tokio::time::sleep(Duration::from_millis(20)).await;
    }
}
