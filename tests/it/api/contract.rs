//! Properties of every route: problem documents, security headers, cross-site requests, and the OpenAPI
//! document.

use reqwest::Method;
use serde_json::json;
use uuid::Uuid;

use crate::common::TestApp;
use crate::common::app::{code_of, routes};
use crate::common::clip::TINY;

#[tokio::test]
async fn unknown_paths_and_ids_give_not_found() {
    let app = TestApp::idle().await;
    let id = Uuid::now_v7();
    for path in [
        "/nowhere".to_owned(),
        "/v1/jobs/not-an-id".to_owned(),
        format!("/v1/jobs/{id}"),
        format!("/v1/jobs/{id}/events"),
        format!("/v1/footage/{id}"),
        format!("/v1/footage/{id}/file"),
        format!("/v1/libraries/{id}"),
        format!("/v1/libraries/{id}/poses.json"),
        format!("/v1/flocks/{id}"),
        format!("/v1/flocks/{id}/video.mp4"),
        format!("/v1/flocks/{id}/..%2f..%2flock"),
        "/static/..%2fCargo.toml".to_owned(),
        "/static/%ff".to_owned(),
        "/docs/%ff".to_owned(),
    ] {
        let answer = app.get(&path).send().await.unwrap();
        assert_eq!(code_of(answer, 404).await, "not_found", "{path}");
    }
    let visit = app.get("/nowhere").header("accept", "text/html,*/*;q=0.8");
    let page = visit.send().await.unwrap();
    assert_eq!(page.status(), 404);
    assert_eq!(page.headers()["content-type"], "text/html; charset=utf-8");
    assert!(page.text().await.unwrap().contains("js/main.js"));
    let answer = app.delete("/v1/footage").send().await.unwrap();
    assert_eq!(code_of(answer, 405).await, "method_not_allowed");
    app.assert_sound().await;
}

