//! Data sets: the archive, its parts after a cancellation and after kills, and the limits of space
//! (docs/explanation/promises.md, "No job is lost" and "Limited space").

use std::collections::BTreeMap;
use std::io::{Cursor, Read};
use std::time::Duration;

use flockreel::jobs::clock::now_ms;
use flockreel::jobs::worker::{Step, Worker};
use flockreel::store::Store;
use flockreel::store::jobs::keep::KeptPart;
use flockreel_core::random::uniform;
use reqwest::StatusCode;
use serde_json::{Value, json};
use sha2::{Digest, Sha256};

use crate::common::app::{code_of, json_of};
use crate::common::clip::SWIM;
use crate::common::process::Server;
use crate::common::results::id_in;
use crate::common::{Place, TestApp, client};

/// Measures the swimming fish. Returns the id of the library.
async fn library(app: &TestApp) -> Value {
    let footage = app.upload(&SWIM).await;
    let made = app.accept("/v1/analyses", json!({"footage_id": footage}));
    let made = made.await;
    step(app).await;
    made["library_id"].clone()
}

async fn step(app: &TestApp) {
    let step = Worker::new(app.context.clone()).step().await.unwrap();
    assert!(matches!(step, Step::Done(_)), "{step:?}");
}

fn request(library: &Value, flocks: u32) -> Value {
    json!({"library_ids": [library], "flocks": flocks, "pictures": 3, "every": 2, "count": [1, 3],
        "licence": "CC BY 4.0", "formats": ["coco", "mot", "yolo_pose", "masks", "tracks"]})
}

async fn file(app: &TestApp, path: &str) -> Vec<u8> {
    let answer = app.get(path).send().await.unwrap();
    assert_eq!(answer.status(), StatusCode::OK, "{path}");
    answer.bytes().await.unwrap().to_vec()
}

/// Returns the files of an archive with their content.
fn unpacked(archive: Vec<u8>) -> BTreeMap<String, Vec<u8>> {
    let mut archive = zip::ZipArchive::new(Cursor::new(archive)).unwrap();
    let files = (0..archive.len()).map(|k| {
        let mut file = archive.by_index(k).unwrap();
        let mut content = Vec::new();
        file.read_to_end(&mut content).unwrap();
        (file.name().unwrap().into_owned(), content)
    });
    files.collect()
}

fn hex(content: &[u8]) -> String {
    Sha256::digest(content)
        .iter()
        .map(|byte| format!("{byte:02x}"))
        .collect()
}

