//! Idempotency-Key: a repeated request has one effect and gets the first response again.

use flockreel::jobs::clock::now_ms;
use flockreel::jobs::supervisor::recover;
use flockreel::jobs::{IdSequence, analysis};
use flockreel::store::idempotency::{Begun, Scope};
use flockreel::store::owners::{Account, Owner};
use flockreel::store::tokens::{NewToken, Scope as TokenScope};
use flockreel_core::ids::FootageId;
use reqwest::{Response, StatusCode};
use serde_json::{Value, json};

use crate::common::TestApp;
use crate::common::app::{code_of, json_of};
use crate::common::clip::TINY;

async fn analyze(app: &TestApp, body: &Value) -> Response {
    let request = app.post("/v1/analyses").header("idempotency-key", "k-1");
    request.json(body).send().await.unwrap()
}

fn scope() -> Scope {
    Scope {
        caller: Owner::local().0,
        route: "/v1/analyses".into(),
        key: "k-1".into(),
    }
}

async fn n_jobs(app: &TestApp) -> usize {
    app.json("/v1/jobs").await["items"]
        .as_array()
        .unwrap()
        .len()
}

#[tokio::test]
async fn repeated_request_gets_the_stored_response_and_another_body_422() {
    let app = TestApp::idle().await;
    let body = json!({"footage_id": app.upload(&TINY).await});
    let first = analyze(&app, &body).await;
    let location = first.headers()["location"].clone();
    assert!(!first.headers().contains_key("idempotent-replayed"));
    let first = json_of(first, StatusCode::ACCEPTED).await;
    let again = analyze(&app, &body).await;
    assert_eq!(again.headers()["idempotent-replayed"], "true");
    assert_eq!(again.headers()["location"], location);
    assert_eq!(json_of(again, StatusCode::ACCEPTED).await, first);
    let other = json!({"footage_id": body["footage_id"], "params": {"threshold": 30}});
    let other = analyze(&app, &other).await;
    assert_eq!(code_of(other, 422).await, "idempotency_key_reused");
    let unkeyed = app.accept("/v1/analyses", body).await;
    assert_ne!(unkeyed["job_id"], first["job_id"]);
    assert_eq!(n_jobs(&app).await, 2);
    app.assert_sound().await;
}

#[tokio::test]
async fn refusals_and_uploads_are_replayed() {
    let app = TestApp::idle().await;
    for _ in 0..2 {
        let refused = analyze(&app, &json!({"footage_id": uuid::Uuid::nil()})).await;
        assert_eq!(code_of(refused, 422).await, "invalid_params");
    }
    let upload = async |film: &[u8]| {
        let request = app.post("/v1/footage").header("idempotency-key", "k-2");
        request.body(film.to_vec()).send().await.unwrap()
    };
    let first = json_of(upload(&TINY).await, StatusCode::CREATED).await;
    let again = upload(&TINY).await;
    assert_eq!(again.headers()["idempotent-replayed"], "true");
    assert_eq!(json_of(again, StatusCode::CREATED).await, first);
    let other = upload(&TINY[1..]).await;
    assert_eq!(code_of(other, 422).await, "idempotency_key_reused");
    app.assert_sound().await;
}

#[tokio::test]
async fn request_with_a_key_in_use_gets_409() {
    let app = TestApp::idle().await;
    let body = json!({"footage_id": app.upload(&TINY).await});
    let held = app.context.store.begin_key(&scope(), None, now_ms()).await;
    assert!(matches!(held.unwrap(), Begun::Run(_)));
    let second = analyze(&app, &body).await;
    assert!(second.headers().contains_key("retry-after"));
    assert_eq!(code_of(second, 409).await, "request_in_progress");
    assert_eq!(n_jobs(&app).await, 0);
    app.assert_sound().await;
}

