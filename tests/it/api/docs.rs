//! The documentation pages. Every error code is explained at the URL that its problem documents name. The
//! API description loads only files of the service. `tests/page` tests both in a browser.

use flockreel_core::code::Code;
use serde_json::Value;

use crate::common::TestApp;

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
