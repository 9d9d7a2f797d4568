//! Lists with filters, the files of results, and new names of footage.

use reqwest::{Method, StatusCode};
use serde_json::{Value, json};

use crate::common::TestApp;
use crate::common::app::{code_of, json_of};
use crate::common::clip::SWIM;
use crate::common::results::{Results, id_in};

/// Returns the ids of a list.
async fn ids(app: &TestApp, path: &str) -> Vec<String> {
    let list = app.json(path).await;
    let items = list["items"].as_array().unwrap().iter();
    items
        .map(|item| item["id"].as_str().unwrap().to_owned())
        .collect()
}

#[tokio::test]
async fn lists_are_filtered_by_source_and_name() {
    let app = TestApp::idle().await;
    let finch = Results::make(&app, "Zebra finch 100%.mp4").await;
    let mouse = Results::of_film(&app, "mouse_1.mp4", &SWIM).await;
    for (noun, of_finch, of_mouse) in [
        ("footage", &finch.footage, &mouse.footage),
        ("libraries", &finch.library, &mouse.library),
        ("flocks", &finch.flock, &mouse.flock),
        ("fish", &finch.fish, &mouse.fish),
    ] {
        let (of_finch, of_mouse) = (vec![id_in(of_finch)], vec![id_in(of_mouse)]);
        for (query, expected) in [
            ("q=ZEBRA%20F".to_owned(), &of_finch),
            ("q=0%25".to_owned(), &of_finch),
            ("q=e_1".to_owned(), &of_mouse),
            ("q=e_2".to_owned(), &Vec::new()),
            ("q=%25".to_owned(), &of_finch),
            ("q=%5C".to_owned(), &Vec::new()),
            (format!("footage_id={}", id_in(&finch.footage)), &of_finch),
            (
                format!("footage_id={}&q=mouse", id_in(&finch.footage)),
                &Vec::new(),
            ),
            (format!("library_id={}", id_in(&mouse.library)), &of_mouse),
            (format!("library_id={}", id_in(&mouse.footage)), &Vec::new()),
        ] {
            let is_known = match noun {
                "footage" => query.starts_with("q="),
                "libraries" => !query.starts_with("library_id"),
                _ => true,
            };
            let path = format!("/v1/{noun}?{query}");
            if is_known {
                assert_eq!(ids(&app, &path).await, *expected, "{path}");
            } else {
                let answer = app.get(&path).send().await.unwrap();
                assert_eq!(code_of(answer, 422).await, "invalid_params", "{path}");
            }
        }
    }
    app.assert_sound().await;
}

#[tokio::test]
async fn pages_of_a_filtered_list_follow_each_other() {
    let app = TestApp::idle().await;
    let footage = app.upload(&SWIM).await;
    let results = Results::make(&app, "finch.mp4").await;
    let first = app.json("/v1/footage?limit=1").await;
    assert_eq!(first["items"][0]["id"], id_in(&results.footage));
    let cursor = first["next_cursor"].as_str().unwrap();
    let path = format!("/v1/footage?limit=1&cursor={cursor}");
    assert_eq!(ids(&app, &path).await, [footage]);
    assert_eq!(ids(&app, &format!("{path}&q=finch")).await, [""; 0]);
    for noun in ["footage", "libraries", "flocks", "fish"] {
        for name in ["%00", "a%00b"] {
            let path = format!("/v1/{noun}?q={name}");
            let answer = app.get(&path).send().await.unwrap();
            assert_eq!(code_of(answer, 422).await, "invalid_params", "{path}");
        }
    }
    for wrong in ["limit=0", "limit=201", "footage_id=x", "nonsense=1"] {
        let answer = app
            .get(&format!("/v1/flocks?{wrong}"))
            .send()
            .await
            .unwrap();
        assert_eq!(code_of(answer, 422).await, "invalid_params", "{wrong}");
    }
    app.assert_sound().await;
}

#[tokio::test]
async fn results_tell_their_state_job_and_files() {
    let app = TestApp::idle().await;
    let results = Results::make(&app, "finch.mp4").await;
    for (path, name, media_type) in [
        (&results.library, "library.json", "application/json"),
        (&results.flock, "flock.json", "application/json"),
        (&results.fish, "video.mp4", "video/mp4"),
    ] {
        let result = app.json(path).await;
        assert_eq!(
            (&result["state"], &result["name"]),
            (&json!("done"), &json!("finch.mp4"))
        );
        assert!(result["job_id"].is_string());
        let files = result["files"].as_array().unwrap();
        let file = json!({"name": name, "media_type": media_type, "size_bytes": 2});
        assert!(files.contains(&file), "{path}: {files:?}");
        for file in files {
            let file = format!("{path}/{}", file["name"].as_str().unwrap());
            assert_eq!(app.get(&file).send().await.unwrap().status(), 200, "{file}");
        }
    }
    let list = app.json("/v1/flocks").await;
    assert_eq!(list["items"][0].get("files"), None);
    app.assert_sound().await;
}

#[tokio::test]
async fn new_name_of_footage_is_shown_by_everything_made_from_it() {
    let app = TestApp::idle().await;
    let results = Results::make(&app, "a.mp4").await;
    let rename = async |path: &str, body: Value| {
        let request = app.request(Method::PATCH, path).json(&body);
        request.send().await.unwrap()
    };
    let name = json!({"name": "../zebra\u{202e} finch.mp4"});
    let answer = rename(&results.footage, name).await;
    let footage = json_of(answer, StatusCode::OK).await;
    assert_eq!(footage["name"], "zebra finch.mp4");
    for path in [
        &results.footage,
        &results.library,
        &results.flock,
        &results.fish,
    ] {
        assert_eq!(app.json(path).await["name"], "zebra finch.mp4", "{path}");
    }
    for (file, saved) in [
        (
            format!("{}/flock.json", results.flock),
            "zebra-finch_40x240_s1.json",
        ),
        (
            format!("{}/library.json", results.library),
            "zebra-finch_library.json",
        ),
        (
            format!("{}/poses.csv", results.library),
            "zebra-finch_poses.csv",
        ),
        (
            format!("{}/video.mp4", results.fish),
            "zebra-finch_fish.mp4",
        ),
        (
            format!("{}/poster.jpg", results.footage),
            "zebra-finch_poster.jpg",
        ),
    ] {
        let answer = app.get(&file).send().await.unwrap();
        let said = answer.headers()["content-disposition"].to_str().unwrap();
        let expected = format!("inline; filename=\"{saved}\"; filename*=UTF-8''{saved}");
        assert_eq!(said, expected, "{file}");
    }
    for (body, code) in [
        (json!({}), "invalid_params"),
        (json!({"name": 1}), "invalid_params"),
        (json!({"name": null}), "invalid_params"),
        (json!({"pinned": null}), "invalid_params"),
        (json!({"name": "a", "sample": true}), "invalid_params"),
    ] {
        let answer = rename(&results.footage, body).await;
        assert_eq!(code_of(answer, 422).await, code);
    }
    let unknown = format!("/v1/footage/{}", uuid::Uuid::now_v7());
    let answer = rename(&unknown, json!({"name": "a"})).await;
    assert_eq!(code_of(answer, 404).await, "not_found");
    app.assert_sound().await;
}
