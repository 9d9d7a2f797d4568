//! The event stream of all jobs of a caller: its events, its recipients, and when it ends.

use std::time::Duration;

use flockreel::store::tokens::Scope;
use reqwest::{RequestBuilder, Response, StatusCode};
use serde_json::{Value, json};
use tokio::time::timeout;

use crate::common::TestApp;
use crate::common::app::json_of;
use crate::common::clip::TINY;

/// An open stream, read event by event.
struct Stream {
    answer: Response,
    text: String,
}

impl Stream {
    async fn open(request: RequestBuilder) -> Stream {
        let answer = request.send().await.unwrap();
        assert_eq!(answer.status(), StatusCode::OK);
        assert_eq!(answer.headers()["content-type"], "text/event-stream");
        assert_eq!(answer.headers()["x-accel-buffering"], "no");
        let text = String::new();
        Stream { answer, text }
    }

    /// Returns the next block of lines, or `None` at the end of the stream.
    async fn block(&mut self) -> Option<String> {
        loop {
            if let Some((block, rest)) = self.text.split_once("\n\n") {
                let (block, rest) = (block.to_owned(), rest.to_owned());
                self.text = rest;
                return Some(block);
            }
            let piece = timeout(Duration::from_secs(20), self.answer.chunk()).await;
            let piece = piece.expect("nothing was heard for 20 s").unwrap()?;
            self.text.push_str(std::str::from_utf8(&piece).unwrap());
        }
    }

    /// Returns name, id and data of the next event, or `None` at the end. Skips blocks without data.
    async fn event(&mut self) -> Option<(String, String, Value)> {
        loop {
            let block = self.block().await?;
            let field = |name: &str| {
                let mut lines = block.lines();
                lines.find_map(|line| Some(line.strip_prefix(name)?.trim().to_owned()))
            };
            if let Some(data) = field("data:") {
                let data = serde_json::from_str(&data).unwrap();
                return Some((field("event:").unwrap(), field("id:").unwrap(), data));
            }
        }
    }

    /// Returns the job id of the next event, with the job's state or, for a deleted job, `gone`.
    async fn next_change(&mut self) -> (Value, String) {
        let (name, _, data) = self.event().await.expect("the stream has ended");
        match name.as_str() {
            "job" => (
                data["id"].clone(),
                data["state"].as_str().unwrap().to_owned(),
            ),
            _ => (data["id"].clone(), name),
        }
    }
}

async fn queued(app: &TestApp, footage: &str) -> Value {
    let accepted = app.accept("/v1/analyses", json!({"footage_id": footage}));
    accepted.await["job_id"].clone()
}

async fn cancel(app: &TestApp, job: &Value) {
    let path = format!("/v1/jobs/{}", job.as_str().unwrap());
    json_of(app.delete(&path).send().await.unwrap(), StatusCode::OK).await;
}

#[tokio::test]
async fn stream_reports_all_jobs_of_its_caller_and_no_others() {
    let mut app = TestApp::start(&["--auth", "required"]).await;
    let (owner, stranger) = (
        app.token(Scope::Write, 9).await,
        app.token(Scope::Write, 9).await,
    );
    app.sign_in(&stranger);
    let footage = app.upload(&TINY).await;
    queued(&app, &footage).await;
    let ended = queued(&app, &footage).await;
    cancel(&app, &ended).await;
    app.sign_in(&owner);
    let footage = app.upload(&TINY).await;
    let first = queued(&app, &footage).await;
    let mut stream = Stream::open(app.get("/v1/events")).await;
    assert_eq!(
        stream.next_change().await,
        (first.clone(), "queued".to_owned())
    );
    let second = queued(&app, &footage).await;
    assert_eq!(
        stream.next_change().await,
        (second.clone(), "queued".to_owned())
    );
    cancel(&app, &first).await;
    assert_eq!(
        stream.next_change().await,
        (first.clone(), "cancelled".to_owned())
    );
    // A job that is created and cancelled between two polls.
    let third = queued(&app, &footage).await;
    cancel(&app, &third).await;
    let mut change = stream.next_change().await;
    if change == (third.clone(), "queued".to_owned()) {
        change = stream.next_change().await;
    }
    assert_eq!(change, (third.clone(), "cancelled".to_owned()));
    // A client that asks for the whole history also receives only events of its own jobs.
    let all = app.get("/v1/events").header("last-event-id", "1");
    let mut all = Stream::open(all).await;
    for expected in [&first, &second, &third] {
        assert_eq!(all.next_change().await.0, *expected);
    }
    let deleted = app.delete(&format!("/v1/footage/{footage}")).send().await;
    assert_eq!(deleted.unwrap().status(), 204);
    assert_eq!(stream.next_change().await, (second, "gone".to_owned()));
    app.assert_sound().await;
}

#[tokio::test]
async fn reconnecting_client_gets_missed_events() {
    let app = TestApp::idle().await;
    let footage = app.upload(&TINY).await;
    let job = queued(&app, &footage).await;
    let mut stream = Stream::open(app.get("/v1/events")).await;
    let (_, last_id, _) = stream.event().await.unwrap();
    drop(stream);
    cancel(&app, &job).await;
    let cut = app.get("/v1/events").header("last-event-id", &last_id);
    let mut stream = Stream::open(cut).await;
    assert_eq!(stream.next_change().await, (job, "cancelled".to_owned()));
    drop(stream);
    let mut fresh = Stream::open(app.get("/v1/events")).await;
    let other = queued(&app, &footage).await;
    assert_eq!(
        fresh.next_change().await,
        (other, "queued".to_owned()),
        "only what is under way"
    );
    app.assert_sound().await;
}

#[tokio::test]
async fn stream_ends_with_its_token_or_session() {
    let app = TestApp::start(&["--auth", "required"]).await;
    let (token, other) = (
        app.token(Scope::Read, 1).await,
        app.token(Scope::Read, 1).await,
    );
    let session = app
        .post("/v1/session")
        .json(&json!({"token": other}))
        .send()
        .await;
    let cookie = session.unwrap().headers()["set-cookie"]
        .to_str()
        .unwrap()
        .to_owned();
    let cookie = cookie.split(';').next().unwrap();
    let mut by_token = Stream::open(app.get("/v1/events").bearer_auth(&token)).await;
    let mut by_cookie = Stream::open(app.get("/v1/events").header("cookie", cookie)).await;
    for stream in [&mut by_token, &mut by_cookie] {
        assert_eq!(stream.block().await.unwrap(), "retry: 1000");
    }
    let id = token.split('_').nth(1).unwrap();
    assert!(app.context.store.revoke_token(id, 1).await.unwrap());
    assert_eq!(by_token.event().await, None);
    let out = app
        .delete("/v1/session")
        .header("cookie", cookie)
        .send()
        .await;
    assert_eq!(out.unwrap().status(), 204);
    assert_eq!(by_cookie.event().await, None);
    assert_eq!(app.get("/v1/events").send().await.unwrap().status(), 401);
    app.assert_sound().await;
}

#[tokio::test]
async fn quiet_stream_sends_keep_alive_comments() {
    let app = TestApp::idle().await;
    let mut stream = Stream::open(app.get("/v1/events")).await;
    assert_eq!(stream.block().await.unwrap(), "retry: 1000");
    assert_eq!(stream.block().await.unwrap(), ":", "a comment");
    app.context.draining.cancel();
    assert_eq!(stream.event().await, None, "a service that stops ends it");
    app.assert_sound().await;
}
