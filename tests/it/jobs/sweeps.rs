//! Removal of expired data, of folders without a row and of old data, while the service runs
//! (docs/explanation/promises.md, "No orphans" and "Limited space").

use std::fs::File;
use std::time::{Duration, Instant, SystemTime};

use flockreel::config::Retention;
use flockreel::jobs::clock::now_ms;
use flockreel::jobs::supervisor::Supervisor;
use flockreel::store::idempotency::{ANSWER_LIFETIME_MS, Answer, Begun, Scope};
use flockreel::store::owners::{Owner, OwnerFilter};
use flockreel::store::resources::{Property, ResourceKind};
use flockreel::store::upkeep::retention::Retired;
use flockreel::store::uploads::Upload;
use uuid::Uuid;

use crate::common::TestApp;
use crate::common::process::numbered_film;
use crate::common::results::{Results, id_in};

const HOUR: Duration = Duration::from_secs(3600);
/// Longest wait for something that happens beside the test. Free choice.
const MAX_WAIT: Duration = Duration::from_secs(60);
/// Milliseconds of a day.
const DAY_MS: i64 = 24 * 3600 * 1000;

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
    while app.n_uploads().await > 1 || old_folder.exists() {
        assert!(begun.elapsed() < Duration::from_secs(20), "nothing swept");
        tokio::time::sleep(Duration::from_millis(20)).await;
    }
    supervisor.drain().await;
    assert_eq!(app.n_uploads().await, 1);
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

/// A footage with a library, a flock and a virtual fish: kind and path of each.
struct Family([(ResourceKind, String); 4]);

impl Family {
    /// Makes a family that nobody has used for two days.
    async fn unused(app: &TestApp, number: usize) -> Family {
        let film = numbered_film(number);
        let made = Results::of_film(app, "film.mp4", &film).await;
        let family = Family([
            (ResourceKind::Footage, made.footage),
            (ResourceKind::Library, made.library),
            (ResourceKind::Flock, made.flock),
            (ResourceKind::Fish, made.fish),
        ]);
        for (kind, _) in &family.0 {
            family.record_use(app, *kind, now_ms() - 2 * DAY_MS).await;
        }
        family
    }

    fn id(&self, kind: ResourceKind) -> Uuid {
        let (_, path) = self.0.iter().find(|(known, _)| *known == kind).unwrap();
        id_in(path).parse().unwrap()
    }

    async fn record_use(&self, app: &TestApp, kind: ResourceKind, then_ms: i64) {
        let store = &app.context.store;
        store
            .record_use(kind, self.id(kind), then_ms)
            .await
            .unwrap();
    }

    async fn pin(&self, app: &TestApp, kind: ResourceKind) {
        let pin = [Property::Pinned(true)];
        let change = (app.context.store).change(kind, self.id(kind), &pin, &OwnerFilter::All);
        assert!(change.await.unwrap());
    }

    /// Returns the kinds of those that exist.
    async fn left(&self, app: &TestApp) -> Vec<ResourceKind> {
        let mut left = Vec::new();
        for (kind, path) in &self.0 {
            let (list, id) = path.rsplit_once('/').unwrap();
            let list = app.json(&format!("{list}?limit=200")).await;
            let mut items = list["items"].as_array().unwrap().iter();
            if items.any(|item| item["id"] == id) {
                left.push(*kind);
            }
        }
        left
    }
}

