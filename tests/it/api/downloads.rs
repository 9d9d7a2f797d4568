//! Range requests, conditional requests and HEAD, for an uploaded film (docs/explanation/promises.md,
//! "Exact ranges" and "Bad networks").

use reqwest::StatusCode;

use crate::common::TestApp;
use crate::common::app::code_of;
use crate::common::clip::TINY;
use crate::common::process::numbered_film;

#[tokio::test]
async fn range_returns_exactly_the_requested_bytes() {
    let app = TestApp::idle().await;
    let path = format!("/v1/footage/{}/file", app.upload(&TINY).await);
    let size = TINY.len();
    for (range, part) in [
        ("bytes=0-0".to_owned(), 0..1),
        ("bytes=5-99".to_owned(), 5..100),
        (format!("bytes={}-", size - 1), size - 1..size),
        ("bytes=-7".to_owned(), size - 7..size),
        (format!("bytes=10-{}", 2 * size), 10..size),
    ] {
        let answer = app.get(&path).header("range", &range).send().await.unwrap();
        assert_eq!(answer.status(), StatusCode::PARTIAL_CONTENT, "{range}");
        let said = format!("bytes {}-{}/{size}", part.start, part.end - 1);
        assert_eq!(answer.headers()["content-range"], said.as_str());
        assert_eq!(answer.bytes().await.unwrap(), TINY[part], "{range}");
    }
    app.assert_sound().await;
}

#[tokio::test]
async fn range_beyond_the_end_gives_416() {
    let app = TestApp::idle().await;
    let path = format!("/v1/footage/{}/file", app.upload(&TINY).await);
    let range = format!("bytes={}-", TINY.len());
    let answer = app.get(&path).header("range", range).send().await.unwrap();
    let said = format!("bytes */{}", TINY.len());
    assert_eq!(answer.headers()["content-range"], said.as_str());
    assert_eq!(code_of(answer, 416).await, "range_not_satisfiable");
    app.assert_sound().await;
}

#[tokio::test]
async fn known_etag_gives_304_and_if_range_sends_parts_only_of_that_version() {
    let app = TestApp::idle().await;
    let path = format!("/v1/footage/{}/file", app.upload(&TINY).await);
    let head = app.head(&path).send().await.unwrap();
    assert_eq!(
        head.headers()["content-length"],
        TINY.len().to_string().as_str()
    );
    assert_eq!(head.headers()["accept-ranges"], "bytes");
    let etag = head.headers()["etag"].clone();

    let same = app
        .get(&path)
        .header("if-none-match", &etag)
        .send()
        .await
        .unwrap();
    assert_eq!(same.status(), StatusCode::NOT_MODIFIED);
    assert_eq!(same.bytes().await.unwrap().len(), 0);

    let part = |tag: &str| {
        app.get(&path)
            .header("range", "bytes=1-2")
            .header("if-range", tag)
    };
    let fresh = part(etag.to_str().unwrap()).send().await.unwrap();
    assert_eq!(fresh.bytes().await.unwrap(), TINY[1..3]);
    let stale = part("\"another\"").send().await.unwrap();
    assert_eq!(stale.status(), StatusCode::OK);
    assert_eq!(stale.bytes().await.unwrap(), *TINY);
    app.assert_sound().await;
}

#[tokio::test]
async fn unsupported_ranges_get_the_whole_file() {
    let app = TestApp::idle().await;
    let path = format!("/v1/footage/{}/file", app.upload(&TINY).await);
    for range in [
        "bytes=0-1,5-6",
        "bytes=5-2",
        "bytes=x-",
        "lines=0-1",
        "bytes=0-1;",
    ] {
        let answer = app.get(&path).header("range", range).send().await.unwrap();
        assert_eq!(answer.status(), StatusCode::OK, "{range}");
        assert!(!answer.headers().contains_key("content-range"), "{range}");
        assert_eq!(answer.bytes().await.unwrap(), *TINY, "{range}");
    }
    let head = app
        .head(&path)
        .header("range", "bytes=0-1")
        .send()
        .await
        .unwrap();
    assert_eq!(head.status(), StatusCode::OK);
    let size = TINY.len().to_string();
    assert_eq!(head.headers()["content-length"], size.as_str());
    for nothing in ["bytes=-0", "bytes=99999999999999999999-"] {
        let answer = app
            .get(&path)
            .header("range", nothing)
            .send()
            .await
            .unwrap();
        assert_eq!(
            code_of(answer, 416).await,
            "range_not_satisfiable",
            "{nothing}"
        );
    }
    app.assert_sound().await;
}

#[tokio::test]
async fn weak_etags_match_if_none_match_but_not_if_range() {
    let app = TestApp::idle().await;
    let path = format!("/v1/footage/{}/file", app.upload(&TINY).await);
    let head = app.head(&path).send().await.unwrap();
    let etag = head.headers()["etag"].to_str().unwrap().to_owned();
    for known in [
        format!("\"x\", {etag}"),
        format!("W/{etag}"),
        "*".to_owned(),
    ] {
        for request in [app.get(&path), app.head(&path)] {
            let request = request.header("range", "bytes=0-1");
            let answer = request
                .header("if-none-match", &known)
                .send()
                .await
                .unwrap();
            assert_eq!(answer.status(), StatusCode::NOT_MODIFIED, "{known}");
            assert_eq!(answer.headers()["etag"], etag.as_str(), "{known}");
        }
    }
    for stale in [
        format!("W/{etag}"),
        "Sat, 21 Nov 2026 09:30:00 GMT".to_owned(),
    ] {
        let request = app.get(&path).header("range", "bytes=0-1");
        let answer = request.header("if-range", &stale).send().await.unwrap();
        assert_eq!(answer.status(), StatusCode::OK, "{stale}");
    }
    app.assert_sound().await;
}

#[tokio::test]
async fn download_cut_at_every_tenth_continues_to_equal_bytes() {
    let app = TestApp::idle().await;
    let film = numbered_film(1);
    let path = format!("/v1/footage/{}/file", app.upload(&film).await);
    let (mut received, mut etag) = (Vec::new(), None);
    for tenth in 1..=10 {
        let range = format!("bytes={}-", received.len());
        let mut request = app.get(&path).header("range", range);
        if let Some(etag) = &etag {
            request = request.header("if-range", etag);
        }
        let mut answer = request.send().await.unwrap();
        assert_eq!(answer.status(), StatusCode::PARTIAL_CONTENT);
        etag = Some(answer.headers()["etag"].clone());
        // The client reads up to a tenth and closes the connection.
        while received.len() < film.len() * tenth / 10 {
            let piece = answer.chunk().await.unwrap().unwrap();
            let n_wanted = film.len() * tenth / 10 - received.len();
            received.extend_from_slice(&piece[..piece.len().min(n_wanted)]);
        }
    }
    assert!(received == film, "the pieces differ from the film");
    app.assert_sound().await;
}