/// Simulates a crash two hours ago, after the job was queued and before its response was stored. Then
/// recovers as at a start, and returns the expected response.
async fn crashed_between(app: &TestApp, footage: &str) -> Value {
    let then_ms = now_ms() - 2 * 3600 * 1000;
    let begun = app.context.store.begin_key(&scope(), None, then_ms).await;
    let Begun::Run(base_id) = begun.unwrap() else {
        panic!("nobody had this key");
    };
    let input = analysis::Input {
        footage_id: FootageId(footage.parse().unwrap()),
        params: flockreel_core::analysis::Params::default(),
    };
    let account = Account::local();
    let mut ids = IdSequence::derived_from(base_id);
    let queued = app.context.enqueue(&input, None, &account, &mut ids);
    let (job_id, library_id) = queued.await.unwrap();
    recover(&app.context).await.unwrap();
    json!({"job_id": job_id, "library_id": library_id, "footage_id": footage})
}

#[tokio::test]
async fn crash_before_the_response_makes_no_second_job() {
    let app = TestApp::idle().await;
    let footage = app.upload(&TINY).await;
    let made = crashed_between(&app, &footage).await;
    for _ in 0..2 {
        let again = analyze(&app, &json!({"footage_id": footage})).await;
        assert_eq!(json_of(again, StatusCode::ACCEPTED).await, made);
    }
    assert_eq!(n_jobs(&app).await, 1);
    app.assert_sound().await;
}

#[tokio::test]
async fn key_from_before_a_crash_refuses_another_body() {
    let app = TestApp::idle().await;
    let footage = app.upload(&TINY).await;
    crashed_between(&app, &footage).await;
    let other = json!({"footage_id": footage, "params": {"threshold": 30}});
    let other = analyze(&app, &other).await;
    assert_eq!(code_of(other, 422).await, "idempotency_key_reused");
    assert_eq!(n_jobs(&app).await, 1);
    app.assert_sound().await;
}

#[tokio::test]
async fn key_belongs_to_the_owner_not_to_the_token() {
    let mut app = TestApp::start(&["--auth", "required"]).await;
    let first = app.token(TokenScope::Write, 9).await;
    let owner = Owner(first.split('_').nth(1).unwrap().to_owned());
    let second = NewToken {
        name: "another".to_owned(),
        owner: Some(owner),
        scope: TokenScope::Write,
        quota: 9,
        expires_ms: None,
    };
    let second = app
        .context
        .store
        .add_token(&second, now_ms())
        .await
        .unwrap()
        .1;
    app.sign_in(&first);
    let body = json!({"footage_id": app.upload(&TINY).await});
    let made = json_of(analyze(&app, &body).await, StatusCode::ACCEPTED).await;
    app.sign_in(&second);
    let again = analyze(&app, &body).await;
    assert_eq!(again.headers()["idempotent-replayed"], "true");
    assert_eq!(json_of(again, StatusCode::ACCEPTED).await, made);
    let stranger = app.token(TokenScope::Write, 9).await;
    app.sign_in(&stranger);
    assert_eq!(
        code_of(analyze(&app, &body).await, 422).await,
        "invalid_params"
    );
    app.assert_sound().await;
}

#[tokio::test]
async fn creating_an_upload_is_idempotent() {
    let app = TestApp::idle().await;
    let begin = async |size_bytes: usize| {
        let request = app.post("/v1/uploads").header("idempotency-key", "k-3");
        let request = request.header("tus-resumable", "1.0.0");
        request
            .header("upload-length", size_bytes)
            .send()
            .await
            .unwrap()
    };
    let first = begin(9).await;
    assert_eq!(first.status(), StatusCode::CREATED);
    let again = begin(9).await;
    assert_eq!(again.headers()["idempotent-replayed"], "true");
    for name in ["location", "upload-offset", "upload-expires"] {
        assert_eq!(again.headers()[name], first.headers()[name], "{name}");
    }
    assert_eq!(
        code_of(begin(10).await, 422).await,
        "idempotency_key_reused"
    );
    assert_eq!(app.n_uploads().await, 1);
    app.assert_sound().await;
}
