//! Uploads: accepted films and pictures, refused ones with their codes, and no leftovers of a refusal.

use reqwest::StatusCode;
use reqwest::multipart::{Form, Part};
use serde_json::json;

use crate::common::TestApp;
use crate::common::app::{code_of, json_of};
use crate::common::clip::{SWIM, SWIM_MASKS, TINY};
use crate::common::pictures::{stack_of_grays, zip_of_grays};

#[tokio::test]
async fn film_is_stored_unchanged() {
    let app = TestApp::idle().await;
    let answer = app
        .post("/v1/footage?name=my%20fish.mp4")
        .body(TINY.clone());
    let answer = answer.send().await.unwrap();
    let location = answer.headers()["location"].to_str().unwrap().to_owned();
    let footage = json_of(answer, StatusCode::CREATED).await;
    assert_eq!(footage["name"], "my fish.mp4");
    assert_eq!(footage["image_size_px"], json!([64, 64]));
    assert_eq!(footage["n_frames_hint"], 10);
    assert_eq!(app.json(&location).await, footage);
    let file = app.get(&format!("{location}/file")).send().await.unwrap();
    let disposition = file.headers()["content-disposition"].to_str().unwrap();
    assert!(disposition.starts_with("attachment; filename=\"my fish.mp4\""));
    assert_eq!(file.bytes().await.unwrap(), *TINY);
    app.assert_sound().await;
}

#[tokio::test]
async fn zip_and_tiff_of_pictures_are_footage_whose_rate_is_a_parameter() {
    let app = TestApp::idle().await;
    for (media_type, body) in [
        ("application/zip", zip_of_grays(12)),
        ("image/tiff", stack_of_grays(12)),
    ] {
        let sent = app.post("/v1/footage").header("content-type", media_type);
        let answer = sent.body(body.clone()).send().await.unwrap();
        let footage = json_of(answer, StatusCode::CREATED).await;
        assert_eq!(footage["n_frames_hint"], 12, "{media_type}");
        assert_eq!(footage["image_size_px"], json!([64, 48]));
        let body_of_one_call = app.post("/v1/analyses").header("content-type", media_type);
        let answer = body_of_one_call.body(body).send().await.unwrap();
        let analysis = json_of(answer, StatusCode::ACCEPTED).await;
        assert_eq!(analysis["footage_id"], footage["id"]);
        let good = json!({"footage_id": footage["id"], "params": {"fps": 12.5, "pixel_aspect": 2}});
        app.accept("/v1/analyses", good).await;
        let bad = json!({"footage_id": footage["id"], "params": {"fps": 0}});
        let answer = app.post("/v1/analyses").json(&bad).send().await.unwrap();
        assert_eq!(code_of(answer, 422).await, "invalid_params");
    }
    app.assert_sound().await;
}

#[tokio::test]
async fn equal_upload_returns_the_stored_footage() {
    let app = TestApp::idle().await;
    let id = app.upload(&TINY).await;
    let form = Form::new().part("video", Part::bytes(TINY.clone()));
    let again = app.send_form("/v1/footage", form).await;
    let again = json_of(again, StatusCode::OK).await;
    assert_eq!(again["id"], id);
    assert_eq!(app.n_folders("footage").await, 1);
    app.assert_sound().await;
}

#[tokio::test]
async fn concurrent_equal_uploads_become_one_footage() {
    let app = TestApp::idle().await;
    let send = || app.post("/v1/footage").body(TINY.clone()).send();
    let (a, b, c) = tokio::join!(send(), send(), send());
    let mut ids = Vec::new();
    for answer in [a, b, c] {
        let footage: serde_json::Value = answer.unwrap().json().await.unwrap();
        ids.push(footage["id"].clone());
    }
    assert_eq!(ids, vec![ids[0].clone(); 3]);
    assert_eq!(app.n_folders("footage").await, 1);
    app.assert_sound().await;
}

#[tokio::test]
async fn refused_uploads_leave_no_files() {
    let app = TestApp::idle().await;
    let playlist = b"#EXTM3U\n#EXT-X-TARGETDURATION:1\n#EXTINF:1,\n/etc/passwd\n#EXT-X-ENDLIST\n";
    let cut_off = TINY[..TINY.len() / 2].to_vec();
    for (body, code) in [
        (b"".to_vec(), "not_a_video"),
        (b"just some words\n".repeat(100), "not_a_video"),
        (playlist.to_vec(), "not_a_video"),
        (
            b"ffconcat version 1.0\nfile /etc/passwd\n".to_vec(),
            "not_a_video",
        ),
        (cut_off, "truncated"),
    ] {
        let said = String::from_utf8_lossy(&body[..body.len().min(20)]).into_owned();
        let answer = app.post("/v1/footage").body(body).send().await.unwrap();
        assert_eq!(code_of(answer, 422).await, code, "{said:?}");
        assert_eq!(
            (app.n_drafts(), app.n_folders("footage").await),
            (0, 0),
            "{said:?}"
        );
    }
    assert_eq!(app.json("/v1/footage").await["items"], json!([]));
    app.assert_sound().await;
}

