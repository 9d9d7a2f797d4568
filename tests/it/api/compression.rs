//! Compression of text in responses, and what must not be compressed: media, ranges, events.

use crate::common::TestApp;
use crate::common::app::code_of;
use crate::common::clip::TINY;
use crate::common::results::Results;

#[tokio::test]
async fn text_is_compressed_for_clients_that_accept_gzip() {
    let app = TestApp::idle().await;
    for path in [
        "/openapi.json",
        "/docs/errors",
        "/static/css/base.css",
        "/docs/swagger-ui-bundle.js",
    ] {
        let plain = app.get(path).send().await.unwrap();
        assert!(!plain.headers().contains_key("content-encoding"), "{path}");
        let plain = plain.bytes().await.unwrap();
        for accepted in ["gzip", "gzip;q=0.5, zstd"] {
            let answer = app.get(path).header("accept-encoding", accepted);
            let answer = answer.send().await.unwrap();
            assert_eq!(answer.headers()["content-encoding"], "gzip", "{path}");
            let vary = answer.headers()["vary"].to_str().unwrap().to_owned();
            assert!(vary.contains("accept-encoding"), "{path}: {vary}");
            let bytes = answer.bytes().await.unwrap();
            assert!(
                bytes.starts_with(b"\x1f\x8b") && 2 * bytes.len() < plain.len(),
                "{path}"
            );
        }
    }
    app.assert_sound().await;
}

#[tokio::test]
async fn unknown_codings_and_a_refused_identity_get_plain_text() {
    let app = TestApp::idle().await;
    for accepted in ["br", "identity;q=0", "*;q=0", "gzip;q=0"] {
        let answer = app.get("/openapi.json").header("accept-encoding", accepted);
        let answer = answer.send().await.unwrap();
        assert_eq!(answer.status(), 200, "{accepted}");
        assert!(
            !answer.headers().contains_key("content-encoding"),
            "{accepted}"
        );
    }
    app.assert_sound().await;
}

#[tokio::test]
async fn media_and_events_are_not_compressed() {
    let app = TestApp::idle().await;
    let footage = format!("/v1/footage/{}", app.upload(&TINY).await);
    for path in [
        format!("{footage}/file"),
        format!("{footage}/poster.jpg"),
        "/v1/events".to_owned(),
    ] {
        let answer = app.get(&path).header("accept-encoding", "gzip, zstd");
        let answer = answer.send().await.unwrap();
        assert_eq!(answer.status(), 200, "{path}");
        assert!(!answer.headers().contains_key("content-encoding"), "{path}");
    }
    app.assert_sound().await;
}

#[tokio::test]
async fn compressed_file_has_a_weak_etag_that_gives_304() {
    let app = TestApp::idle().await;
    let results = Results::make(&app, "film.mp4").await;
    let path = format!("{}/poses.csv", results.library);
    let get = || app.get(&path).header("accept-encoding", "gzip");
    let whole = get().send().await.unwrap();
    assert_eq!(whole.headers()["content-encoding"], "gzip");
    let weak = whole.headers()["etag"].to_str().unwrap().to_owned();
    let strong = weak.strip_prefix("W/").unwrap().to_owned();
    let head = app.head(&path).send().await.unwrap();
    assert_eq!(head.headers()["etag"], strong.as_str());
    for (known, said) in [(&weak, &weak), (&strong, &strong)] {
        let again = get().header("if-none-match", known).send().await.unwrap();
        assert_eq!(again.status(), 304, "{known}");
        assert_eq!(again.headers()["etag"], said.as_str());
        assert_eq!(again.headers()["vary"], "accept-encoding");
    }
    let page = app
        .get("/static/css/base.css")
        .header("accept-encoding", "gzip");
    let tag = page.send().await.unwrap().headers()["etag"].clone();
    let again = app.get("/static/css/base.css").header("if-none-match", tag);
    assert_eq!(again.send().await.unwrap().status(), 304);
    app.assert_sound().await;
}

#[tokio::test]
async fn range_of_a_text_has_the_bytes_of_the_file() {
    let app = TestApp::idle().await;
    let results = Results::make(&app, "film.mp4").await;
    let path = format!("{}/poses.csv", results.library);
    let get = || {
        app.get(&path)
            .header("accept-encoding", "gzip")
            .header("range", "bytes=2-5")
    };
    let part = get().send().await.unwrap();
    assert_eq!(part.status(), 206);
    assert!(!part.headers().contains_key("content-encoding"));
    let strong = part.headers()["etag"].clone();
    assert!(!strong.to_str().unwrap().starts_with("W/"));
    assert_eq!(part.bytes().await.unwrap().len(), 4);
    let stale = get().header("if-range", format!("W/{}", strong.to_str().unwrap()));
    assert_eq!(stale.send().await.unwrap().status(), 200);
    let beyond = app.get(&path).header("range", "bytes=9999999-");
    assert_eq!(
        code_of(beyond.send().await.unwrap(), 416).await,
        "range_not_satisfiable"
    );
    app.assert_sound().await;
}
