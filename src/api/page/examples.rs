//! Tags and examples of the OpenAPI document. `/docs` sorts the operations by tag, and its requests begin with
//! the example of their body. Each example works as it is on a service that has its sample.

use serde_json::{Value, json};
use utoipa::openapi::path::{HttpMethod, Operation, PathItem};
use utoipa::openapi::tag::Tag;
use utoipa::openapi::{OpenApi, RefOr};

/// Parts of the API in the order of a first use: name, and what it is.
const TAGS: [(&str, &str); 10] = [
    ("footage", "Uploaded videos."),
    ("uploads", "Resumable uploads of footage (tus 1.0.0)."),
    ("analyses", "Measurements of footage, which make libraries."),
    (
        "libraries",
        "The measured animal: poses, sprites and jumps.",
    ),
    (
        "flocks",
        "Flocks made of a library, their previews and their links.",
    ),
    ("fish", "Virtual fish that move as the animal did."),
    (
        "datasets",
        "Labelled pictures of many flocks, for training.",
    ),
    ("jobs", "Queued work, its progress and its failures."),
    ("session", "Signing in of browsers."),
    ("service", "Used space, error codes, health and metrics."),
];

/// Adds a tag to every operation, and an example to every JSON body that needs no secret.
pub(in crate::api) fn add(document: &mut OpenApi) {
    let tags = TAGS.into_iter().map(|(name, meaning)| {
        let mut tag = Tag::new(name);
        tag.description = Some(meaning.to_owned());
        tag
    });
    document.tags = Some(tags.collect());
    for (path, item) in &mut document.paths.paths {
        let tag = tag_of(path);
        for operation in operations(item) {
            operation.tags = Some(vec![tag.to_owned()]);
        }
        if let Some((method, example)) = example(path) {
            let operation = match method {
                HttpMethod::Patch => item.patch.as_mut(),
                _ => item.post.as_mut(),
            };
            if let Some(operation) = operation {
                set_example(operation, example);
            }
        }
    }
}

/// Returns the tag of a path.
fn tag_of(path: &str) -> &'static str {
    let noun = path.strip_prefix("/v1/").unwrap_or(path);
    let noun = noun.split('/').next().unwrap_or_default();
    let mut known = TAGS.iter().map(|(name, _)| *name);
    match noun {
        "events" => "jobs",
        _ => known.find(|name| *name == noun).unwrap_or("service"),
    }
}

/// Returns the method and the example of the body of a path.
fn example(path: &str) -> Option<(HttpMethod, Value)> {
    let post = |example| Some((HttpMethod::Post, example));
    match path {
        "/v1/analyses" => post(json!({"footage_id": "sample", "params": {"to_s": 10}})),
        "/v1/flocks" | "/v1/flocks/preview" => post(json!({
            "library_id": "sample", "count": 20, "frames": 120, "seed": 1,
        })),
        "/v1/fish" => post(json!({"library_id": "sample"})),
        "/v1/datasets" | "/v1/datasets/estimate" | "/v1/datasets/preview" => post(json!({
            "library_ids": ["sample"], "flocks": 4, "pictures": 20, "count": [2, 10],
        })),
        "/v1/flocks/{id}/links" => post(json!({"file": "video.mp4", "expires_s": 3600})),
        "/v1/footage/{id}" => Some((HttpMethod::Patch, json!({"name": "zebra finch.mp4"}))),
        "/v1/libraries/{id}" => Some((HttpMethod::Patch, json!({"px_per_cm": 42}))),
        "/v1/flocks/{id}" => Some((HttpMethod::Patch, json!({"pinned": true}))),
        _ => None,
    }
}

fn set_example(operation: &mut Operation, example: Value) {
    let body = operation.request_body.as_mut();
    if let Some(RefOr::T(body)) = body
        && let Some(RefOr::T(content)) = body.content.get_mut("application/json")
    {
        content.example = Some(example);
    }
}

fn operations(item: &mut PathItem) -> impl Iterator<Item = &mut Operation> {
    let all = [
        &mut item.get,
        &mut item.head,
        &mut item.post,
        &mut item.patch,
        &mut item.delete,
        &mut item.options,
    ];
    all.into_iter().filter_map(|operation| operation.as_mut())
}
