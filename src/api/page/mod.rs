//! The web page: the files of `static/` and the vendored libraries, embedded in the program. A debug build
//! reads them from disk. The ETag of a file is the hash of its content.

mod asset; // files in memory
pub(super) mod docs; // /docs, /docs/errors
pub(super) mod errors; // /v1/errors
pub(super) mod examples; // tags and examples of the OpenAPI document
pub(super) mod openapi; // /openapi.json

use axum::Router;
use axum::body::Body;
use axum::http::{HeaderMap, Method, Response, StatusCode, header};
use axum::response::IntoResponse;
use axum::routing::get;
use rust_embed::RustEmbed;

use asset::Asset;

use crate::api::download::matches;
use crate::api::extract::FileName;
use crate::api::{AppState, Problem};

#[derive(RustEmbed)]
#[folder = "static/"]
struct Static;

/// Third-party libraries of the page, written by `make vendor`. The page also works without them.
#[derive(RustEmbed)]
#[folder = "target/vendor/"]
#[allow_missing = true]
struct Vendor;

/// Addresses of the places of the page. The page itself shows the place of its address.
pub(in crate::api) const PLACES: [&str; 11] = [
    "/",
    "/films",
    "/films/{id}",
    "/libraries/{id}",
    "/libraries/{id}/studio",
    "/libraries/{id}/fish",
    "/studio",
    "/flocks",
    "/flocks/{id}",
    "/jobs",
    "/s/{link}",
];

/// Returns the routes of the places, `/static/` and `/vendor/`.
pub(super) fn routes() -> Router<AppState> {
    let page = |headers: HeaderMap| async move { answer::<Static>("index.html", &headers) };
    let places = PLACES.into_iter();
    places
        .fold(Router::new(), |routes, place| {
            routes.route(place, get(page))
        })
        .route("/static/{*path}", get(get_file::<Static>))
        .route("/vendor/{*path}", get(get_file::<Vendor>))
}

/// Answers requests for an address that nothing has. A browser gets the page, which says so and shows the way
/// back; other clients get the problem.
pub(super) async fn get_missing(method: Method, headers: HeaderMap) -> Response<Body> {
    let accepted = headers.get(header::ACCEPT);
    let accepted = accepted.and_then(|accepted| accepted.to_str().ok());
    let is_browser = accepted.is_some_and(|accepted| accepted.contains("text/html"));
    let is_read = matches!(method, Method::GET | Method::HEAD);
    let vary = (header::VARY, "accept");
    if !is_read || !is_browser {
        return ([vary], Problem::not_found()).into_response();
    }
    let page = Static::get("index.html").map(|file| Asset::of("index.html", file).bytes.clone());
    let headers = [(header::CONTENT_TYPE, media_type("index.html")), vary];
    (StatusCode::NOT_FOUND, headers, page.unwrap_or_default()).into_response()
}

async fn get_file<Files: RustEmbed>(
    FileName(path): FileName,
    headers: HeaderMap,
) -> Result<Response<Body>, Problem> {
    answer::<Files>(&path, &headers)
}

fn answer<Files: RustEmbed>(path: &str, headers: &HeaderMap) -> Result<Response<Body>, Problem> {
    let file = Files::get(path).ok_or_else(Problem::not_found)?;
    Ok(Asset::of(path, file).answer(headers))
}

/// Returns a response with its ETag, or 304 if the client already has this version.
pub(super) fn tagged(
    headers: &HeaderMap,
    etag: &str,
    answer: impl FnOnce() -> Response<Body>,
) -> Response<Body> {
    let known = headers.get(header::IF_NONE_MATCH);
    let known = known.and_then(|tags| tags.to_str().ok());
    let is_known = known.is_some_and(|tags| matches(tags, etag));
    let tags = [
        (header::ETAG, etag.to_owned()),
        (header::CACHE_CONTROL, "no-cache".to_owned()),
    ];
    if is_known {
        return (StatusCode::NOT_MODIFIED, tags).into_response();
    }
    (tags, answer()).into_response()
}

pub(super) fn media_type(path: &str) -> &'static str {
    match path.rsplit('.').next().unwrap_or_default() {
        "html" => "text/html; charset=utf-8",
        "css" => "text/css; charset=utf-8",
        "js" => "text/javascript; charset=utf-8",
        "json" => "application/json",
        "svg" => "image/svg+xml",
        "png" => "image/png",
        "woff2" => "font/woff2",
        _ => "application/octet-stream",
    }
}
