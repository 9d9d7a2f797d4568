//! Upgrades: a data folder of every older schema, with data, opens and works (docs/explanation/promises.md, "Restore and
//! upgrade"). With the servers of scripts/with-servers.sh the database is PostgreSQL, else SQLite.

mod rows;

use std::borrow::Cow;
use std::path::Path;

use flockreel::api::signed;
use flockreel::jobs::clock::now_ms;
use flockreel::jobs::worker::{Step, Worker};
use flockreel::store::blobs::hex;
use flockreel::store::tokens::secret::Presented;
use reqwest::StatusCode;
use serde_json::{Value, json};
use sha2::{Digest, Sha256};
use sqlx::migrate::{MigrateDatabase, Migrator};
use sqlx::{Executor, PgPool, Postgres, Sqlite, SqlitePool};
use uuid::Uuid;

use crate::common::app::{code_of, json_of};
use crate::common::clip::TINY;
use crate::common::{Place, TestApp};
use rows::{FILES, FILM, LINK_KEY, RESULT, ROWS, TOKEN, UPLOADED};

static SQLITE: Migrator = sqlx::migrate!("migrations/sqlite");
static POSTGRES: Migrator = sqlx::migrate!("migrations/postgres");

const JPEG: &[u8] = b"\xff\xd8\xff a picture";
const COOKIE: &str = "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQ";
const BODY: &str = r#"{"library_id":"x"}"#;
const ANSWER: &str = r#"{"answered":true}"#;

/// Returns the migrations up to a schema.
fn until(all: &Migrator, schema: i64) -> Migrator {
    let kept = all.iter().filter(|one| one.version <= schema).cloned();
    Migrator {
        migrations: Cow::Owned(kept.collect()),
        ..Migrator::DEFAULT
    }
}

fn id(number: u128) -> Uuid {
    Uuid::from_u128(number)
}

/// Returns the text of rows in the form of an engine.
fn statement(rows: &str, is_postgres: bool) -> String {
    let bytes = |bytes: &[u8]| match is_postgres {
        true => format!("'\\x{}'::bytea", hex(bytes)),
        false => format!("x'{}'", hex(bytes)),
    };
    let secret = Presented::parse(TOKEN).expect("a token").sha256;
    let mut text = rows
        .replace("@now", &now_ms().to_string())
        .replace("@true", if is_postgres { "true" } else { "1" })
        .replace("@false", if is_postgres { "false" } else { "0" })
        .replace("#film", &bytes(&Sha256::digest(FILM)))
        .replace("#none", &bytes(b""))
        .replace("#secret", &bytes(&secret))
        .replace("#cookie", &bytes(&Sha256::digest(COOKIE)))
        .replace("#link_key", &bytes(&LINK_KEY))
        .replace("#body", &bytes(&Sha256::digest(BODY)))
        .replace("#answer", &bytes(ANSWER.as_bytes()))
        .replace("#jpeg", &bytes(JPEG))
        .replace("@uuid13", &id(13).to_string())
        .replace("@uuid1", &id(1).to_string());
    // The longest numbers come first, because shorter ones are parts of them.
    for number in (1..100).rev() {
        let literal = match is_postgres {
            true => format!("'{}'::uuid", id(number)),
            false => format!("x'{}'", id(number).simple()),
        };
        text = text.replace(&format!("@{number}"), &literal);
    }
    text
}

/// Returns all rows of a schema.
fn rows_of(schema: i64, is_postgres: bool) -> String {
    let hash = |bytes: &[u8]| hex(&Sha256::digest(bytes));
    let mut text = String::new();
    for (_, folder, name, bytes) in FILES.iter().filter(|file| file.0 <= schema) {
        let sha256 = match is_postgres {
            true => format!("'\\x{}'::bytea", hash(bytes)),
            false => format!("x'{}'", hash(bytes)),
        };
        let (folder, size) = (stored_folder(folder), bytes.len());
        text += &format!("insert into blobs values ('{folder}', '{name}', {size}, {sha256});\n");
    }
    for (_, rows) in ROWS.iter().filter(|rows| rows.0 <= schema) {
        let mut rows = statement(rows, is_postgres);
        for (_, folder, ..) in FILES {
            rows = rows.replace(
                &format!("'{folder}'"),
                &format!("'{}'", stored_folder(folder)),
            );
        }
        text += &rows;
    }
    text
}

