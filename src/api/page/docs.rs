//! Documentation of the API: `/docs` shows the OpenAPI document in Swagger UI, and `/docs/errors` explains
//! every error code. The `type` of every problem points to the second page (RFC 9457).
//!
//! The files of Swagger UI are embedded in the program. The pages load nothing from other sites and have no
//! inline scripts or styles (docs/explanation/promises.md, "Nothing served runs as a page").

use std::sync::{Arc, LazyLock};

use axum::Router;
use axum::body::Body;
use axum::http::{HeaderMap, Response};
use axum::response::Html;
use axum::routing::get;
use utoipa_swagger_ui::Config;

use super::asset::Asset;
use crate::api::extract::FileName;
use crate::api::problem::status_of;
use crate::api::{AppState, Problem};
use flockreel_core::code::Code;

/// Files of Swagger UI that the page loads. Its other files are not served.
const FILES: [&str; 2] = ["swagger-ui.css", "swagger-ui-bundle.js"];

static ERRORS: LazyLock<String> = LazyLock::new(errors);
static LOADED: LazyLock<Vec<(&str, Asset)>> =
    LazyLock::new(|| FILES.iter().filter_map(load).collect());

/// Returns the routes `/docs` and `/docs/errors` and those of the files that they load.
pub(in crate::api) fn routes() -> Router<AppState> {
    Router::new()
        .route("/docs", get(|| async { Html(description()) }))
        .route("/docs/errors", get(|| async { Html(ERRORS.as_str()) }))
        .route("/docs/{file}", get(get_file))
}

async fn get_file(FileName(name): FileName, headers: HeaderMap) -> Result<Response<Body>, Problem> {
    let file = LOADED.iter().find(|(known, _)| *known == name);
    let (_, file) = file.ok_or_else(Problem::not_found)?;
    Ok(file.answer(&headers))
}

fn load(name: &&'static str) -> Option<(&'static str, Asset)> {
    let file = utoipa_swagger_ui::serve(name, Arc::new(Config::default()));
    Some((name, Asset::fixed(name, file.ok()??.bytes)))
}

fn description() -> String {
    let head = "<link rel=\"stylesheet\" href=\"/docs/swagger-ui.css\">\n\
        <script defer src=\"/docs/swagger-ui-bundle.js\"></script>\n\
        <script type=\"module\" src=\"/static/js/docs.js\"></script>";
    let body = "<div class=\"docs\"><p>The same description as data: <a href=\"/openapi.json\">openapi.json</a>. \
        <a href=\"/docs/errors\">Error codes</a>. <a href=\"/\">The page</a>.</p></div>\n\
        <div class=\"api\" id=\"api\"></div>\n<noscript><p>This reference needs JavaScript.</p></noscript>";
    page("The API", head, body)
}

fn errors() -> String {
    let entries: String = Code::ALL.iter().map(|&code| entry(code)).collect();
    let body = format!(
        "<div class=\"docs\"><h1>Error codes</h1>\n<p>Every response that reports a failure is \
         <code>application/problem+json</code> (RFC 9457) with a stable <code>code</code>. The <code>error</code> of a \
         failed job has the same codes. A request for the result of a failed or cancelled job gets the code of the job \
         with status 404. A code is never renamed. <a href=\"/docs\">The API</a>.</p>\n\
         <dl>\n{entries}</dl></div>"
    );
    page("Errors", "", &body)
}

fn entry(code: Code) -> String {
    let status = status_of(code);
    // Status 460 of the tus protocol has no name in HTTP.
    let reason = status.canonical_reason().unwrap_or("Checksum Mismatch");
    format!(
        "<dt id=\"{code}\"><a href=\"#{code}\"><code>{code}</code></a> <small>{} {reason}</small></dt>\n\
         <dd>{}</dd>\n<dd class=\"soft\">{}</dd>\n",
        status.as_str(),
        marked(code.meaning()),
        marked(code.advice()),
    )
}

/// Returns text as HTML. Parts between backticks become `<code>` elements.
fn marked(text: &str) -> String {
    let text = text.replace('&', "&amp;").replace('<', "&lt;");
    let parts = text.split('`').enumerate();
    let marked = parts.map(|(idx, part)| match idx % 2 {
        0 => part.to_owned(),
        _ => format!("<code>{part}</code>"),
    });
    marked.collect()
}

fn page(title: &str, head: &str, body: &str) -> String {
    let styles: String = ["tokens", "base", "docs"]
        .map(|name| format!("<link rel=\"stylesheet\" href=\"/static/css/{name}.css\">\n"))
        .concat();
    format!(
        "<!doctype html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n\
         <meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n\
         <title>{title} · flockreel</title>\n<link rel=\"icon\" href=\"/static/icon.svg\">\n{styles}{head}\n</head>\n\
         <body><main>\n{body}\n</main></body>\n</html>\n"
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn text_is_escaped_and_code_is_marked() {
        assert_eq!(marked("a < b & `c`."), "a &lt; b &amp; <code>c</code>.");
    }

    #[test]
    fn every_status_has_a_reason() {
        for &code in Code::ALL {
            let has_name = status_of(code).canonical_reason().is_some();
            assert!(has_name || code == Code::ChecksumMismatch, "{code}");
        }
        assert!(entry(Code::ChecksumMismatch).contains("460 Checksum Mismatch"));
    }

    #[test]
    fn swagger_files_are_embedded() {
        let sizes: Vec<_> = LOADED.iter().map(|(_, file)| file.bytes.len()).collect();
        assert!(
            sizes.len() == 2 && sizes.iter().all(|&n_bytes| n_bytes > 50_000),
            "{sizes:?}"
        );
    }
}