#[tokio::test]
async fn body_above_the_limit_is_refused_raw_and_in_a_form() {
    let app = TestApp::start(&["--max-upload-bytes", "1000"]).await;
    let declared = app.post("/v1/footage").body(vec![0; 1001]).send().await;
    assert_eq!(code_of(declared.unwrap(), 413).await, "too_large");
    let form = Form::new().part("video", Part::bytes(vec![0; 1001]));
    let in_form = app.post("/v1/footage").multipart(form).send().await;
    assert_eq!(code_of(in_form.unwrap(), 413).await, "too_large");
    app.assert_sound().await;
}

#[tokio::test]
async fn form_without_video_or_with_unknown_fields_is_refused() {
    let app = TestApp::idle().await;
    for form in [
        Form::new(),
        Form::new().text("vidoe", "x"),
        Form::new().part("background", Part::bytes(TINY.clone())),
    ] {
        let answer = app.send_form("/v1/footage", form).await;
        assert_eq!(code_of(answer, 400).await, "malformed_request");
    }
    app.assert_sound().await;
}

#[tokio::test]
async fn a_stored_film_gets_a_background_without_being_sent_again() {
    let app = TestApp::idle().await;
    let id = app.upload(&TINY).await;
    let film = app.json(&format!("/v1/footage/{id}")).await;
    let variants = format!("/v1/footage/{id}/variants");
    let form = |more: u32| {
        let side = |k: usize| film["image_size_px"][k].as_u64().unwrap() as u32;
        let picture = flockreel_core::raster::RgbImage::new(side(0) + more, side(1));
        let picture = flockreel_core::formats::picture::write_rgb(&picture);
        Form::new().part("background", Part::bytes(picture))
    };
    let made = json_of(app.send_form(&variants, form(0)).await, StatusCode::CREATED).await;
    assert_eq!(made["has_background"], true);
    assert_eq!(
        (&made["sha256"], &made["name"]),
        (&film["sha256"], &film["name"])
    );
    let again = json_of(app.send_form(&variants, form(0)).await, StatusCode::OK).await;
    assert_eq!(again["id"], made["id"]);
    let other = app.send_form(&variants, form(2)).await;
    assert_eq!(code_of(other, 422).await, "background_size_differs");
    let two_films = form(0).part("video", Part::bytes(TINY.clone()));
    let two_films = app.send_form(&variants, two_films).await;
    assert_eq!(code_of(two_films, 400).await, "malformed_request");
    let raw = app.post(&variants).body(TINY.clone()).send().await.unwrap();
    assert_eq!(code_of(raw, 415).await, "unsupported_media_type");
    assert_eq!(app.n_folders("footage").await, 2);
    app.assert_sound().await;
}

#[tokio::test]
async fn a_background_of_another_size_is_refused() {
    let app = TestApp::idle().await;
    let picture =
        flockreel_core::formats::picture::write_rgb(&flockreel_core::raster::RgbImage::new(32, 64));
    let form = Form::new()
        .part("video", Part::bytes(TINY.clone()))
        .part("background", Part::bytes(picture));
    let answer = app.send_form("/v1/footage", form).await;
    assert_eq!(code_of(answer, 422).await, "background_size_differs");
    assert_eq!(app.n_folders("footage").await, 0);
    app.assert_sound().await;
}

/// Returns a form with a film and its mask film.
fn with_masks(video: &[u8], masks: &[u8]) -> Form {
    Form::new()
        .part("video", Part::bytes(video.to_vec()))
        .part("masks", Part::bytes(masks.to_vec()))
}

#[tokio::test(flavor = "multi_thread")]
async fn masks_replace_detection_by_color() {
    let app = TestApp::working().await;
    let plain = app.upload(&SWIM).await;
    let form = with_masks(&SWIM, &SWIM_MASKS);
    let answer = app.send_form("/v1/footage", form).await;
    let footage = json_of(answer, StatusCode::CREATED).await;
    assert_ne!(footage["id"], plain, "the same film with masks is another");
    assert_eq!(footage["has_masks"], true);
    let again = app.send_form("/v1/footage", with_masks(&SWIM, &SWIM_MASKS));
    let again = json_of(again.await, StatusCode::OK).await;
    assert_eq!(again["id"], footage["id"]);
    // With this threshold, no animal would be found by color.
    let body = json!({"footage_id": footage["id"], "params": {"threshold": 200}});
    let accepted = app.accept("/v1/analyses", body).await;
    let job = app.ended_job(&accepted["job_id"]).await;
    assert_eq!(job["state"], "done", "{job}");
    let library = accepted["library_id"].as_str().unwrap();
    let poses = app
        .json(&format!("/v1/libraries/{library}/poses.json"))
        .await;
    let frames = poses["frames"].as_array().unwrap();
    assert!(frames.iter().all(|pose| pose["detected"] == true));
    let path = format!("/v1/footage/{}", footage["id"].as_str().unwrap());
    app.delete(&path).send().await.unwrap();
    assert_eq!(app.n_folders("footage").await, 1);
    app.assert_sound().await;
}

#[tokio::test]
async fn masks_of_another_size_are_refused_on_upload() {
    let app = TestApp::idle().await;
    let answer = app.send_form("/v1/footage", with_masks(&SWIM, &TINY)).await;
    assert_eq!(code_of(answer, 422).await, "masks_differ");
    let answer = app
        .send_form("/v1/footage", with_masks(&SWIM, b"no masks"))
        .await;
    assert_eq!(code_of(answer, 422).await, "not_a_video");
    assert_eq!(app.n_folders("footage").await, 0);
    app.assert_sound().await;
}
