//! Tokens, browser sessions, scopes, quotas and rate limits, and the responses to rejected callers.

use flockreel::store::tokens::Scope;
use reqwest::{Response, StatusCode};
use serde_json::json;

use crate::common::TestApp;
use crate::common::app::{code_of, json_of};
use crate::common::clip::TINY;

async fn demanding() -> TestApp {
    TestApp::start(&["--auth", "required"]).await
}

fn cookie_of(answer: &Response) -> String {
    let cookie = answer.headers()["set-cookie"].to_str().unwrap();
    for part in ["; HttpOnly", "; SameSite=Strict", "; Path=/"] {
        assert!(cookie.contains(part), "{cookie}");
    }
    cookie.split(';').next().unwrap().to_owned()
}

#[tokio::test]
async fn only_the_page_is_open_without_a_valid_token() {
    let app = demanding().await;
    let good = app.token(Scope::Read, 1).await;
    let other = if good.ends_with('x') { 'y' } else { 'x' };
    let wrong = format!("{}{other}", &good[..good.len() - 1]);
    for token in [None, Some("frl_a_b"), Some(wrong.as_str())] {
        for path in ["/v1/jobs", "/v1/footage", "/nowhere"] {
            let request = app.get(path);
            let request = match token {
                Some(token) => request.bearer_auth(token),
                None => request,
            };
            let answer = request.send().await.unwrap();
            assert!(answer.headers().contains_key("www-authenticate"), "{path}");
            assert_eq!(code_of(answer, 401).await, "unauthenticated", "{path}");
        }
    }
    for path in [
        "/",
        "/films",
        "/libraries/any/studio",
        "/s/any",
        "/static/js/main.js",
        "/openapi.json",
        "/healthz",
        "/readyz",
    ] {
        assert_eq!(app.get(path).send().await.unwrap().status(), 200, "{path}");
    }
    let answer = app.get("/v1/jobs").bearer_auth(&good).send().await;
    assert_eq!(answer.unwrap().status(), 200);
    app.assert_sound().await;
}

#[tokio::test]
async fn a_revoked_token_is_refused_with_the_next_request() {
    let app = demanding().await;
    let token = app.token(Scope::Write, 1).await;
    let ask = async || {
        app.get("/v1/jobs")
            .bearer_auth(&token)
            .send()
            .await
            .unwrap()
    };
    assert_eq!(ask().await.status(), 200);
    let id = token.split('_').nth(1).unwrap();
    assert!(app.context.store.revoke_token(id, 1).await.unwrap());
    assert_eq!(code_of(ask().await, 401).await, "unauthenticated");
    app.assert_sound().await;
}

#[tokio::test]
async fn local_requests_need_no_token_but_invalid_tokens_are_refused() {
    let app = TestApp::idle().await;
    app.token(Scope::Read, 1).await;
    assert_eq!(app.get("/v1/jobs").send().await.unwrap().status(), 200);
    let answer = app.get("/v1/jobs").bearer_auth("frl_a_b").send().await;
    assert_eq!(code_of(answer.unwrap(), 401).await, "unauthenticated");
    app.assert_sound().await;
}

#[tokio::test]
async fn read_token_cannot_create_or_cancel() {
    let mut app = demanding().await;
    let token = app.token(Scope::Read, 1).await;
    app.sign_in(&token);
    let answer = app.post("/v1/footage").body(TINY.clone()).send().await;
    assert_eq!(code_of(answer.unwrap(), 403).await, "scope_too_small");
    let path = format!("/v1/jobs/{}", uuid::Uuid::now_v7());
    let answer = app.delete(&path).send().await.unwrap();
    assert_eq!(code_of(answer, 403).await, "scope_too_small");
    assert_eq!(app.get(&path).send().await.unwrap().status(), 404);
    app.assert_sound().await;
}

#[tokio::test]
async fn a_browser_signs_in_with_a_token_and_out_again() {
    let app = demanding().await;
    let token = app.token(Scope::Write, 1).await;
    let sign_in = |token: &str| app.post("/v1/session").json(&json!({"token": token}));
    let refused = sign_in("frl_a_b").send().await.unwrap();
    assert_eq!(code_of(refused, 401).await, "unauthenticated");

    let answer = sign_in(&token).send().await.unwrap();
    let cookie = cookie_of(&answer);
    assert!(!cookie.contains(&token));
    let session = json_of(answer, StatusCode::CREATED).await;
    assert_eq!(session["scope"], "write");
    let ask = async || {
        let request = app.get("/v1/jobs").header("cookie", &cookie);
        request.send().await.unwrap()
    };
    assert_eq!(ask().await.status(), 200);

    let out = app.delete("/v1/session").header("cookie", &cookie).send();
    assert_eq!(out.await.unwrap().status(), 204);
    assert_eq!(code_of(ask().await, 401).await, "unauthenticated");
    app.assert_sound().await;
}

#[tokio::test]
async fn https_cookie_is_bound_to_its_host() {
    let app = demanding().await;
    let token = app.token(Scope::Write, 1).await;
    let answer = app.post("/v1/session").json(&json!({"token": token}));
    let answer = answer
        .header("x-forwarded-proto", "https")
        .send()
        .await
        .unwrap();
    assert!(
        answer.headers()["set-cookie"]
            .to_str()
            .unwrap()
            .ends_with("; Secure")
    );
    assert!(cookie_of(&answer).starts_with("__Host-"));
    app.assert_sound().await;
}

