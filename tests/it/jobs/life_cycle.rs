//! All stages through HTTP: film to library, library to flock and virtual fish, and every result file.

use reqwest::StatusCode;
use serde_json::{Value, json};

use crate::common::TestApp;
use crate::common::app::code_of;
use crate::common::clip::{SWIM, SWIM_FRAMES, TINY};

#[tokio::test(flavor = "multi_thread")]
async fn a_film_becomes_a_library_a_flock_and_a_virtual_fish() {
    let app = TestApp::working().await;
    let footage_id = app.upload(&SWIM).await;
    let analysis = app
        .accept("/v1/analyses", json!({"footage_id": footage_id}))
        .await;
    let render = json!({"formats": ["webm", "mov", "png", "gif", "webp", "poster"],
        "background": "transparent", "overlay": true, "size_px": [160, 120]});
    let wishes = json!({"library_id": analysis["library_id"], "count": 3, "frames": 20, "seed": 7,
        "render": render});
    let flock = app.accept("/v1/flocks", wishes).await;

    let job = app.ended_job(&analysis["job_id"]).await;
    assert_eq!(job["state"], "done", "{job}");
    let library = format!("/v1/libraries/{}", analysis["library_id"].as_str().unwrap());
    let at_a_glance = app.json(&library).await;
    assert_eq!(at_a_glance["n_frames"], SWIM_FRAMES);
    assert!(
        at_a_glance["detected_share"].as_f64().unwrap() > 0.9,
        "{at_a_glance}"
    );
    let poses = app.json(&format!("{library}/poses.json")).await;
    assert_eq!(poses["frames"].as_array().unwrap().len(), SWIM_FRAMES);
    for (file, magic) in [
        ("background.png", &b"\x89PNG"[..]),
        ("distance.png", b"\x89PNG"),
        ("candidates.png", b"\x89PNG"),
        ("headings.svg", b"<svg"),
        ("trajectory.svg", b"<svg"),
        ("confidence.svg", b"<svg"),
        ("transitions.svg", b"<svg"),
        ("poses.csv", b"frame"),
        ("sprites.zip", b"PK"),
        ("mattes.zip", b"PK"),
    ] {
        let answer = app.get(&format!("{library}/{file}")).send().await.unwrap();
        assert_eq!(answer.status(), StatusCode::OK, "{file}");
        assert!(answer.bytes().await.unwrap().starts_with(magic), "{file}");
    }

    let job = app.ended_job(&flock["job_id"]).await;
    assert_eq!(job["state"], "done", "{job}");
    let flock = format!("/v1/flocks/{}", flock["flock_id"].as_str().unwrap());
    let at_a_glance = app.json(&flock).await;
    assert_eq!(
        (&at_a_glance["count"], &at_a_glance["seed"]),
        (&json!(3), &json!(7))
    );
    let video = app.get(&format!("{flock}/video.mp4")).send().await.unwrap();
    assert_eq!(video.headers()["content-type"], "video/mp4");
    assert_eq!(&video.bytes().await.unwrap()[4..8], b"ftyp");
    assert_eq!(app.json(&format!("{flock}/flock.json")).await["seed"], 7);
    let plan = app.get(&format!("{flock}/plan.svg")).send().await.unwrap();
    assert!(plan.text().await.unwrap().contains("All 3 individuals"));
    assert_files(&app, &flock).await;
    assert_fish(&app, &analysis["library_id"]).await;
    app.assert_sound().await;
}