/// Returns the folder of a stored thing: its kind and its id.
fn stored_folder(folder: &str) -> String {
    let (kind, number) = folder.split_once('/').unwrap();
    format!("{kind}/{}", id(number.parse().unwrap()))
}

/// Writes a data folder of a schema, and a database if the place names one.
async fn write(place: &Place, schema: i64) {
    let data = place.data();
    for (_, folder, name, bytes) in FILES.iter().filter(|file| file.0 <= schema) {
        let folder = data.join("blobs").join(stored_folder(folder));
        std::fs::create_dir_all(&folder).unwrap();
        std::fs::write(folder.join(name), bytes).unwrap();
    }
    if schema >= 11 {
        std::fs::create_dir_all(data.join("uploads")).unwrap();
        std::fs::write(data.join("uploads").join(id(50).to_string()), UPLOADED).unwrap();
    }
    match place.database() {
        Some(url) => {
            Postgres::create_database(url).await.unwrap();
            let pool = PgPool::connect(url).await.unwrap();
            until(&POSTGRES, schema).run(&pool).await.unwrap();
            pool.execute(sqlx::raw_sql(sqlx::AssertSqlSafe(rows_of(schema, true))))
                .await
                .unwrap();
            pool.close().await;
        }
        None => write_sqlite(&data.join("flockreel.db"), schema).await,
    }
}