#[tokio::test]
async fn cross_site_write_with_a_session_cookie_is_refused() {
    let app = demanding().await;
    let token = app.token(Scope::Write, 1).await;
    let answer = app
        .post("/v1/session")
        .json(&json!({"token": token}))
        .send();
    let cookie = cookie_of(&answer.await.unwrap());
    let write = async |name: &'static str, value: &'static str| {
        let request = app.post("/v1/analyses").header("cookie", &cookie);
        request.header(name, value).body("{}").send().await.unwrap()
    };
    for (name, value) in [
        ("origin", "https://evil.example"),
        ("origin", "null"),
        ("sec-fetch-site", "cross-site"),
        ("sec-fetch-site", "same-site"),
        ("x-nothing", "no header that names the origin"),
    ] {
        assert_eq!(code_of(write(name, value).await, 403).await, "cross_site");
    }
    let ours = write("sec-fetch-site", "same-origin").await;
    assert_eq!(code_of(ours, 415).await, "unsupported_media_type");
    app.assert_sound().await;
}

#[tokio::test]
async fn jobs_above_the_quota_are_refused_with_retry_after() {
    let mut app = demanding().await;
    let token = app.token(Scope::Write, 2).await;
    app.sign_in(&token);
    let footage_id = app.upload(&TINY).await;
    let body = json!({"footage_id": footage_id});
    let first = app.accept("/v1/analyses", body.clone()).await;
    app.accept("/v1/analyses", body.clone()).await;
    let answer = app.post("/v1/analyses").json(&body).send().await.unwrap();
    assert!(answer.headers().contains_key("retry-after"));
    assert_eq!(code_of(answer, 429).await, "quota_exceeded");
    let path = format!("/v1/jobs/{}", first["job_id"].as_str().unwrap());
    assert_eq!(app.delete(&path).send().await.unwrap().status(), 200);
    app.accept("/v1/analyses", body).await;
    app.assert_sound().await;
}

#[tokio::test]
async fn rate_limit_applies_to_one_owner_only() {
    let app = TestApp::start(&["--rate", "2"]).await;
    let (hasty, other) = (
        app.token(Scope::Read, 1).await,
        app.token(Scope::Read, 1).await,
    );
    let ask = async |token: &str| app.get("/v1/jobs").bearer_auth(token).send().await.unwrap();
    let mut refused = None;
    for _ in 0..60 {
        let answer = ask(&hasty).await;
        if answer.status() != 200 {
            refused = Some(answer);
            break;
        }
    }
    let refused = refused.expect("sixty requests at once are more than eight");
    assert!(refused.headers().contains_key("retry-after"));
    assert_eq!(code_of(refused, 429).await, "rate_limited");
    assert_eq!(ask(&other).await.status(), 200);
    app.assert_sound().await;
}

#[tokio::test]
async fn guesses_are_limited_while_valid_tokens_work() {
    let app = demanding().await;
    let good = app.token(Scope::Read, 1).await;
    let guess = async || {
        let guess = app.post("/v1/session").json(&json!({"token": "frl_a_b"}));
        guess.send().await.unwrap()
    };
    let mut answers = Vec::new();
    for _ in 0..60 {
        answers.push(guess().await.status().as_u16());
    }
    assert_eq!(answers[..20], [401; 20]);
    let refused = guess().await;
    assert!(refused.headers().contains_key("retry-after"));
    assert_eq!(code_of(refused, 429).await, "rate_limited");
    let answer = app.get("/v1/jobs").bearer_auth(&good).send().await;
    assert_eq!(answer.unwrap().status(), 200);
    app.assert_sound().await;
}

#[tokio::test]
async fn full_queue_refuses_jobs_with_retry_after() {
    let app = TestApp::start(&["--max-queued", "1"]).await;
    let body = json!({"footage_id": app.upload(&TINY).await});
    let first = app.accept("/v1/analyses", body.clone()).await;
    let answer = app.post("/v1/analyses").json(&body).send().await.unwrap();
    assert!(answer.headers().contains_key("retry-after"));
    assert_eq!(code_of(answer, 503).await, "queue_full");
    let path = format!("/v1/jobs/{}", first["job_id"].as_str().unwrap());
    assert_eq!(app.delete(&path).send().await.unwrap().status(), 200);
    app.accept("/v1/analyses", body).await;
    app.assert_sound().await;
}

#[tokio::test]
async fn sessions_count_against_the_rate_of_their_owner() {
    let app = TestApp::start(&["--auth", "required", "--rate", "5"]).await;
    let token = app.token(Scope::Read, 1).await;
    let mut n_begun = 0;
    for _ in 0..60 {
        let sent = app.post("/v1/session").json(&json!({"token": token}));
        let answer = sent.send().await.unwrap();
        if answer.status() == StatusCode::CREATED {
            n_begun += 1;
        } else {
            assert!(answer.headers().contains_key("retry-after"));
            assert_eq!(code_of(answer, 429).await, "rate_limited");
        }
    }
    assert!((20..50).contains(&n_begun), "{n_begun}");
    app.assert_sound().await;
}
