//! The documentation pages. Every error code is explained at the URL that its problem documents name. The
//! API description loads only files of the service. `tests/page` tests both in a browser.

use flockreel_core::code::Code;
use reqwest::Method;
use serde_json::{Value, json};

use crate::common::TestApp;
use crate::common::app::{code_of, routes};
use crate::common::clip::{SWIM, TINY};
use crate::common::results::store_film;

#[tokio::test]
async fn every_code_has_an_entry_at_its_type_url() {
    let app = TestApp::idle().await;
    let problem: Value = app
        .get("/v1/nowhere")
        .send()
        .await
        .unwrap()
        .json()
        .await
        .unwrap();
    let (page, anchor) = problem["type"].as_str().unwrap().split_once('#').unwrap();
    assert_eq!(anchor, "not_found");
    let page = app.get(page).send().await.unwrap();
    assert_eq!(page.headers()["content-type"], "text/html; charset=utf-8");
    let page = page
        .text()
        .await
        .unwrap()
        .replace("<code>", "`")
        .replace("</code>", "`");
    let page = page.replace("&lt;", "<").replace("&amp;", "&");
    assert_eq!(page.matches("<dt id=").count(), Code::ALL.len());
    for &code in Code::ALL {
        let (_, entry) = page.split_once(&format!("<dt id=\"{code}\">")).unwrap();
        let entry = entry.split("<dt ").next().unwrap();
        assert!(
            entry.contains(code.meaning()) && entry.contains(code.advice()),
            "{entry}"
        );
        assert!(
            code.meaning().ends_with('.') && code.advice().ends_with('.'),
            "{code}"
        );
    }
    let (_, stopping) = page.split_once("<dt id=\"stopping\">").unwrap();
    assert!(
        stopping
            .split("</dt>")
            .next()
            .unwrap()
            .contains("503 Service Unavailable")
    );
    app.assert_sound().await;
}

#[tokio::test]
async fn api_description_uses_only_cacheable_files_of_the_service() {
    let app = TestApp::start(&["--auth", "required"]).await;
    let page = app.get("/docs").send().await.unwrap().text().await.unwrap();
    for (file, media_type) in [
        ("/docs/swagger-ui.css", "text/css; charset=utf-8"),
        (
            "/docs/swagger-ui-bundle.js",
            "text/javascript; charset=utf-8",
        ),
        ("/static/js/docs.js", "text/javascript; charset=utf-8"),
    ] {
        assert!(page.contains(&format!("\"{file}\"")), "{file}");
        let answer = app.get(file).send().await.unwrap();
        assert_eq!(answer.headers()["content-type"], media_type, "{file}");
        let tag = answer.headers()["etag"].clone();
        let again = app.get(file).header("if-none-match", tag).send().await;
        assert_eq!(again.unwrap().status(), 304, "{file}");
    }
    assert_eq!(
        app.get("/docs/index.html").send().await.unwrap().status(),
        404
    );
    app.assert_sound().await;
}

#[tokio::test]
async fn error_codes_are_listed_for_programs() {
    let app = TestApp::start(&["--auth", "required"]).await;
    let listed = app.json("/v1/errors").await;
    let listed = listed.as_array().unwrap();
    assert_eq!(listed.len(), Code::ALL.len());
    for (entry, &code) in listed.iter().zip(Code::ALL) {
        assert_eq!(entry["code"], code.name());
        assert_eq!(entry["title"], code.meaning());
        assert_eq!(entry["advice"], code.advice());
    }
    let status =
        |code| listed.iter().find(|entry| entry["code"] == code).unwrap()["status"].clone();
    assert_eq!(
        (status("too_large"), status("checksum_mismatch")),
        (json!(413), json!(460))
    );
    app.assert_sound().await;
}

/// Returns method, path and example of every operation whose JSON body has one.
fn examples(document: &Value) -> Vec<(Method, String, Value)> {
    let of = |(method, path): (Method, String)| {
        let operation = &document["paths"][&path][method.as_str().to_lowercase()];
        let example = &operation["requestBody"]["content"]["application/json"]["example"];
        (!example.is_null()).then(|| (method, path, example.clone()))
    };
    routes(document).into_iter().filter_map(of).collect()
}

#[tokio::test(flavor = "multi_thread")]
async fn every_example_of_the_document_works_with_the_sample() {
    let app = TestApp::working().await;
    let refused = app
        .post("/v1/flocks")
        .json(&json!({"library_id": "sample"}));
    assert_eq!(
        code_of(refused.send().await.unwrap(), 422).await,
        "invalid_params"
    );
    let [footage, library, flock] = with_sample(&app).await;
    let examples = examples(&app.json("/openapi.json").await);
    assert_eq!(examples.len(), 11);
    for (method, path, example) in examples {
        let id = match path.split('/').nth(2) {
            Some("footage") => &footage,
            Some("libraries") => &library,
            _ => &flock,
        };
        let request = app
            .request(method, &path.replace("{id}", id))
            .json(&example);
        let answer = request.send().await.unwrap();
        let status = answer.status();
        assert!(
            status.is_success(),
            "{path}: {}",
            answer.text().await.unwrap()
        );
        if status == 202 {
            let accepted: Value = answer.json().await.unwrap();
            assert_eq!(
                app.ended_job(&accepted["job_id"]).await["state"],
                "done",
                "{path}"
            );
        }
    }
    app.assert_sound().await;
}

/// Stores and measures a sample and makes a flock. Returns the ids of footage, library and flock.
async fn with_sample(app: &TestApp) -> [String; 3] {
    app.upload(&TINY).await;
    let footage = store_film(app, &SWIM, true).await;
    let body = json!({"footage_id": "sample"});
    let analysis = app.accept("/v1/analyses", body).await;
    assert_eq!(analysis["footage_id"], footage);
    app.ended_job(&analysis["job_id"]).await;
    let body = json!({"library_id": "sample", "frames": 10, "count": 2});
    let flock = app.accept("/v1/flocks", body).await;
    assert_eq!(flock["library_id"], analysis["library_id"]);
    app.ended_job(&flock["job_id"]).await;
    let id = |name: &str| flock[name].as_str().unwrap().to_owned();
    [footage, id("library_id"), id("flock_id")]
}

#[tokio::test]
async fn every_operation_has_one_tag_of_the_document() {
    let app = TestApp::idle().await;
    let document = app.json("/openapi.json").await;
    let tags: Vec<&Value> = document["tags"]
        .as_array()
        .unwrap()
        .iter()
        .map(|tag| &tag["name"])
        .collect();
    for (method, path) in routes(&document) {
        let used = &document["paths"][&path][method.as_str().to_lowercase()]["tags"];
        assert!(
            used.as_array().unwrap().len() == 1 && tags.contains(&&used[0]),
            "{path}: {used}"
        );
    }
    app.assert_sound().await;
}
