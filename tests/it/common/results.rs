//! Substitute results: a library, a flock and a virtual fish with the rows and files of real ones, but without
//! their content. They are made at once.

use flockreel::jobs::IdSequence;
use flockreel::jobs::flock::dataset::job::Input;
use flockreel::jobs::worker::{Step, Worker};
use flockreel::store::footage::{Footage, VIDEO};
use flockreel::store::owners::{Account, Owner};
use flockreel_core::dataset::Params;
use flockreel_core::ids::LibraryId;
use reqwest::StatusCode;
use serde_json::{Value, json};
use uuid::Uuid;

use super::TestApp;
use super::app::json_of;
use super::clip::TINY;
use super::substitute::{done, with_script};

/// Addresses of a footage and of what was made from it.
pub(crate) struct Results {
    pub(crate) footage: String,
    pub(crate) library: String,
    pub(crate) flock: String,
    pub(crate) fish: String,
    pub(crate) analysis_job: String,
}

impl Results {
    /// Uploads a tiny film with this name, and makes one substitute result of each kind.
    pub(crate) async fn make(app: &TestApp, name: &str) -> Results {
        Results::of_film(app, name, &TINY).await
    }

    /// Like [`Results::make`], with another film.
    pub(crate) async fn of_film(app: &TestApp, name: &str, film: &[u8]) -> Results {
        let path = format!("/v1/footage?name={}", name.replace(' ', "%20"));
        let answer = app.post(&path).body(film.to_vec()).send().await.unwrap();
        let footage = id(&json_of(answer, StatusCode::CREATED).await["id"]);
        let body = json!({"footage_id": footage});
        let analysis = app.accept("/v1/analyses", body).await;
        let of_library = json!({"library_id": analysis["library_id"]});
        let flock = app.accept("/v1/flocks", of_library.clone()).await;
        let fish = app.accept("/v1/fish", of_library).await;
        let library = id(&analysis["library_id"]);
        work(app).await;
        Results {
            footage: format!("/v1/footage/{footage}"),
            library: format!("/v1/libraries/{library}"),
            flock: format!("/v1/flocks/{}", id(&flock["flock_id"])),
            fish: format!("/v1/fish/{}", id(&fish["fish_id"])),
            analysis_job: format!("/v1/jobs/{}", id(&analysis["job_id"])),
        }
    }
}

/// Makes a substitute data set of a library, which is one that substitutes made or a real one. Returns its address.
pub(crate) async fn dataset_of(app: &TestApp, library: &str) -> String {
    let library_ids = vec![LibraryId(library.parse().unwrap())];
    let input = Input {
        library_ids: library_ids.clone(),
        params: Params::default(),
        licence: None,
        source: None,
    };
    let account = Account {
        owner: app.owner.clone(),
        quota: None,
    };
    let (context, mut ids) = (&app.context, IdSequence::random());
    let queued = context.enqueue(&input, None, &account, &mut ids).await;
    let (_, id) = queued.unwrap();
    let summary = json!({"library_ids": library_ids, "flocks": 1, "pictures": 1, "licence": null, "source": null});
    let files = [("manifest.json", "{}"), ("entries", "PK")];
    let worker = Worker::new(with_script(context, &done(&files, &summary)));
    assert!(matches!(worker.step().await.unwrap(), Step::Done(_)));
    format!("/v1/datasets/{id}")
}

/// Stores a film without an upload, and so without a poster, as versions without posters did. Returns its id.
pub(crate) async fn store_film(app: &TestApp, film: &[u8], sample: bool) -> String {
    let store = &app.context.store;
    let draft = store.blobs().draft("film").unwrap();
    std::fs::write(draft.path().join(VIDEO), film).unwrap();
    let files = store.blobs().seal(&draft).unwrap();
    let id = Uuid::now_v7();
    let footage = Footage {
        id,
        owner: Owner::local(),
        folder: String::new(),
        sha256: files[0].sha256.clone(),
        background_sha256: Vec::new(),
        masks_sha256: Vec::new(),
        name: "film".into(),
        size_bytes: files[0].size_bytes,
        width: 320,
        height: 240,
        fps: 30.0,
        n_frames_hint: 300,
        sample,
        pinned: false,
        used_ms: 0,
        created_ms: 0,
    };
    let added = store.add_footage(footage, draft, &files, None);
    added.await.unwrap();
    id.to_string()
}

/// Returns the last part of an address.
pub(crate) fn id_in(address: &str) -> String {
    address.rsplit('/').next().unwrap().to_owned()
}

fn id(value: &Value) -> String {
    value.as_str().unwrap().to_owned()
}

/// Ends the three queued jobs, and that of the views, with substitute results.
async fn work(app: &TestApp) {
    let poses = "0,0.0\n".repeat(1000);
    for (name, summary) in [
        ("library.json", library_summary()),
        ("flock.json", flock_summary()),
        ("video.mp4", fish_summary()),
        ("film.mp4", json!({})),
    ] {
        let commands = done(&[(name, "{}"), ("poses.csv", &poses)], &summary);
        let worker = Worker::new(with_script(&app.context, &commands));
        assert!(matches!(worker.step().await.unwrap(), Step::Done(_)));
    }
}

fn library_summary() -> Value {
    json!({"fps": 25.0, "image_size_px": [64, 64], "view": "side", "n_frames": 10, "detected_share": 1.0,
        "n_transitions": 1, "component_share": 1.0, "clip_frames": 4, "length_px": null})
}

fn flock_summary() -> Value {
    json!({"fps": 25.0, "image_size_px": [64, 64], "count": 40, "frames": 240, "seed": 1})
}

fn fish_summary() -> Value {
    json!({"fps": 25.0, "image_size_px": [64, 64], "frames": 10, "visible_frames": 10})
}
