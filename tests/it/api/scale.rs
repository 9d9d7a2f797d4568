//! The scale of a library: centimetres at once, and no change of stored files.

use flockreel::store::tokens::Scope;
use reqwest::{Method, Response, StatusCode};
use serde_json::{Value, json};

use super::synchronous::with_library;
use crate::common::TestApp;
use crate::common::app::{code_of, json_of};
use crate::common::results::Results;

async fn change(app: &TestApp, library: &str, change: Value) -> Response {
    let request = app.request(Method::PATCH, library).json(&change);
    request.send().await.unwrap()
}

async fn changed(app: &TestApp, library: &str, to: Value) -> Value {
    json_of(change(app, library, to).await, StatusCode::OK).await
}

/// Returns the ETag and the text of a file. Fails if the client might keep it without asking again.
async fn file(app: &TestApp, path: &str) -> (String, String) {
    let answer = app.get(path).send().await.unwrap();
    assert_eq!(answer.status(), 200, "{path}");
    assert_eq!(answer.headers()["cache-control"], "private, no-cache");
    let etag = answer.headers()["etag"].to_str().unwrap().to_owned();
    (etag, answer.text().await.unwrap())
}

/// Returns the numbers of a column of CSV, NaN for empty cells.
fn column(csv: &str, name: &str) -> Vec<f64> {
    let mut lines = csv.lines().map(|line| line.split(',').collect::<Vec<_>>());
    let header = lines.next().unwrap();
    let at = header.iter().position(|one| *one == name).unwrap();
    let number = |cell: &str| cell.parse().unwrap_or(f64::NAN);
    lines.map(|cells| number(cells[at])).collect()
}