async fn write_sqlite(file: &Path, schema: i64) {
    let url = format!("sqlite:{}", file.display());
    Sqlite::create_database(&url).await.unwrap();
    let pool = SqlitePool::connect(&url).await.unwrap();
    until(&SQLITE, schema).run(&pool).await.unwrap();
    let rows = sqlx::raw_sql(sqlx::AssertSqlSafe(rows_of(schema, false)));
    pool.execute(rows).await.unwrap();
    pool.close().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn data_of_every_older_schema_opens_and_works() {
    let schemas: Vec<i64> = SQLITE.iter().map(|one| one.version).collect();
    assert!(schemas.len() >= 12, "the migrations are missing");
    for schema in schemas {
        eprintln!("schema {schema}"); // names the schema of a failure
        let place = Place::with_files_in_folder();
        write(&place, schema).await;
        let app = TestApp::on(place, &[]).await;
        assert_results_are_served(&app, schema).await;
        assert_owners_have_their_things(&app, schema).await;
        assert_requests_go_on(&app, schema).await;
        assert_queue_goes_on(&app, schema).await;
        app.assert_sound().await;
    }
}

/// Lists show the old rows, and downloads have the old bytes.
async fn assert_results_are_served(app: &TestApp, schema: i64) {
    // Older versions stored the film with the library.
    let film = if schema < 19 { RESULT } else { FILM };
    for (since, list, number, file, bytes) in [
        (2, "footage", 1, "file", FILM),
        (4, "libraries", 13, "library.json", RESULT),
        (4, "libraries", 13, "film.mp4", film),
        (4, "flocks", 15, "flock.json", RESULT),
        (4, "fish", 17, "video.mp4", RESULT),
        (12, "footage", 3, "file", FILM),
        (13, "footage", 4, "file", FILM),
        (21, "datasets", 80, "manifest.json", RESULT),
    ] {
        if since > schema {
            continue;
        }
        let items = app.json(&format!("/v1/{list}")).await["items"].clone();
        let item = items
            .as_array()
            .unwrap()
            .iter()
            .find(|item| item["id"] == id(number).to_string());
        assert!(item.is_some(), "{list} {number}: {items}");
        let path = format!("/v1/{list}/{}/{file}", id(number));
        let answer = app.get(&path).send().await.unwrap();
        assert_eq!(answer.status(), 200, "{path}");
        assert_eq!(answer.bytes().await.unwrap(), bytes, "{path}");
    }
    if schema >= 3 {
        let job = app.json(&format!("/v1/jobs/{}", id(21))).await;
        assert_eq!(
            (&job["state"], &job["error"]["code"]),
            (&json!("failed"), &json!("nothing_moves")),
            "{job}"
        );
    }
    if schema >= 14 {
        let path = format!("/v1/jobs/{}/refused.jpg", id(21));
        let answer = app.get(&path).send().await.unwrap();
        assert_eq!(answer.bytes().await.unwrap(), JPEG);
    }
    if schema >= 20 {
        let job = app.json(&format!("/v1/jobs/{}", id(21))).await;
        assert_eq!(job["error"]["mends"], json!([]), "{job}");
    }
}

/// Rows before owners belong to local requests. Tokens and sessions give access to the things of their owner only.
async fn assert_owners_have_their_things(app: &TestApp, schema: i64) {
    let of_ann = format!("/v1/footage/{}", id(2));
    let job_of_ann = format!("/v1/jobs/{}", id(24));
    for path in [&of_ann, &job_of_ann] {
        let local = app.get(path).send().await.unwrap();
        assert_eq!(code_of(local, 404).await, "not_found");
    }
    if schema < 6 {
        return;
    }
    for (name, value) in [
        ("authorization", format!("Bearer {TOKEN}")),
        ("cookie", format!("flockreel_session={COOKIE}")),
    ] {
        let with = async |path: &str| app.get(path).header(name, &value).send().await.unwrap();
        let footage: Value = json_of(with(&of_ann).await, StatusCode::OK).await;
        assert_eq!(footage["name"], "film of ann");
        assert_eq!(with(&job_of_ann).await.status(), 200);
        let foreign = with(&format!("/v1/footage/{}", id(1))).await;
        assert_eq!(code_of(foreign, 404).await, "not_found");
    }
}

/// A signed link opens its file, a stored answer is given again, and an upload continues at its offset.
async fn assert_requests_go_on(app: &TestApp, schema: i64) {
    if schema >= 7 {
        let path = format!("/v1/flocks/{}/flock.json", id(15));
        let link = signed(&LINK_KEY, &path, now_ms() / 1000 + 60);
        let answer = app.get(&link).send().await.unwrap();
        assert_eq!(answer.bytes().await.unwrap(), RESULT);
        assert_eq!(app.context.store.signing_key().await.unwrap(), LINK_KEY);
    }
    if schema >= 10 {
        let request = app.post("/v1/fish").header("idempotency-key", "old");
        let request = request
            .header("content-type", "application/json")
            .body(BODY);
        let answer = request.send().await.unwrap();
        assert_eq!(answer.status(), 202);
        assert_eq!(answer.text().await.unwrap(), ANSWER);
    }
    if schema >= 11 {
        let path = format!("/v1/uploads/{}", id(50));
        let answer = app
            .head(&path)
            .header("tus-resumable", "1.0.0")
            .send()
            .await
            .unwrap();
        assert_eq!(
            answer.headers()["upload-offset"],
            UPLOADED.len().to_string()
        );
    }
}

/// Queued jobs run, the job of a dead worker returns to the queue, and new things are stored beside the old ones.
async fn assert_queue_goes_on(app: &TestApp, schema: i64) {
    // A process that shares its database watches a lease before it ends it. The others did so at their start.
    app.context.store.rescue_all(now_ms()).await.unwrap();
    let worker = Worker::new(app.context.clone());
    let mut ended = Vec::new();
    let is_busy = |step: &Step| !matches!(step, Step::Idle);
    while let Some(step) = Some(worker.step().await.unwrap()).filter(is_busy) {
        ended.push(step);
    }
    let n_waiting = if schema >= 3 { 2 } else { 0 };
    assert_eq!(ended.len(), n_waiting, "{ended:?}");
    if schema >= 3 {
        for number in [20, 23] {
            // The old film is no film, so its analysis fails, with the reason.
            let job = app.json(&format!("/v1/jobs/{}", id(number))).await;
            assert_eq!(job["state"], "failed", "{job}");
            assert_eq!(job["error"]["code"], "not_a_video", "{job}");
        }
    }
    let footage = app.upload(&TINY).await;
    let accepted = app
        .accept("/v1/analyses", json!({"footage_id": footage}))
        .await;
    let path = format!("/v1/jobs/{}", accepted["job_id"].as_str().unwrap());
    assert_eq!(app.delete(&path).send().await.unwrap().status(), 200);
    if schema >= 4 {
        for path in ["flocks/15", "fish/17", "libraries/13", "footage/1"] {
            let path = format!("/v1/{}", stored_folder(path));
            assert_eq!(
                app.delete(&path).send().await.unwrap().status(),
                204,
                "{path}"
            );
        }
    }
}