#[tokio::test]
async fn unused_resources_are_deleted_unless_something_that_stays_needs_them() {
    use ResourceKind::{Fish, Flock, Footage, Library};
    let app = TestApp::idle().await;
    let unused = Family::unused(&app, 0).await;
    let with_flock = Family::unused(&app, 1).await;
    with_flock.pin(&app, Flock).await;
    let with_fish = Family::unused(&app, 2).await;
    let recently_ms = now_ms() - DAY_MS / 2;
    with_fish.record_use(&app, Fish, recently_ms).await;
    let with_library = Family::unused(&app, 3).await;
    with_library.pin(&app, Library).await;
    let with_footage = Family::unused(&app, 4).await;
    with_footage.pin(&app, Footage).await;
    let with_jobs = [Family::unused(&app, 5).await, Family::unused(&app, 6).await];
    let ids = [with_jobs[0].id(Library), with_jobs[1].id(Footage)];
    let flock = serde_json::json!({"library_id": ids[0]});
    app.accept("/v1/flocks", flock).await;
    let analysis = serde_json::json!({"footage_id": ids[1]});
    app.accept("/v1/analyses", analysis).await;
    // A queued job alone keeps its input, also if that was used long ago.
    for (family, kind) in [(&with_jobs[0], Library), (&with_jobs[1], Footage)] {
        let begun = Instant::now();
        while used_ms(&app, kind, family.id(kind)).await < now_ms() - DAY_MS {
            assert!(begun.elapsed() < MAX_WAIT, "no use recorded");
            tokio::time::sleep(Duration::from_millis(5)).await;
        }
        family.record_use(&app, kind, 0).await;
    }
    let retention = Retention {
        keep_days: 1,
        keep_jobs_days: 0,
    };
    let retirable = app.context.store.retirable(retention, now_ms());
    let expected = retirable.await.unwrap();

    let mut context = app.context.clone();
    context.retention = retention;
    context.sweep_every = Duration::from_millis(20);
    let supervisor = Supervisor::start(context, 0);
    let begun = Instant::now();
    while with_jobs[1].left(&app).await.len() > 1 || !unused.left(&app).await.is_empty() {
        assert!(begun.elapsed() < MAX_WAIT, "nothing deleted");
        tokio::time::sleep(Duration::from_millis(20)).await;
    }
    supervisor.drain().await;
    for (family, left) in [
        (&with_flock, vec![Footage, Library, Flock]),
        (&with_fish, vec![Footage, Library, Fish]),
        (&with_library, vec![Footage, Library]),
        (&with_footage, vec![Footage]),
        (&with_jobs[0], vec![Footage, Library]),
        (&with_jobs[1], vec![Footage]),
    ] {
        assert_eq!(family.left(&app).await, left);
    }
    assert_counted(&app, &expected).await;
    app.assert_sound().await;
}

/// Asserts that the metrics count these deletions.
async fn assert_counted(app: &TestApp, retired: &Retired) {
    let metrics = app.get("/metrics").send().await.unwrap();
    let metrics = metrics.text().await.unwrap();
    for (kind, amount) in &retired.resources {
        let (noun, n) = (kind.plural(), amount.n);
        let line = format!("flockreel_retention_deletes_total{{noun=\"{noun}\"}} {n}\n");
        assert!(metrics.contains(&line), "{line}{metrics}");
    }
}

/// Returns the recorded use of a footage or library.
async fn used_ms(app: &TestApp, kind: ResourceKind, id: Uuid) -> i64 {
    use flockreel::store::{footage::Footage, resources::Library};
    let (store, owners) = (&app.context.store, &OwnerFilter::All);
    if kind == ResourceKind::Footage {
        let footage = store.resource::<Footage>(id, owners).await;
        footage.unwrap().unwrap().used_ms
    } else {
        let library = store.resource::<Library>(id, owners).await;
        library.unwrap().unwrap().used_ms
    }
}

#[tokio::test]
async fn old_jobs_without_a_result_are_deleted() {
    let app = TestApp::idle().await;
    let made = Results::make(&app, "film.mp4").await;
    let footage = serde_json::json!({"footage_id": id_in(&made.footage)});
    let analysis = app.accept("/v1/analyses", footage.clone()).await;
    let flock = serde_json::json!({"library_id": analysis["library_id"]});
    app.accept("/v1/flocks", flock).await;
    let path = format!("/v1/jobs/{}", analysis["job_id"].as_str().unwrap());
    assert_eq!(app.delete(&path).send().await.unwrap().status(), 200);
    app.accept("/v1/analyses", footage).await;
    let states = async || {
        let list = app.json("/v1/jobs").await;
        let jobs = list["items"].as_array().unwrap().iter();
        let states = jobs.map(|job| job["state"].as_str().unwrap().to_owned());
        states.collect::<Vec<_>>()
    };
    let done = vec!["done"; 4];
    let ended = [vec!["queued", "cancelled", "cancelled"], done.clone()].concat();
    assert_eq!(states().await, ended);
    let retention = Retention {
        keep_days: 0,
        keep_jobs_days: 30,
    };
    let store = &app.context.store;
    for (age_days, n_jobs) in [(29, 0), (31, 2), (31, 0)] {
        let later_ms = now_ms() + age_days * DAY_MS;
        let retirable = store.retirable(retention, later_ms).await.unwrap();
        let retired = store.retire(retention, later_ms).await.unwrap();
        assert_eq!((retirable.n_jobs, retired.n_jobs), (n_jobs, n_jobs));
    }
    assert_eq!(states().await, [vec!["queued"], done].concat());
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