#[tokio::test(flavor = "multi_thread")]
async fn archive_has_every_file_of_the_manifest_and_can_be_read_in_ranges() {
    let app = TestApp::idle().await;
    let library = library(&app).await;
    step(&app).await; // its views
    let request = request(&library, 3);
    let ask = app.post("/v1/datasets/preview").json(&request).send();
    let sheet = ask.await.unwrap();
    assert_eq!(sheet.headers()["content-type"], "image/jpeg");
    let ask = app.post("/v1/datasets/estimate").json(&request).send();
    let estimate = json_of(ask.await.unwrap(), StatusCode::OK).await;
    assert_eq!(estimate["pictures"], 9);
    let made = app.accept("/v1/datasets", request).await;
    assert_eq!(made["estimate"]["pictures"], 9);
    step(&app).await;

    let path = format!("/v1/datasets/{}", made["dataset_id"].as_str().unwrap());
    let dataset = app.json(&path).await;
    assert_eq!(dataset["library_ids"], json!([library]));
    let names = dataset["files"].as_array().unwrap().iter();
    let names: Vec<_> = names.map(|file| file["name"].as_str().unwrap()).collect();
    assert_eq!(
        names,
        ["dataset.zip", "README.md", "manifest.json", "sheet.jpg"]
    );
    let zip = format!("{path}/dataset.zip");
    let archive = file(&app, &zip).await;
    assert_eq!(dataset["files"][0]["size_bytes"], archive.len());
    let estimated = estimate["size_bytes"].as_f64().unwrap();
    let ratio = estimated / archive.len() as f64;
    assert!((0.5..2.0).contains(&ratio), "{ratio}");
    let mut files = unpacked(archive.clone());
    assert_eq!(
        files["manifest.json"],
        file(&app, &format!("{path}/manifest.json")).await
    );
    let manifest: Value = serde_json::from_slice(&files["manifest.json"]).unwrap();
    assert_eq!(manifest["licence"], "CC BY 4.0");
    for record in manifest["files"].as_array().unwrap() {
        let content = files.remove(record["path"].as_str().unwrap()).unwrap();
        assert_eq!(record["sha256"], hex(&content), "{record}");
    }
    assert_eq!(files.keys().collect::<Vec<_>>(), ["manifest.json"]);
    // The first piece ends somewhere in the middle.
    for (first, last) in [(0, 9), (archive.len() / 4, archive.len() - 1)] {
        let ask = app
            .get(&zip)
            .header("range", format!("bytes={first}-{last}"));
        let part = ask.send().await.unwrap();
        assert_eq!(part.status(), StatusCode::PARTIAL_CONTENT);
        assert_eq!(part.bytes().await.unwrap(), archive[first..=last]);
    }

    assert_eq!(app.n_folders("datasets").await, 4);
    let usage = app.json("/v1/usage").await["datasets"].clone();
    let wanted = json!({"n": 1, "size_bytes": dataset["size_bytes"]});
    assert_eq!(usage, wanted);
    let library = format!("/v1/libraries/{}", library.as_str().unwrap());
    assert_eq!(app.delete(&library).send().await.unwrap().status(), 204);
    assert_eq!(app.n_folders("datasets").await, 0);
    app.assert_sound().await;
}

