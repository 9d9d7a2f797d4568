//! Results that are computed during the request: the preview of a flock, and the distances of a library.

use std::time::Duration;

use reqwest::StatusCode;
use serde_json::json;

use crate::common::TestApp;
use crate::common::app::{code_of, json_of};
use crate::common::clip::{SWIM, SWIM_FRAMES};

/// Starts a service with a library of the swimming fish. Returns the library's path and id.
pub(super) async fn with_library() -> (TestApp, String, String) {
    let app = TestApp::working().await;
    let footage_id = app.upload(&SWIM).await;
    let (path, id) = library_of(&app, &footage_id).await;
    (app, path, id)
}

/// Measures a footage. Returns the library's path and id.
async fn library_of(app: &TestApp, footage_id: &str) -> (String, String) {
    let request = json!({"footage_id": footage_id});
    let made = app.accept("/v1/analyses", request).await;
    let job = app.ended_job(&made["job_id"]).await;
    assert_eq!(job["state"], "done", "{job}");
    let id = made["library_id"].as_str().unwrap().to_owned();
    (format!("/v1/libraries/{id}"), id)
}

#[tokio::test(flavor = "multi_thread")]
async fn preview_equals_the_flock_and_stores_nothing() {
    let (app, _, library_id) = with_library().await;
    let request = json!({"library_id": library_id, "count": 3, "frames": 20, "seed": 7});
    let preview = app
        .post("/v1/flocks/preview")
        .json(&request)
        .send()
        .await
        .unwrap();
    let preview = json_of(preview, StatusCode::OK).await;
    assert_eq!(app.json("/v1/flocks").await["items"], json!([]));
    for accepted in [
        "application/vnd.flockreel.plan",
        "application/vnd.flockreel.plan;v=1, */*;q=0.1",
    ] {
        let ask = app.post("/v1/flocks/preview").header("accept", accepted);
        let plan = ask.json(&request).send().await.unwrap();
        assert_eq!(
            plan.headers()["content-type"],
            "application/vnd.flockreel.plan"
        );
        assert!(plan.bytes().await.unwrap().starts_with(b"FLOCKPLN"));
    }

    let made = app.accept("/v1/flocks", request).await;
    let job = app.ended_job(&made["job_id"]).await;
    assert_eq!(job["state"], "done", "{job}");
    let path = format!(
        "/v1/flocks/{}/flock.json",
        made["flock_id"].as_str().unwrap()
    );
    assert_eq!(app.json(&path).await["individuals"], preview["individuals"]);
    app.assert_sound().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn preview_of_an_analysis_finds_what_the_analysis_finds_and_stores_nothing() {
    let app = TestApp::working().await;
    let footage_id = app.upload(&SWIM).await;
    let ask = |params: serde_json::Value| {
        let body = json!({"footage_id": footage_id, "params": params});
        app.post("/v1/analyses/preview").json(&body).send()
    };
    let preview = json_of(ask(json!({})).await.unwrap(), StatusCode::OK).await;
    assert_eq!(preview["refusal"], json!(null));
    let (jobs, libraries) = (app.json("/v1/jobs").await, app.json("/v1/libraries").await);
    assert_eq!([&jobs["items"], &libraries["items"]], [&json!([]); 2]);
    let (library, _) = library_of(&app, &footage_id).await;
    let poses = app.json(&format!("{library}/poses.json")).await;
    let frames = preview["frames"].as_array().unwrap();
    assert_eq!(frames.len(), 40);
    for seen in frames {
        let k = seen["frame"].as_u64().unwrap() as usize;
        let centroid = &poses["frames"][k]["centroid_px"];
        let outline = seen["animal_px"].as_array().expect("the fish is found");
        let [x, y] = [0, 1].map(|axis| {
            let sum: f64 = outline.iter().map(|p| p[axis].as_f64().unwrap()).sum();
            sum / outline.len() as f64
        });
        let off_px = (x - centroid[0].as_f64().unwrap()).hypot(y - centroid[1].as_f64().unwrap());
        assert!(off_px < 8.0, "frame {k}: {off_px} px");
    }
    let everything = json!({"ignore": [{"box_px": [0, 0, 320, 240]}]});
    let refused = json_of(ask(everything).await.unwrap(), StatusCode::OK).await;
    assert_eq!(refused["refusal"]["code"], "nothing_moves");
    assert_eq!(refused["refusal"]["mends"][0]["param"], "threshold");
    let unknown = ask(json!({"treshold": 7})).await.unwrap();
    assert_eq!(code_of(unknown, 422).await, "invalid_params");
    app.assert_sound().await;
}

/// Returns the value of a metric of Server-Timing, milliseconds.
fn duration_ms(answer: &reqwest::Response, metric: &str) -> f64 {
    let timing = answer.headers()["server-timing"].to_str().unwrap();
    let mut metrics = timing.split(", ");
    let prefix = format!("{metric};dur=");
    let value = metrics.find_map(|one| one.strip_prefix(&prefix));
    value.unwrap_or_else(|| panic!("{timing}")).parse().unwrap()
}

#[tokio::test(flavor = "multi_thread")]
async fn preview_tells_its_time_and_ends_with_its_client() {
    let (app, _, library_id) = with_library().await;
    let request = json!({"library_id": library_id, "count": 200, "frames": 1000});
    let ask = || app.post("/v1/flocks/preview").json(&request).send();
    let plan_ms = duration_ms(&ask().await.unwrap(), "plan");
    assert!(plan_ms > 1.0, "{plan_ms}");
    let impatient = tokio::time::timeout(Duration::from_secs_f64(plan_ms / 10_000.0), ask());
    assert!(impatient.await.is_err(), "the client should have gone");
    // The next preview waits until the planner of the former has stopped.
    let request = json!({"library_id": library_id, "count": 2, "frames": 10});
    let next = app.post("/v1/flocks/preview").json(&request).send().await;
    let waited_ms = duration_ms(&next.unwrap(), "load");
    assert!(waited_ms < plan_ms / 2.0, "{waited_ms} of {plan_ms} ms");
    app.assert_sound().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn invalid_previews_are_refused() {
    let (app, _, library_id) = with_library().await;
    let other = uuid::Uuid::now_v7();
    for (request, status, code) in [
        (
            json!({"library_id": library_id, "count": 1000, "frames": 201}),
            422,
            "invalid_params",
        ),
        (
            json!({"library_id": library_id, "count": 0}),
            422,
            "invalid_params",
        ),
        (json!({"library_id": other, "count": 2}), 404, "not_found"),
    ] {
        let answer = app
            .post("/v1/flocks/preview")
            .json(&request)
            .send()
            .await
            .unwrap();
        assert_eq!(code_of(answer, status).await, code, "{request}");
    }
    app.assert_sound().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn distance_array_matches_the_transitions_and_is_cacheable() {
    let (app, library, _) = with_library().await;
    let path = format!("{library}/distance.npy");
    let answer = app.get(&path).send().await.unwrap();
    assert_eq!(answer.status(), StatusCode::OK);
    let etag = answer.headers()["etag"].clone();
    let length = answer.headers()["content-length"].clone();
    let bytes = answer.bytes().await.unwrap();
    assert_eq!(length, bytes.len().to_string().as_str());
    let stored = app.json(&format!("{library}/library.json")).await;
    // n frames have n + 1 - f clips, where f is the number of frames of a clip.
    let n = SWIM_FRAMES + 1 - stored["params"]["clip_frames"].as_u64().unwrap_or(8) as usize;
    let header = String::from_utf8_lossy(&bytes[..128]).into_owned();
    assert!(header.contains(&format!("'shape': ({n}, {n})")), "{header}");
    assert_eq!(bytes.len(), 128 + 4 * n * n);
    let d = |i: usize, j: usize| {
        let at = 128 + 4 * (i * n + j);
        u32::from_le_bytes(bytes[at..at + 4].try_into().unwrap())
    };
    assert!((0..n).all(|i| d(i, i) == 0 && d(i, n - 1) == d(n - 1, i)));
    let transition = &stored["transitions"][0];
    assert!(transition.is_object(), "the fish has transitions");
    let plain = stored["transitions"].as_array().unwrap().iter();
    for t in plain.filter(|t| t["mirrored"] == false).take(9) {
        let [from, to] = ["from", "to"].map(|end| t[end].as_u64().unwrap() as usize);
        assert_eq!(u64::from(d(from, to)), t["distance"].as_u64().unwrap());
    }
    let again = app.get(&path).header("if-none-match", etag);
    assert_eq!(
        again.send().await.unwrap().status(),
        StatusCode::NOT_MODIFIED
    );
    app.assert_sound().await;
}
