//! `backup`, `check`, `gc` and the settings file, run with the real program (docs/explanation/promises.md,
//! "Restore and upgrade").

use std::path::Path;
use std::process::{Command, Output};
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::{Arc, Mutex};

use flockreel::store::Store;
use flockreel::store::resources::ResourceKind;
use serde_json::{Value, json};

use crate::common::client;
use crate::common::film::Films;
use crate::common::process::{Server, numbered_film};
use crate::common::results::id_in;

fn flockreel(arguments: &[&str], folder: &Path) -> Output {
    Command::new(env!("CARGO_BIN_EXE_flockreel"))
        .args(arguments)
        .current_dir(folder)
        .output()
        .expect("the program starts")
}

fn said(done: &Output) -> String {
    String::from_utf8_lossy(&done.stderr).into_owned()
}

async fn json_at(url: String) -> Value {
    let answer = client().get(url).send().await.unwrap();
    answer.json().await.unwrap()
}

/// Ids of films that were stored and not deleted.
type Kept = Arc<Mutex<Vec<String>>>;

/// Uploads films and queues their analyses until `stop` is set. Deletes every third film.
async fn write_on(base: String, next: Arc<AtomicUsize>, stop: Arc<AtomicBool>, kept: Kept) {
    let client = client();
    while !stop.load(Ordering::Relaxed) {
        let number = next.fetch_add(1, Ordering::Relaxed);
        let sent = client
            .post(format!("{base}/v1/footage"))
            .body(numbered_film(number))
            .send();
        let footage: Value = sent.await.unwrap().json().await.unwrap();
        let id = footage["id"].as_str().unwrap();
        let wish = json!({"footage_id": id});
        let analysis = client.post(format!("{base}/v1/analyses")).json(&wish);
        assert_eq!(analysis.send().await.unwrap().status(), 202);
        if number.is_multiple_of(3) {
            let gone = client.delete(format!("{base}/v1/footage/{id}")).send();
            assert_eq!(gone.await.unwrap().status(), 204);
        } else {
            kept.lock().unwrap().push(id.to_owned());
        }
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn backup_during_writes_is_a_complete_service() {
    let films = Films::new();
    let server = Server::start(&films.path("data"));
    let (next, stop) = (Arc::default(), Arc::new(AtomicBool::new(false)));
    let kept = Kept::default();
    let writers: Vec<_> = (0..3)
        .map(|_| {
            tokio::spawn(write_on(
                server.base.clone(),
                Arc::clone(&next),
                stop.clone(),
                kept.clone(),
            ))
        })
        .collect();
    while next.load(Ordering::Relaxed) < 12 {
        tokio::time::sleep(std::time::Duration::from_millis(20)).await;
    }
    let before = kept.lock().unwrap().clone();
    let folder = films.folder().to_owned();
    let arguments = ["backup", "copy", "--data", "data", "--json"];
    let (again, folder_2) = (arguments, folder.clone());
    let done = tokio::task::spawn_blocking(move || flockreel(&arguments, &folder))
        .await
        .unwrap();
    stop.store(true, Ordering::Relaxed);
    assert_eq!(done.status.code(), Some(0), "{}", said(&done));
    let copied: Value = serde_json::from_slice(&done.stdout).unwrap();
    assert!(copied["files"].as_u64().unwrap() >= 4, "{copied}");
    assert_eq!(
        flockreel(&again, &folder_2).status.code(),
        Some(2),
        "it is there already"
    );
    for writer in writers {
        writer.await.unwrap();
    }
    let check = flockreel(&["check", "--data", "data"], films.folder());
    assert_eq!(
        check.status.code(),
        Some(0),
        "beside the service: {}",
        said(&check)
    );
    drop(server);

    let check = flockreel(&["check", "--data", "copy", "--json"], films.folder());
    assert_eq!(check.status.code(), Some(0), "{}", said(&check));
    assert!(!films.path("copy.partial").exists());
    let restored = Server::start(&films.path("copy"));
    let n_films = copied["files"].as_u64().unwrap() / 2; // each film has a poster
    let stored = every_film_is_whole(&restored.base, n_films).await;
    let lost: Vec<_> = before.iter().filter(|id| !stored.contains(id)).collect();
    assert!(lost.is_empty(), "stored before the backup: {lost:?}");
    let ended = client().post(format!("{}/v1/footage", restored.base));
    let ended = ended.body(numbered_film(100_000)).send().await.unwrap();
    assert_eq!(ended.status(), 201, "it goes on");
}

/// Asserts that `n_films` films are listed and that each is served with the bytes of its hash. Returns their
/// ids.
async fn every_film_is_whole(base: &str, n_films: u64) -> Vec<String> {
    let items = json_at(format!("{}/v1/footage?limit=200", base)).await["items"].clone();
    let items = items.as_array().unwrap().clone();
    assert_eq!(items.len() as u64, n_films);
    for footage in &items {
        let path = format!(
            "{}/v1/footage/{}/file",
            base,
            footage["id"].as_str().unwrap()
        );
        let answer = client().get(path).send().await.unwrap();
        let etag = answer.headers()["etag"].to_str().unwrap().to_owned();
        let bytes = answer.bytes().await.unwrap();
        assert_eq!(
            etag.trim_matches('"'),
            crate::common::process::sha256(&bytes)
        );
        assert_eq!(footage["sha256"], etag.trim_matches('"'));
    }
    let ids = items.iter().map(|footage| footage["id"].as_str().unwrap());
    ids.map(str::to_owned).collect()
}

#[tokio::test(flavor = "multi_thread")]
async fn check_names_faults_and_gc_removes_orphans() {
    let films = Films::new();
    let server = Server::start(&films.path("data"));
    let sent = client().post(format!("{}/v1/footage", server.base));
    let footage: Value = sent
        .body(numbered_film(1))
        .send()
        .await
        .unwrap()
        .json()
        .await
        .unwrap();
    assert_eq!(server.terminate(), Some(0));
    let run = |line: &str| flockreel(&line.split(' ').collect::<Vec<_>>(), films.folder());
    assert_eq!(run("check --data data").status.code(), Some(0));

    std::fs::create_dir(films.path("data/tmp/left")).unwrap();
    std::fs::write(films.path("data/tmp/left/video"), b"12345").unwrap();
    for dry in [true, false, false] {
        let line = format!(
            "gc --data data --json{}",
            if dry { " --dry-run" } else { "" }
        );
        let done: Value = serde_json::from_slice(&run(&line).stdout).unwrap();
        assert_eq!(done["dry_run"], dry);
        let was_there = films.path("data/tmp/left").exists() || done["drafts"] == 1;
        assert_eq!(done["bytes"], if was_there { 5 } else { 0 }, "{done}");
    }
    assert!(!films.path("data/tmp/left").exists());

    let folder = films.path("data/blobs/footage");
    let folder = std::fs::read_dir(folder)
        .unwrap()
        .next()
        .unwrap()
        .unwrap()
        .path();
    std::fs::write(folder.join("video"), b"another").unwrap();
    let check = run("check --data data");
    assert_eq!(check.status.code(), Some(1), "{}", said(&check));
    let altered = format!("I1: altered: footage/{}", footage["id"].as_str().unwrap());
    assert!(said(&check).contains(&altered), "{}", said(&check));
    assert_no_copy_is_made(&films);
    std::fs::remove_file(folder.join("video")).unwrap();
    assert_no_copy_is_made(&films);
    for command in ["check", "gc", "backup copy"] {
        let absent = run(&format!("{command} --data nowhere"));
        assert_eq!(
            absent.status.code(),
            Some(2),
            "{command}: {}",
            said(&absent)
        );
    }
}

/// Asserts that damaged or missing files are not backed up.
fn assert_no_copy_is_made(films: &Films) {
    let backup = flockreel(&["backup", "copy", "--data", "data"], films.folder());
    assert_eq!(backup.status.code(), Some(1), "{}", said(&backup));
    assert!(!films.path("copy").exists());
}

#[tokio::test(flavor = "multi_thread")]
async fn gc_deletes_what_is_older_than_its_settings_allow() {
    let films = Films::new();
    let server = Server::start(&films.path("data"));
    let mut paths = Vec::new();
    for number in 0..2 {
        let footage: Value = server
            .upload(numbered_film(number))
            .await
            .json()
            .await
            .unwrap();
        paths.push(format!("/v1/footage/{}", footage["id"].as_str().unwrap()));
    }
    let pin = client().patch(format!("{}{}", server.base, paths[1]));
    let pinned = pin.json(&json!({"pinned": true})).send().await.unwrap();
    assert_eq!(pinned.status(), 200);
    let store = Store::open_beside(&films.path("data")).await.unwrap();
    for path in &paths {
        let id = id_in(path).parse().unwrap();
        let used = store.record_use(ResourceKind::Footage, id, 0);
        used.await.unwrap();
    }
    store.close().await;
    let gc = |flags: &str| {
        let line = format!("gc --data data --json{flags}");
        let done = flockreel(&line.split(' ').collect::<Vec<_>>(), films.folder());
        serde_json::from_slice::<Value>(&done.stdout).unwrap()["unused"].clone()
    };
    let counts = [
        "",
        " --keep-days 9 --dry-run",
        " --keep-days 9",
        " --keep-days 9",
    ]
    .map(gc);
    assert_eq!(counts, [0, 1, 1, 0]);
    let statuses = [
        server.get(&paths[0]).await.status(),
        server.get(&paths[1]).await.status(),
    ];
    assert_eq!(statuses, [404, 200]);
    assert_eq!(server.terminate(), Some(0));
}

#[tokio::test(flavor = "multi_thread")]
async fn gc_keeps_unfinished_uploads_of_a_running_service() {
    let films = Films::new();
    let server = Server::start(&films.path("data"));
    let film = numbered_film(1);
    let (first, second) = film.split_at(film.len() / 2);
    let (first, second) = (first.to_vec(), second.to_vec());
    let folder = films.folder().to_owned();
    // Between the two halves of the upload, `gc` runs.
    let rest = async move {
        let gc = move || {
            let is_received =
                |tmp: std::io::Result<std::fs::ReadDir>| tmp.unwrap().next().is_some();
            while !is_received(std::fs::read_dir(folder.join("data/tmp"))) {
                std::thread::sleep(std::time::Duration::from_millis(5));
            }
            flockreel(&["gc", "--data", "data", "--json"], &folder)
        };
        let done = tokio::task::spawn_blocking(gc).await.unwrap();
        let removed: Value = serde_json::from_slice(&done.stdout).unwrap();
        assert_eq!(removed["drafts"], 0, "{removed}");
        Ok::<_, std::io::Error>(second)
    };
    let first = futures_util::stream::once(async move { Ok(first) });
    let halves = futures_util::StreamExt::chain(first, futures_util::stream::once(rest));
    let sent = client().post(format!("{}/v1/footage", server.base));
    let answer = sent.body(reqwest::Body::wrap_stream(halves)).send().await;
    assert_eq!(answer.unwrap().status(), 201);
}

#[tokio::test(flavor = "multi_thread")]
async fn flags_override_environment_file_and_defaults() {
    let films = Films::new();
    films.write(
        "settings.toml",
        "max-upload-bytes = 111\nrate = 7\nno-sample = true\n",
    );
    let file = films.path("settings.toml");
    let largest = async |flags: &[&str], variables: &[(&str, &str)]| {
        let server = Server::start_in(&films.path("data"), flags, variables);
        let url = format!("{}/v1/uploads", server.base);
        let answer = client()
            .request(reqwest::Method::OPTIONS, url)
            .send()
            .await
            .unwrap();
        let max_bytes = answer.headers()["tus-max-size"]
            .to_str()
            .unwrap()
            .to_owned();
        assert_eq!(server.terminate(), Some(0));
        max_bytes
    };
    let config = ["--config", file.to_str().unwrap()];
    let variable = [("FLOCKREEL_MAX_UPLOAD_BYTES", "222")];
    assert_eq!(largest(&[], &[]).await, "4294967296");
    assert_eq!(largest(&config, &[]).await, "111");
    let named = [("FLOCKREEL_CONFIG", file.to_str().unwrap())];
    assert_eq!(largest(&[], &named).await, "111");
    assert_eq!(largest(&config, &variable).await, "222");
    let flag = [&config[..], &["--max-upload-bytes", "333"]].concat();
    assert_eq!(largest(&flag, &variable).await, "333");

    films.write("settings.toml", "rat = 7\n");
    let done = flockreel(&["serve", "--config", "settings.toml"], films.folder());
    assert_eq!(done.status.code(), Some(2));
    assert_eq!(
        said(&done),
        "flockreel: the setting rat is unknown, in: settings.toml\n"
    );
}
