//! Removal of expired data and of folders without a row, while the service runs
//! (docs/explanation/promises.md, "No orphans").

use std::fs::File;
use std::time::{Duration, Instant, SystemTime};

use flockreel::jobs::clock::now_ms;
use flockreel::jobs::supervisor::Supervisor;
use flockreel::store::idempotency::{ANSWER_LIFETIME_MS, Answer, Begun, Scope};
use flockreel::store::owners::Owner;
use flockreel::store::uploads::Upload;
use uuid::Uuid;

use crate::common::TestApp;

const HOUR: Duration = Duration::from_secs(3600);

#[tokio::test]
async fn running_service_removes_only_expired_data() {
    let app = TestApp::idle().await;
    let kept = app.upload(&crate::common::clip::TINY).await;
    begin_upload(&app, now_ms() - 1).await;
    begin_upload(&app, now_ms() + 60_000).await;
    let (old, young) = (key("old"), key("young"));
    for (scope, then_ms) in [
        (&old, now_ms() - ANSWER_LIFETIME_MS),
        (&young, now_ms() - 1000),
    ] {
        answer_key(&app, scope, then_ms).await;
    }
    // Folders in a bucket cannot be backdated, so folders without a row are tested in local storage only.
    let is_local = app.folder().join("blobs").exists();
    let folders = is_local.then(|| [2 * HOUR, Duration::ZERO].map(|age| orphan(&app, age)));
    let [old_folder, young_folder] = folders.unwrap_or_default();

    let mut context = app.context.clone();
    context.sweep_every = Duration::from_millis(20);
    let supervisor = Supervisor::start(context, 0);
    let begun = Instant::now();
    while app.n_uploads() > 1 || old_folder.exists() {
        assert!(begun.elapsed() < Duration::from_secs(20), "nothing swept");
        tokio::time::sleep(Duration::from_millis(20)).await;
    }
    supervisor.drain().await;
    assert_eq!(app.n_uploads(), 1);
    // Look the keys up as of a time at which neither has expired: only the young one is still stored.
    let store = &app.context.store;
    let then_ms = now_ms() - ANSWER_LIFETIME_MS;
    let met = store.begin_key(&old, None, then_ms).await.unwrap();
    assert!(matches!(met, Begun::Run(_)), "{met:?}");
    let met = store.begin_key(&young, None, then_ms).await.unwrap();
    assert!(matches!(met, Begun::Done(_)), "{met:?}");
    if is_local {
        std::fs::remove_dir(&young_folder).unwrap();
    }
    app.json(&format!("/v1/footage/{kept}")).await;
    app.assert_sound().await;
}

async fn begin_upload(app: &TestApp, expires_ms: i64) {
    let upload = Upload {
        id: Uuid::now_v7(),
        owner: Owner::local(),
        name: "film".into(),
        size_bytes: 10,
        offset_bytes: 0,
        footage_id: None,
        expires_ms,
    };
    app.context.store.create_upload(&upload).await.unwrap();
}

fn key(key: &str) -> Scope {
    Scope {
        caller: String::new(),
        route: "/v1/fish".into(),
        key: key.into(),
    }
}

async fn answer_key(app: &TestApp, scope: &Scope, then_ms: i64) {
    let store = &app.context.store;
    store.begin_key(scope, None, then_ms).await.unwrap();
    let answer = Answer {
        body_sha256: vec![7; 32],
        status: 202,
        headers: "[]".into(),
        answer: b"{}".to_vec(),
    };
    store.finish_key(scope, &answer).await.unwrap();
}

/// Creates a folder without a row in local storage, last modified `age` ago.
fn orphan(app: &TestApp, age: Duration) -> std::path::PathBuf {
    let folder = app.folder().join("blobs/footage");
    let folder = folder.join(format!("{}.0", Uuid::now_v7()));
    std::fs::create_dir_all(&folder).unwrap();
    let open = File::open(&folder).unwrap();
    open.set_modified(SystemTime::now() - age).unwrap();
    folder
}
