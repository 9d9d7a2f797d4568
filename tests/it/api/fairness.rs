//! One client cannot take what others need: connections, turns, and the requests of signed links
//! (docs/explanation/promises.md, "Overload" and "Slow clients").

use std::time::Duration;

use flockreel::api::signed;
use flockreel::jobs::clock::now_ms;
use flockreel::store::tokens::Scope;
use reqwest::{Response, StatusCode};
use tokio::io::{AsyncReadExt, AsyncWriteExt};
use tokio::net::TcpStream;

use crate::common::TestApp;
use crate::common::app::code_of;
use crate::common::clip::TINY;
use crate::common::results::Results;

#[tokio::test]
async fn open_requests_of_an_owner_are_limited() {
    let app = TestApp::start(&["--max-open-requests", "3"]).await;
    let (greedy, other) = (
        app.token(Scope::Read, 1).await,
        app.token(Scope::Read, 1).await,
    );
    let ask = async |path: &str, token: &str| -> Response {
        app.get(path).bearer_auth(token).send().await.unwrap()
    };
    let mut streams = Vec::new();
    for _ in 0..3 {
        let stream = ask("/v1/events", &greedy).await;
        assert_eq!(stream.status(), StatusCode::OK);
        streams.push(stream);
    }
    let refused = ask("/v1/jobs", &greedy).await;
    assert!(refused.headers().contains_key("retry-after"));
    assert_eq!(code_of(refused, 429).await, "rate_limited");
    assert_eq!(ask("/v1/jobs", &other).await.status(), StatusCode::OK);
    drop(streams);
    // The service notices closed connections soon, but not at once.
    for _ in 0..100 {
        if ask("/v1/jobs", &greedy).await.status() == StatusCode::OK {
            app.assert_sound().await;
            return;
        }
        tokio::time::sleep(Duration::from_millis(100)).await;
    }
    panic!("requests count as open after their end");
}

#[tokio::test]
async fn each_signed_link_has_its_own_rate() {
    let app = TestApp::start(&["--rate", "2"]).await;
    let flock = Results::make(&app, "fish").await.flock;
    let key = app.context.store.signing_key().await.unwrap();
    let link = |name: &str| {
        let path = format!("{flock}/{name}");
        signed(&key, &path, now_ms() / 1000 + 60)
    };
    let ask = async |link: &str| app.get(link).send().await.unwrap().status();
    let (flooded, other) = (link("video.mp4"), link("flock.json"));
    let mut n_asked = 0;
    while ask(&flooded).await != StatusCode::TOO_MANY_REQUESTS {
        n_asked += 1;
        assert!(n_asked < 60, "the flooded link is not limited");
    }
    assert_eq!(ask(&other).await, StatusCode::OK);
    app.assert_sound().await;
}

#[tokio::test]
async fn refusal_reaches_a_client_that_is_still_sending() {
    let app = TestApp::start(&["--max-upload-bytes", "1000"]).await;
    let authority = app.address("").replace("http://", "");
    let mut connection = TcpStream::connect(&authority).await.unwrap();
    let n_bytes = 64 << 20;
    let head = format!(
        "POST /v1/footage HTTP/1.1\r\nhost: 127.0.0.1\r\ncontent-length: {n_bytes}\r\n\r\n"
    );
    connection.write_all(head.as_bytes()).await.unwrap();
    // The client reads nothing before it has sent everything.
    for _ in 0..n_bytes >> 20 {
        connection.write_all(&[7; 1 << 20]).await.unwrap();
    }
    let mut answer = Vec::new();
    connection.read_to_end(&mut answer).await.unwrap();
    assert!(answer.starts_with(b"HTTP/1.1 413"), "{answer:?}");
    app.assert_sound().await;
}

#[tokio::test]
async fn request_runs_only_for_the_version_that_it_names() {
    let app = TestApp::idle().await;
    let footage = app.upload(&TINY).await;
    let (film, resource) = (
        format!("/v1/footage/{footage}/file"),
        format!("/v1/footage/{footage}"),
    );
    let head = app.head(&film).send().await.unwrap();
    let tag = head.headers()["etag"].to_str().unwrap().to_owned();
    for (wanted, status) in [
        (tag.as_str(), 200),
        ("*", 200),
        ("\"other\", \"another\"", 412),
    ] {
        let answer = app.head(&film).header("if-match", wanted).send().await;
        assert_eq!(answer.unwrap().status(), status, "{wanted}");
    }
    let refused = app.delete(&resource).header("if-match", "\"other\"").send();
    assert_eq!(
        code_of(refused.await.unwrap(), 412).await,
        "precondition_failed"
    );
    let gone = app.delete(&resource).header("if-match", "*").send().await;
    assert_eq!(gone.unwrap().status(), 204);
    app.assert_sound().await;
}