#[tokio::test(flavor = "multi_thread")]
async fn scale_changes_centimetres_at_once_and_no_stored_file() {
    let (app, library, _) = with_library().await;
    let (motion, poses) = (
        format!("{library}/motion.csv"),
        format!("{library}/poses.csv"),
    );
    let etag_of = async |path: &str| app.head(path).send().await.unwrap().headers()["etag"].clone();
    let stored = etag_of(&poses).await;
    assert_eq!(app.json(&library).await["px_per_cm"], Value::Null);
    let (without, text) = file(&app, &motion).await;
    assert!(column(&text, "speed_cm_per_s").iter().all(|cm| cm.is_nan()));
    assert!(column(&text, "speed_bl_per_s").iter().any(|bl| *bl > 0.0));

    let view = changed(&app, &library, json!({"px_per_cm": 20})).await;
    let length_px = view["length_px"].as_f64().unwrap();
    let length_cm = view["length_cm"].as_f64().unwrap();
    assert_eq!(view["px_per_cm"], 20.0);
    assert!((length_cm - length_px / 20.0).abs() < 1e-3, "{view}");
    let (with, text) = file(&app, &motion).await;
    assert_ne!(with, without);
    let speeds = column(&text, "speed_bl_per_s").into_iter();
    for (bl, cm) in speeds.zip(column(&text, "speed_cm_per_s")) {
        assert!(bl.is_nan() && cm.is_nan() || (bl * length_cm - cm).abs() < 1e-3);
    }
    for (known, status) in [(&with, 304), (&without, 200)] {
        let asked = app.get(&motion).header("if-none-match", known);
        assert_eq!(asked.send().await.unwrap().status(), status);
    }

    let view = changed(&app, &library, json!({"length_cm": 12.5, "pinned": true})).await;
    assert_eq!(
        (&view["length_cm"], &view["pinned"]),
        (&json!(12.5), &json!(true))
    );
    let summary = app.json(&format!("{library}/summary.json")).await;
    assert_eq!(summary["length_cm"], 12.5);
    let (_, row) = file(&app, &format!("{library}/summary.csv")).await;
    assert_eq!(
        column(&row, "distance_cm"),
        [summary["distance_cm"].as_f64().unwrap()]
    );
    let frames = app.json(&format!("{library}/motion.json")).await["frames"].clone();
    assert_eq!(frames.as_array().unwrap().len(), text.lines().count() - 1);

    let view = changed(&app, &library, json!({"px_per_cm": null})).await;
    assert_eq!(
        (&view["px_per_cm"], &view["length_cm"]),
        (&Value::Null, &Value::Null)
    );
    assert_eq!(file(&app, &motion).await.0, without);
    assert_eq!(etag_of(&poses).await, stored);
    app.assert_sound().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn use_of_zones_is_part_of_a_summary() {
    let (app, library, _) = with_library().await;
    changed(&app, &library, json!({"px_per_cm": 8})).await;
    let summary = app.json(&format!("{library}/summary.json")).await;
    let zones = "all:rect:-1,-1,9999,9999;none:ellipse:-9,-9,1,1";
    let zoned = app
        .json(&format!("{library}/summary.json?zones={zones}"))
        .await;
    assert_eq!(zoned["all_s"], summary["seen_s"]);
    assert_eq!(zoned["all_distance_cm"], summary["distance_cm"]);
    assert_eq!(
        [&zoned["all_share"], &zoned["all_visits"]],
        [&json!(1), &json!(1)]
    );
    assert_eq!(
        [&zoned["none_s"], &zoned["none_first_s"]],
        [&json!(0), &Value::Null]
    );
    let (_, row) = file(&app, &format!("{library}/summary.csv?zones={zones}")).await;
    assert_eq!(column(&row, "all_s"), [summary["seen_s"].as_f64().unwrap()]);
    let wrong = app.get(&format!("{library}/summary.csv?zones=all:rect:1"));
    assert_eq!(
        code_of(wrong.send().await.unwrap(), 422).await,
        "invalid_params"
    );
    app.assert_sound().await;
}

#[tokio::test]
async fn wrong_scales_are_refused_and_change_nothing() {
    let app = TestApp::idle().await;
    let library = Results::make(&app, "film.mp4").await.library;
    changed(&app, &library, json!({"px_per_cm": 42})).await;
    for (to, reason) in [
        (json!({}), "must have pinned, px_per_cm or length_cm"),
        (json!({"px_per_cm": 0}), "must lie in 0.001..=1000000: 0"),
        (
            json!({"px_per_cm": 1e7}),
            "must lie in 0.001..=1000000: 10000000",
        ),
        (json!({"px_per_cm": -3, "pinned": true}), "must lie in"),
        (json!({"px_per_cm": "42"}), "invalid type"),
        (json!({"px_per_cm": 42, "length_cm": 10}), "not both"),
        (json!({"length_cm": null}), "invalid type"),
        // The length of this animal in the picture is unknown.
        (json!({"length_cm": 10}), "give px_per_cm"),
        (json!({"scale": 42}), "unknown field"),
    ] {
        let answer = change(&app, &library, to.clone()).await;
        let problem = json_of(answer, StatusCode::UNPROCESSABLE_ENTITY).await;
        assert_eq!(problem["code"], "invalid_params", "{to}");
        let detail = problem["detail"].as_str().unwrap();
        assert!(detail.contains(reason), "{to}: {detail}");
    }
    let view = app.json(&library).await;
    assert_eq!(
        (&view["px_per_cm"], &view["pinned"]),
        (&json!(42.0), &json!(false))
    );
    app.assert_sound().await;
}

#[tokio::test]
async fn scale_is_set_only_by_its_owner_with_a_token_that_writes() {
    let mut app = TestApp::start(&["--auth", "required"]).await;
    let owner = app.token(Scope::Write, 10).await;
    app.sign_in(&owner);
    let library = Results::make(&app, "film.mp4").await.library;
    let scale = json!({"px_per_cm": 42});
    for (scope, status, code) in [
        (Scope::Write, 404, "not_found"),
        (Scope::Read, 403, "scope_too_small"),
    ] {
        let other = app.token(scope, 10).await;
        app.sign_in(&other);
        assert_eq!(
            code_of(change(&app, &library, scale.clone()).await, status).await,
            code
        );
    }
    app.sign_in(&owner);
    assert_eq!(app.json(&library).await["px_per_cm"], Value::Null);
    changed(&app, &library, scale).await;
    app.assert_sound().await;
}