/// Returns the parts that a job has kept, when there are at least `n`.
async fn kept_when(app: &TestApp, job: &Value, n: usize) -> Vec<KeptPart> {
    let job = job.as_str().unwrap().parse().unwrap();
    loop {
        let parts = app.context.store.kept_parts(job).await.unwrap();
        if parts.len() >= n {
            return parts;
        }
        tokio::time::sleep(Duration::from_millis(5)).await;
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn cancelled_data_set_goes_on_with_the_next_flock() {
    let app = TestApp::idle().await;
    let library = library(&app).await;
    let request = request(&library, 30);
    let first = app.accept("/v1/datasets", request.clone()).await;
    let job = first["job_id"].clone();
    let worker = Worker::new(app.context.clone());
    let running = tokio::spawn(async move { worker.step().await.unwrap() });
    kept_when(&app, &job, 2).await;
    let path = format!("/v1/jobs/{}", job.as_str().unwrap());
    assert_eq!(app.delete(&path).send().await.unwrap().status(), 202);
    assert!(matches!(running.await.unwrap(), Step::Cancelled(_)));
    let before = kept_when(&app, &job, 2).await;
    assert!(
        before.len() < 30,
        "the job was done before it was cancelled"
    );
    let retry = app.post(&format!("{path}/retry")).send().await.unwrap();
    assert_eq!(retry.status(), StatusCode::ACCEPTED);
    step(&app).await;
    let after = kept_when(&app, &job, 30).await;
    assert_eq!(before, after[..before.len()], "kept flocks were made again");
    let second = app.accept("/v1/datasets", request).await;
    step(&app).await;
    let archive = async |made: &Value| {
        let id = made["dataset_id"].as_str().unwrap().to_owned();
        file(&app, &format!("/v1/datasets/{id}/dataset.zip")).await
    };
    assert!(archive(&first).await == archive(&second).await);
    step(&app).await; // the views
    app.assert_sound().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn unfinished_data_set_counts_and_is_deleted_with_what_it_kept() {
    let app = TestApp::idle().await;
    let library = library(&app).await;
    let made = app.accept("/v1/datasets", request(&library, 8)).await;
    let worker = Worker::new(app.context.clone());
    let running = tokio::spawn(async move { worker.step().await.unwrap() });
    kept_when(&app, &made["job_id"], 1).await;
    let usage = app.json("/v1/usage").await["datasets"].clone();
    assert_eq!(usage["n"], 0);
    assert!(usage["size_bytes"].as_i64().unwrap() > 0);
    let path = format!("/v1/datasets/{}", made["dataset_id"].as_str().unwrap());
    assert_eq!(
        code_of(app.get(&path).send().await.unwrap(), 404).await,
        "not_ready"
    );
    assert_eq!(app.delete(&path).send().await.unwrap().status(), 204);
    assert!(matches!(
        running.await.unwrap(),
        Step::Lost(_) | Step::Cancelled(_)
    ));
    assert_eq!(app.n_folders("datasets").await, 0);
    step(&app).await; // the views
    app.assert_sound().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn data_set_that_does_not_fit_is_refused_before_it_starts() {
    let place = Place::from_environment();
    let app = TestApp::on(place, &["--max-owner-bytes", "30000000"]).await;
    let library = library(&app).await;
    for path in ["/v1/datasets/estimate", "/v1/datasets"] {
        let refused = app.post(path).json(&request(&library, 100_000)).send();
        let code = code_of(refused.await.unwrap(), 507).await;
        assert_eq!(code, "owner_storage_full", "{path}");
    }
    for (field, wrong) in [
        ("library_ids", json!([])),
        ("licence", json!("two\nlines")),
        ("noise", json!([5, 1])),
        ("flock", json!({"depth_bl": -1})),
    ] {
        let mut request = request(&library, 1);
        request[field] = wrong;
        let refused = app.post("/v1/datasets").json(&request).send();
        let code = code_of(refused.await.unwrap(), 422).await;
        assert_eq!(code, "invalid_params", "{field}");
    }
    step(&app).await; // the views
    app.assert_sound().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn killed_data_sets_end_with_equal_bytes() {
    let place = Place::from_environment();
    let mut server = Server::start_at(&place);
    let footage: Value = server.upload(SWIM.clone()).await.json().await.unwrap();
    let made = server.accept("/v1/analyses", json!({"footage_id": footage["id"]}));
    let made = made.await;
    server.ended(&made["job_id"]).await;
    let request = request(&made["library_id"], 30);
    let killed = server.accept("/v1/datasets", request.clone()).await["job_id"].clone();
    // More kills than a job survives that does not advance.
    let mut kept = Vec::new();
    for kill in 0..5 {
        let n_before = kept.len();
        tokio::time::sleep(Duration::from_secs_f64(0.3 + 0.7 * uniform(7, &[kill]))).await;
        server.kill();
        let store = Store::open(place.storage()).await.unwrap();
        let job = killed.as_str().unwrap().parse().unwrap();
        let now: Vec<KeptPart> = store.kept_parts(job).await.unwrap();
        assert_eq!(kept, now[..n_before], "kept flocks were made again");
        kept = now;
        drop(store);
        server = Server::start_at(&place);
    }
    assert!(!kept.is_empty(), "no flock was finished between the kills");
    let ended = server.ended(&killed).await;
    assert_eq!(ended["state"], "done", "{ended}");
    let whole = server.accept("/v1/datasets", request).await["job_id"].clone();
    let mut tags = Vec::new();
    for job in [ended, server.ended(&whole).await] {
        let id = id_in(job["links"]["result"].as_str().unwrap());
        let url = format!("{}/v1/datasets/{id}/dataset.zip", server.base);
        let answer = client().head(url).send().await.unwrap();
        tags.push(answer.headers()["etag"].clone());
    }
    assert_eq!(tags[0], tags[1]);
    assert_eq!(server.terminate(), Some(0));
    let store = Store::open(place.storage()).await.unwrap();
    assert_eq!(
        store.check_after_crash(now_ms()).await.unwrap(),
        Vec::<String>::new()
    );
}