/// Asserts that each requested file of a flock is served with its media type and file signature.
async fn assert_files(app: &TestApp, flock: &str) {
    for (file, media_type, at, magic) in [
        ("video.webm", "video/webm", 0, &b"\x1a\x45\xdf\xa3"[..]),
        ("video.mov", "video/quicktime", 4, b"ftypqt"),
        ("overlay.mp4", "video/mp4", 4, b"ftyp"),
        ("frames.zip", "application/zip", 0, b"PK"),
        ("ground-truth.zip", "application/zip", 0, b"PK"),
        ("preview.gif", "image/gif", 0, b"GIF89a"),
        ("preview.webp", "image/webp", 8, b"WEBP"),
        ("poster.png", "image/png", 0, b"\x89PNG"),
        ("thumb.webp", "image/webp", 8, b"WEBP"),
        (
            "tracks.csv",
            "text/csv; charset=utf-8",
            0,
            b"frame,time_s,id",
        ),
    ] {
        let answer = app.get(&format!("{flock}/{file}")).send().await.unwrap();
        assert_eq!(answer.status(), StatusCode::OK, "{file}");
        assert_eq!(answer.headers()["content-type"], media_type, "{file}");
        let bytes = answer.bytes().await.unwrap();
        assert!(bytes[at..].starts_with(magic), "{file}");
        assert!(
            file != "thumb.webp" || bytes.len() <= 30_000,
            "{}",
            bytes.len()
        );
    }
    let answer = app.get(&format!("{flock}/ground-truth.zip")).send().await;
    let bytes = answer.unwrap().bytes().await.unwrap();
    let mut zip = zip::ZipArchive::new(std::io::Cursor::new(&bytes[..])).unwrap();
    let names: Vec<String> = (0..zip.len())
        .map(|idx| zip.by_index(idx).unwrap().name().unwrap().to_string())
        .collect();
    for name in [
        "README.txt",
        "coco.json",
        "gt/gt.txt",
        "seqinfo.ini",
        "tracks.csv",
        "tracks_dlc.csv",
        "report.json",
    ] {
        assert!(names.iter().any(|found| found == name), "{name} {names:?}");
    }
    assert_eq!(
        names
            .iter()
            .filter(|name| name.starts_with("masks/"))
            .count(),
        20
    );
    let place = names.iter().position(|name| name == "coco.json").unwrap();
    let coco: Value = serde_json::from_reader(zip.by_index(place).unwrap()).unwrap();
    assert_eq!(coco["images"][19]["width"], 160);
}

async fn assert_fish(app: &TestApp, library_id: &Value) {
    let wishes = json!({"library_id": library_id, "palette": "silver"});
    let fish = app.accept("/v1/fish", wishes).await;
    let job = app.ended_job(&fish["job_id"]).await;
    assert_eq!(job["state"], "done", "{job}");
    let fish = format!("/v1/fish/{}", fish["fish_id"].as_str().unwrap());
    let at_a_glance = app.json(&fish).await;
    assert_eq!(
        (&at_a_glance["frames"], &at_a_glance["params"]["palette"]),
        (&json!(SWIM_FRAMES), &json!("silver"))
    );
    for (file, at, magic) in [("video.mp4", 4, &b"ftyp"[..]), ("model.glb", 0, b"glTF")] {
        let answer = app.get(&format!("{fish}/{file}")).send().await.unwrap();
        assert!(
            answer.bytes().await.unwrap()[at..].starts_with(magic),
            "{file}"
        );
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn a_film_that_cannot_be_measured_fails_with_its_reason() {
    let app = TestApp::working().await;
    let footage_id = app.upload(&TINY).await;
    let analysis = app
        .accept("/v1/analyses", json!({"footage_id": footage_id}))
        .await;
    let job = app.ended_job(&analysis["job_id"]).await;
    assert_eq!(job["state"], "failed");
    let code = job["error"]["code"].as_str().unwrap();
    assert!(
        flockreel_core::code::Code::from_name(code).is_some() && code != "internal",
        "{job}"
    );
    let library = format!("/v1/libraries/{}", analysis["library_id"].as_str().unwrap());
    let answer = app.get(&library).send().await.unwrap();
    assert_eq!(code_of(answer, 404).await, code);
    assert_eq!(app.n_folders("libraries").await, 0);
    app.assert_sound().await;
}