#[tokio::test]
async fn invalid_bodies_give_the_code_of_their_fault() {
    let app = TestApp::idle().await;
    let (id, path) = (Uuid::now_v7(), "/v1/analyses");
    for (body, status, code) in [
        ("{", 400, "malformed_request"),
        ("[]", 422, "invalid_params"),
        ("{}", 422, "invalid_params"),
        (r#"{"footage_id": 7}"#, 422, "invalid_params"),
    ] {
        let answer = app.post(path).header("content-type", "application/json");
        let answer = answer.body(body).send().await.unwrap();
        assert_eq!(code_of(answer, status).await, code, "{body}");
    }
    for params in [
        json!({"colour": 1}),
        json!({"threshold": 0}),
        json!({"preset": "p"}),
        json!({}),
    ] {
        let body = json!({"footage_id": id, "params": params});
        let answer = app.post(path).json(&body).send().await.unwrap();
        assert_eq!(code_of(answer, 422).await, "invalid_params", "{params}");
    }
    for path in ["/v1/footage?name=a&name=b", "/v1/analyses?name=a&name=b"] {
        let request = app
            .post(path)
            .header("content-type", "application/octet-stream");
        let answer = request.body("film").send().await.unwrap();
        assert_eq!(code_of(answer, 422).await, "invalid_params", "{path}");
    }
    let answer = app.post(path).body("{}").send().await.unwrap();
    assert_eq!(code_of(answer, 415).await, "unsupported_media_type");
    let large = format!("{{\"footage_id\": \"{}\"}}", "x".repeat(2 << 20));
    let answer = app.post(path).header("content-type", "application/json");
    let answer = answer.body(large).send().await.unwrap();
    assert_eq!(code_of(answer, 413).await, "too_large");
    app.assert_sound().await;
}

#[tokio::test]
async fn every_response_has_security_headers() {
    let app = TestApp::idle().await;
    let id = app.upload(&TINY).await;
    let mut asked: Vec<(Method, String)> = [
        "/",
        "/docs",
        "/docs/errors",
        "/docs/swagger-ui.css",
        "/static/js/main.js",
        "/nowhere",
        "/openapi.json",
    ]
    .map(|path| (Method::GET, path.to_owned()))
    .into();
    for (method, path) in routes(&app.json("/openapi.json").await) {
        asked.push((method, path.replace("{id}", &id)));
    }
    assert!(asked.len() > 20, "the document names few routes");
    // Request deletions last, so that the other requests still find their data.
    asked.sort_by_key(|(method, _)| *method == Method::DELETE);
    for (method, path) in asked {
        let answer = app.request(method, &path).send().await.unwrap();
        let header = |name: &str| answer.headers()[name].to_str().unwrap().to_owned();
        assert_eq!(header("x-content-type-options"), "nosniff", "{path}");
        assert_eq!(header("referrer-policy"), "no-referrer", "{path}");
        assert_eq!(
            header("cross-origin-opener-policy"),
            "same-origin",
            "{path}"
        );
        assert_eq!(header("x-frame-options"), "DENY", "{path}");
        let policy = header("content-security-policy");
        assert!(policy.contains("default-src 'none'") && policy.contains("frame-ancestors 'none'"));
        assert!(!policy.contains("unsafe"));
        if path.starts_with("/v1/footage/") && path.ends_with("/file") {
            assert_eq!(answer.status(), 200);
            assert!(header("content-disposition").starts_with("attachment;"));
            assert_eq!(header("content-type"), "application/octet-stream");
        }
    }
    app.assert_sound().await;
}

#[tokio::test]
async fn cross_site_requests_and_foreign_host_names_are_refused() {
    let app = TestApp::idle().await;
    for (name, value) in [
        ("origin", "https://evil.example"),
        ("sec-fetch-site", "cross-site"),
    ] {
        let answer = app
            .post("/v1/footage")
            .header(name, value)
            .send()
            .await
            .unwrap();
        assert_eq!(code_of(answer, 403).await, "cross_site");
    }
    let rebound = app
        .get("/v1/jobs")
        .header("host", "evil.example")
        .send()
        .await
        .unwrap();
    assert_eq!(code_of(rebound, 403).await, "cross_site");
    app.assert_sound().await;
}

#[tokio::test]
async fn stopping_service_refuses_writes_and_answers_reads() {
    let app = TestApp::idle().await;
    app.context.draining.cancel();
    let answer = app.post("/v1/footage").send().await.unwrap();
    assert_eq!(answer.headers()["retry-after"], "5");
    assert_eq!(code_of(answer, 503).await, "stopping");
    assert_eq!(app.get("/v1/jobs").send().await.unwrap().status(), 200);
    assert_eq!(app.get("/readyz").send().await.unwrap().status(), 503);
    app.assert_sound().await;
}

#[tokio::test]
async fn document_lists_the_main_operations() {
    let app = TestApp::idle().await;
    let document = app.json("/openapi.json").await;
    assert_eq!(document["openapi"], "3.1.0");
    for (method, path) in [
        (Method::POST, "/v1/footage"),
        (Method::POST, "/v1/analyses"),
        (Method::GET, "/v1/libraries/{id}/{file}"),
        (Method::POST, "/v1/flocks"),
        (Method::DELETE, "/v1/jobs/{id}"),
    ] {
        let entry = &document["paths"][path][method.as_str().to_lowercase()];
        assert!(entry.is_object(), "{method} {path}");
    }
    app.assert_sound().await;
}

#[tokio::test]
async fn schemas_have_unique_names_and_joined_fields() {
    let app = TestApp::idle().await;
    let schemas = app.json("/openapi.json").await["components"]["schemas"].clone();
    for (name, field) in [
        ("AnalysisParams", "clip_frames"),
        ("FlockParams", "count"),
        ("FishParams", "palette"),
        ("LibrarySummary", "n_transitions"),
        ("FlockSummary", "seed"),
        ("FishSummary", "visible_frames"),
    ] {
        assert!(schemas[name]["properties"][field].is_object(), "{name}");
    }
    assert!(schemas["Params"].is_null() && schemas["Summary"].is_null());
    // `allOf` cannot combine closed schemas, because each would reject the other's fields.
    for (name, field) in [("FlockRequest", "count"), ("FishRequest", "palette")] {
        let request = &schemas[name];
        assert_eq!(request["additionalProperties"], false, "{name}");
        assert_eq!(request["required"], json!(["library_id"]), "{name}");
        for field in [field, "library_id", "preset"] {
            assert!(request["properties"][field].is_object(), "{name} {field}");
        }
    }
    // Requests may name a preset. The stored parameters are complete and name none.
    for (name, field) in [
        ("AnalysisOverrides", "clip_frames"),
        ("FlockOverrides", "count"),
    ] {
        let overrides = &schemas[name];
        assert_eq!(overrides["additionalProperties"], false, "{name}");
        assert!(overrides["required"].is_null(), "{overrides}");
        for field in [field, "preset"] {
            assert!(overrides["properties"][field].is_object(), "{name} {field}");
        }
    }
    let overrides = "#/components/schemas/AnalysisOverrides";
    assert_eq!(
        schemas["AnalysisRequest"]["properties"]["params"]["$ref"],
        overrides
    );
    assert!(schemas["AnalysisParams"]["properties"]["preset"].is_null());
    app.assert_sound().await;
}
