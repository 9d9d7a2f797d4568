//! Resources that stay: pins, and uses, which delay the deletion by age (docs/explanation/promises.md, "Limited space").

use std::time::{Duration, Instant};

use flockreel::store::resources::ResourceKind::{Fish, Flock, Footage, Library};
use reqwest::{Method, StatusCode};
use serde_json::json;

use crate::common::TestApp;
use crate::common::app::{code_of, json_of};
use crate::common::results::{Results, id_in};

/// Longest wait for a record that follows a response. Free choice.
const MAX_WAIT: Duration = Duration::from_secs(30);

#[tokio::test]
async fn resource_is_pinned_and_unpinned() {
    let app = TestApp::idle().await;
    let results = Results::make(&app, "finch.mp4").await;
    for path in [
        &results.footage,
        &results.library,
        &results.flock,
        &results.fish,
    ] {
        assert_eq!(app.json(path).await["pinned"], false);
        for pinned in [true, false, true] {
            let change = app.request(Method::PATCH, path);
            let change = change.json(&json!({"pinned": pinned})).send().await;
            let changed = json_of(change.unwrap(), StatusCode::OK).await;
            assert_eq!(changed["pinned"], pinned, "{path}");
            assert_eq!(changed["name"], "finch.mp4");
            assert_eq!(app.json(path).await["pinned"], pinned, "{path}");
        }
        let list = path.rsplit_once('/').unwrap().0;
        assert_eq!(app.json(list).await["items"][0]["pinned"], true, "{list}");
        for wrong in [json!({}), json!({"pinned": 1}), json!({"pin": true})] {
            let refused = app.request(Method::PATCH, path).json(&wrong).send().await;
            assert_eq!(code_of(refused.unwrap(), 422).await, "invalid_params");
        }
        let unknown = format!("{list}/{}", uuid::Uuid::now_v7());
        let change = app
            .request(Method::PATCH, &unknown)
            .json(&json!({"pinned": true}));
        assert_eq!(
            code_of(change.send().await.unwrap(), 404).await,
            "not_found"
        );
    }
    let both = json!({"name": "b.mp4", "pinned": false});
    let change = app.request(Method::PATCH, &results.footage).json(&both);
    let changed = json_of(change.send().await.unwrap(), StatusCode::OK).await;
    assert_eq!(
        (&changed["name"], &changed["pinned"]),
        (&json!("b.mp4"), &json!(false))
    );
    app.assert_sound().await;
}

#[tokio::test]
async fn reading_a_thing_is_recorded_as_its_use_and_seeing_it_in_a_list_is_not() {
    let app = TestApp::idle().await;
    let results = Results::make(&app, "finch.mp4").await;
    let (store, never) = (&app.context.store, "1970-01-01T00:00:00Z");
    let used_at = async |path: &str| {
        let (list, _) = path.rsplit_once('/').unwrap();
        app.json(list).await["items"][0]["used_at"].clone()
    };
    for (kind, path, seen, read) in [
        (Footage, &results.footage, "/poster.jpg", ""),
        (Footage, &results.footage, "/poster.jpg", "/file"),
        (Library, &results.library, "/poster.jpg", ""),
        (Library, &results.library, "/poster.jpg", "/poses.csv"),
        (Flock, &results.flock, "/thumb.webp", ""),
        (Flock, &results.flock, "/poster.png", "/flock.json"),
        (Fish, &results.fish, "/none", "/video.mp4"),
    ] {
        let id = id_in(path).parse().unwrap();
        store.record_use(kind, id, 0).await.unwrap();
        app.get(&format!("{path}{seen}")).send().await.unwrap();
        assert_eq!(used_at(path).await, never, "{path}{seen}");
        let file = app.get(&format!("{path}{read}")).send().await.unwrap();
        assert_eq!(file.status(), 200);
        let begun = Instant::now();
        while used_at(path).await == never {
            assert!(begun.elapsed() < MAX_WAIT, "{path}{read}");
            tokio::time::sleep(Duration::from_millis(20)).await;
        }
    }
    for (kind, path, noun, name) in [
        (Footage, &results.footage, "analyses", "footage_id"),
        (Library, &results.library, "flocks", "library_id"),
    ] {
        let id = id_in(path);
        store
            .record_use(kind, id.parse().unwrap(), 0)
            .await
            .unwrap();
        app.accept(&format!("/v1/{noun}"), json!({name: id})).await;
        let begun = Instant::now();
        while used_at(path).await == never {
            assert!(begun.elapsed() < MAX_WAIT, "{path}");
            tokio::time::sleep(Duration::from_millis(20)).await;
        }
    }
    app.assert_sound().await;
}
