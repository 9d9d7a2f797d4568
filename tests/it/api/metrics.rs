//! Monitoring: the metrics, the access to them, and the request id in every response.

use flockreel::jobs::worker::{Step, Worker};
use flockreel::store::tokens::Scope;
use serde_json::{Value, json};

use crate::common::TestApp;
use crate::common::app::code_of;
use crate::common::clip::TINY;

/// Returns the value of the metric line that begins with `start`.
fn value(text: &str, start: &str) -> f64 {
    let mut lines = text.lines();
    let value = lines.find_map(|line| line.strip_prefix(start)?.trim().parse().ok());
    value.unwrap_or_else(|| panic!("{start} is not in\n{text}"))
}

async fn metrics(app: &TestApp) -> String {
    let answer = app.get("/metrics").send().await.unwrap();
    assert_eq!(answer.status(), 200);
    let media_type = answer.headers()["content-type"].to_str().unwrap();
    assert!(
        media_type.starts_with("application/openmetrics-text"),
        "{media_type}"
    );
    answer.text().await.unwrap()
}

#[tokio::test]
async fn metrics_cover_the_queue_the_store_requests_and_ended_jobs() {
    let app = TestApp::idle().await;
    let footage = app.upload(&TINY).await;
    for _ in 0..2 {
        app.accept("/v1/analyses", json!({"footage_id": footage}))
            .await;
    }
    let worker = Worker::new(app.context.clone());
    assert!(matches!(worker.step().await.unwrap(), Step::Failed(..)));
    let answer = app.get(&format!("/v1/footage/{footage}")).send().await;
    let described: Value = answer.unwrap().json().await.unwrap();
    let footage_bytes = described["size_bytes"].as_f64().unwrap();
    assert!(footage_bytes > TINY.len() as f64, "with the poster");
    app.get("/v1/footage/no-id").send().await.unwrap();
    app.get(&format!("/nowhere/{footage}"))
        .send()
        .await
        .unwrap();
    let text = metrics(&app).await;
    for (start, wanted) in [
        ("flockreel_jobs{kind=\"analysis\",state=\"queued\"}", 1.0),
        ("flockreel_jobs{kind=\"analysis\",state=\"failed\"}", 1.0),
        ("flockreel_jobs{kind=\"fish\",state=\"running\"}", 0.0),
        ("flockreel_stored_bytes{noun=\"footage\"}", footage_bytes),
        (
            "flockreel_http_requests_total{route=\"/v1/footage/{id}\",method=\"GET\",status=\"200\"}",
            1.0,
        ),
        (
            "flockreel_http_requests_total{route=\"/v1/footage/{id}\",method=\"GET\",status=\"404\"}",
            1.0,
        ),
        (
            "flockreel_http_requests_total{route=\"unmatched\",method=\"GET\",status=\"404\"}",
            1.0,
        ),
        (
            "flockreel_http_request_seconds_count{route=\"/v1/analyses\"}",
            2.0,
        ),
        ("flockreel_http_requests_under_way", 1.0),
        ("flockreel_decoded_frames_total", 10.0),
        ("flockreel_decode_frames_per_second_count", 1.0),
        (
            "flockreel_job_stage_seconds_count{kind=\"analysis\",stage=\"background\"}",
            1.0,
        ),
    ] {
        assert_eq!(value(&text, start), wanted, "{start}");
    }
    assert!(!text.contains(&footage), "an id is no label");
    assert!(text.ends_with("# EOF\n"));
    app.assert_sound().await;
}

#[tokio::test]
async fn metrics_need_an_admin_token_if_tokens_are_required() {
    let mut app = TestApp::start(&["--auth", "required"]).await;
    let (writer, admin) = (
        app.token(Scope::Write, 1).await,
        app.token(Scope::Admin, 1).await,
    );
    let answer = app.get("/metrics").send().await.unwrap();
    assert_eq!(code_of(answer, 401).await, "unauthenticated");
    app.sign_in(&writer);
    let answer = app.get("/metrics").send().await.unwrap();
    assert_eq!(code_of(answer, 403).await, "scope_too_small");
    app.sign_in(&admin);
    metrics(&app).await;
    app.assert_sound().await;
}

#[tokio::test]
async fn every_response_has_a_request_id() {
    let app = TestApp::idle().await;
    let ask = async |id: &str| {
        let answer = app
            .get("/nowhere")
            .header("x-request-id", id)
            .send()
            .await
            .unwrap();
        answer.headers()["x-request-id"]
            .to_str()
            .unwrap()
            .to_owned()
    };
    assert_eq!(ask("lab-7.1").await, "lab-7.1");
    let (first, second) = (ask("two words").await, ask("two words").await);
    assert!(first != second && first.len() == 36, "{first} {second}");
    app.assert_sound().await;
}
