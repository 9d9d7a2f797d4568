//! Isolation of owners (docs/explanation/promises.md, "Owners are isolated"). For every operation of the
//! OpenAPI document and an id of every kind, a stranger gets the response to a random id. The test fails if
//! an operation is missing from its table.

use flockreel::api::signed;
use flockreel::store::tokens::Scope;
use flockreel_core::formats::picture::write_rgb;
use flockreel_core::raster::RgbImage;
use reqwest::multipart::{Form, Part};
use reqwest::{Method, StatusCode};
use serde_json::{Value, json};
use uuid::Uuid;

use crate::common::TestApp;
use crate::common::app::{json_of, routes};
use crate::common::clip::TINY;
use crate::common::results::{Results, dataset_of, id_in};

/// How an operation accesses owned objects.
enum Touch {
    /// By an id of this kind in its path.
    Path(&'static str),
    /// By an id in its body: field name and kind.
    Body(&'static str, &'static str),
    /// It lists the objects of the caller.
    List,
    /// It accesses none.
    Nothing,
}

/// All operations. Those that delete come last, so that the others still find the owner's objects.
fn table() -> Vec<(&'static str, &'static str, Touch)> {
    of_datasets().into_iter().chain(of_the_rest()).collect()
}

fn of_datasets() -> Vec<(&'static str, &'static str, Touch)> {
    use Touch::{Body, List, Path};
    vec![
        ("GET", "/v1/datasets", List),
        ("GET", "/v1/datasets/{id}", Path("datasets")),
        ("GET", "/v1/datasets/{id}/{file}", Path("datasets")),
        ("PATCH", "/v1/datasets/{id}", Path("datasets")),
        ("POST", "/v1/datasets", Body("library_ids", "libraries")),
        (
            "POST",
            "/v1/datasets/estimate",
            Body("library_ids", "libraries"),
        ),
        (
            "POST",
            "/v1/datasets/preview",
            Body("library_ids", "libraries"),
        ),
        ("DELETE", "/v1/datasets/{id}", Path("datasets")),
    ]
}

fn of_the_rest() -> Vec<(&'static str, &'static str, Touch)> {
    use Touch::{Body, List, Nothing, Path};
    vec![
        ("GET", "/v1/footage", List),
        ("GET", "/v1/footage/{id}", Path("footage")),
        ("GET", "/v1/footage/{id}/file", Path("footage")),
        ("GET", "/v1/footage/{id}/poster.jpg", Path("footage")),
        ("PATCH", "/v1/footage/{id}", Path("footage")),
        ("PATCH", "/v1/libraries/{id}", Path("libraries")),
        ("PATCH", "/v1/flocks/{id}", Path("flocks")),
        ("PATCH", "/v1/fish/{id}", Path("fish")),
        ("GET", "/v1/libraries", List),
        ("GET", "/v1/libraries/{id}", Path("libraries")),
        ("GET", "/v1/libraries/{id}/{file}", Path("libraries")),
        ("GET", "/v1/flocks", List),
        ("GET", "/v1/flocks/{id}", Path("flocks")),
        ("GET", "/v1/flocks/{id}/{file}", Path("flocks")),
        ("GET", "/v1/flocks/{id}/school.glb", Path("flocks")),
        ("GET", "/v1/fish", List),
        ("GET", "/v1/fish/{id}", Path("fish")),
        ("GET", "/v1/fish/{id}/{file}", Path("fish")),
        ("GET", "/v1/jobs", List),
        ("GET", "/v1/jobs/{id}", Path("jobs")),
        ("GET", "/v1/jobs/{id}/events", Path("jobs")),
        ("POST", "/v1/jobs/{id}/retry", Path("jobs")),
        ("POST", "/v1/analyses", Body("footage_id", "footage")),
        (
            "POST",
            "/v1/analyses/preview",
            Body("footage_id", "footage"),
        ),
        ("POST", "/v1/footage/{id}/variants", Path("footage")),
        ("POST", "/v1/flocks", Body("library_id", "libraries")),
        (
            "POST",
            "/v1/flocks/preview",
            Body("library_id", "libraries"),
        ),
        ("POST", "/v1/fish", Body("library_id", "libraries")),
        ("POST", "/v1/flocks/{id}/links", Path("flocks")),
        ("HEAD", "/v1/uploads/{id}", Path("uploads")),
        ("PATCH", "/v1/uploads/{id}", Path("uploads")),
        ("DELETE", "/v1/jobs/{id}", Path("jobs")),
        ("DELETE", "/v1/uploads/{id}", Path("uploads")),
        ("DELETE", "/v1/flocks/{id}", Path("flocks")),
        ("DELETE", "/v1/fish/{id}", Path("fish")),
        ("DELETE", "/v1/libraries/{id}", Path("libraries")),
        ("DELETE", "/v1/footage/{id}", Path("footage")),
        ("GET", "/v1/jobs/{id}/refused.jpg", Nothing), // only for failed jobs: tests/it/api/jobs.rs
        ("GET", "/v1/events", Nothing), // an endless stream of the caller's jobs: tests/it/api/events.rs
        ("POST", "/v1/footage", Nothing),
        ("POST", "/v1/uploads", Nothing),
        ("OPTIONS", "/v1/uploads", Nothing),
        ("GET", "/v1/usage", Nothing), // of the caller's owner: tests/it/api/quota.rs
        ("GET", "/v1/errors", Nothing),
        ("POST", "/v1/session", Nothing),
        ("DELETE", "/v1/session", Nothing),
        ("GET", "/healthz", Nothing),
        ("GET", "/readyz", Nothing),
        ("GET", "/metrics", Nothing), // of all owners, for administrators: tests/it/api/metrics.rs
    ]
}

/// Returns the name of a file that the substitute results of this kind have.
fn file_of(kind: &str) -> &'static str {
    match kind {
        "libraries" => "library.json",
        "flocks" => "flock.json",
        "datasets" => "dataset.zip",
        _ => "video.mp4",
    }
}

/// Creates one object of every kind for the signed-in owner, with substitute results. Returns kinds and ids.
async fn belongings(app: &TestApp) -> Vec<(&'static str, String)> {
    let results = Results::make(app, "film.mp4").await;
    let dataset = dataset_of(app, &id_in(&results.library)).await;
    let upload = (app.post("/v1/uploads").header("tus-resumable", "1.0.0"))
        .header("upload-length", 9)
        .send();
    let upload = upload.await.unwrap().headers()["location"].clone();
    vec![
        ("uploads", id_in(upload.to_str().unwrap())),
        ("footage", id_in(&results.footage)),
        ("libraries", id_in(&results.library)),
        ("flocks", id_in(&results.flock)),
        ("fish", id_in(&results.fish)),
        ("datasets", id_in(&dataset)),
        ("jobs", id_in(&results.analysis_job)),
    ]
}

/// Calls an operation with an id. Returns the status, and the body with the id replaced by `ID`.
async fn response_of(
    app: &TestApp,
    call: (&str, &str, &Touch),
    kind: &str,
    id: &str,
) -> (u16, String) {
    let (method, path, touch) = call;
    let path = path.replace("{id}", id).replace("{file}", file_of(kind));
    let request = app.request(method.parse::<Method>().unwrap(), &path);
    let request = match touch {
        Touch::Body(name @ "library_ids", _) => request.json(&json!({ *name: [id] })),
        Touch::Body(name, _) => request.json(&json!({ *name: id })),
        Touch::Path(_) if path.ends_with("/variants") => {
            let picture = write_rgb(&RgbImage::new(64, 64));
            request.multipart(Form::new().part("background", Part::bytes(picture)))
        }
        Touch::Path(_) if method == "POST" => request.json(&json!({})),
        Touch::Path("footage") if method == "PATCH" => request.json(&json!({"name": "x.mp4"})),
        Touch::Path("libraries" | "flocks" | "fish" | "datasets") if method == "PATCH" => {
            request.json(&json!({"pinned": true}))
        }
        _ => request,
    };
    let request = match kind {
        "uploads" => (request.header("tus-resumable", "1.0.0"))
            .header("upload-offset", 0)
            .header("content-type", "application/offset+octet-stream"),
        _ => request,
    };
    let answer = request.send().await.unwrap();
    let status = answer.status().as_u16();
    (status, answer.text().await.unwrap().replace(id, "ID"))
}

#[tokio::test]
async fn table_covers_every_operation_of_the_document() {
    let app = TestApp::idle().await;
    let mut of_document = routes(&app.json("/openapi.json").await);
    let mut of_table: Vec<(Method, String)> = (table().iter())
        .map(|(method, path, _)| (method.parse().unwrap(), (*path).to_owned()))
        .collect();
    for calls in [&mut of_document, &mut of_table] {
        calls.sort_by_key(|(method, path)| (path.clone(), method.to_string()));
    }
    assert_eq!(
        of_table, of_document,
        "left: this test's table; right: the document"
    );
    app.assert_sound().await;
}

#[tokio::test]
async fn foreign_id_gives_the_response_to_a_random_id() {
    let mut app = TestApp::start(&["--auth", "required"]).await;
    let (owner, stranger) = (
        app.token(Scope::Write, 9).await,
        app.token(Scope::Write, 9).await,
    );
    let admin = app.token(Scope::Admin, 9).await;
    app.sign_in(&owner);
    let mut things = belongings(&app).await;
    // The library of a queued job has an id before it exists.
    let (_, footage) = things.iter().find(|(kind, _)| *kind == "footage").unwrap();
    let request = json!({"footage_id": footage});
    let queued = app.accept("/v1/analyses", request).await;
    things.push(("queued", queued["library_id"].as_str().unwrap().to_owned()));
    for (method, path, touch) in &table() {
        let call = (*method, *path, touch);
        let (Touch::Path(wanted) | Touch::Body(_, wanted)) = touch else {
            continue;
        };
        app.sign_in(&stranger);
        for (kind, id) in &things {
            let random = Uuid::now_v7().to_string();
            let of_foreign_id = response_of(&app, call, wanted, id).await;
            assert!(
                matches!(of_foreign_id.0, 404 | 422),
                "{method} {path} {kind}"
            );
            assert_eq!(
                of_foreign_id,
                response_of(&app, call, wanted, &random).await,
                "{method} {path} {kind}"
            );
        }
        let (_, own) = things.iter().find(|(kind, _)| kind == wanted).unwrap();
        for allowed in [&owner, &admin] {
            app.sign_in(allowed);
            let (status, body) = response_of(&app, call, wanted, own).await;
            // An object that the owner deleted is gone for the administrator too.
            let is_gone = *method == "DELETE" && allowed == &admin && status == 404;
            // A substitute library cannot be read.
            let is_drawn = *path == "/v1/flocks/preview" || path.starts_with("/v1/datasets");
            let is_computed = is_drawn && method == &"POST" || path.ends_with("/school.glb");
            let is_substitute = is_computed && status == 500;
            assert!(
                status < 300 || status == 409 || is_gone || is_substitute,
                "{method} {path}: {status} {body}"
            );
        }
    }
    app.assert_sound().await;
}

#[tokio::test]
async fn lists_show_own_objects_and_to_administrators_all() {
    let mut app = TestApp::start(&["--auth", "required"]).await;
    let (owner, stranger) = (
        app.token(Scope::Write, 9).await,
        app.token(Scope::Read, 9).await,
    );
    let admin = app.token(Scope::Admin, 9).await;
    app.sign_in(&owner);
    belongings(&app).await;
    for (_, path, _) in table()
        .iter()
        .filter(|(_, _, touch)| matches!(touch, Touch::List))
    {
        let mut counts = Vec::new();
        for token in [&owner, &stranger, &admin] {
            app.sign_in(token);
            counts.push(app.json(path).await["items"].as_array().unwrap().len());
        }
        assert!(counts[0] > 0, "{path}");
        assert_eq!(counts, [counts[0], 0, counts[0]], "{path}");
    }
    app.assert_sound().await;
}

#[tokio::test]
async fn signed_link_opens_one_file_until_it_expires() {
    let mut app = TestApp::start(&["--auth", "required"]).await;
    let owner = app.token(Scope::Write, 9).await;
    app.sign_in(&owner);
    let things = belongings(&app).await;
    let flock = &things.iter().find(|(kind, _)| *kind == "flocks").unwrap().1;
    let path = format!("/v1/flocks/{flock}");
    let ask = |request: Value| app.post(&format!("{path}/links")).json(&request).send();
    let made = ask(json!({"file": "flock.json", "expires_s": 60}))
        .await
        .unwrap();
    let url = json_of(made, StatusCode::CREATED).await["url"]
        .as_str()
        .unwrap()
        .to_owned();
    for (request, status) in [
        (json!({"file": "lock"}), 404),
        (json!({"expires_s": 1}), 422),
    ] {
        assert_eq!(ask(request).await.unwrap().status(), status);
    }
    app.sign_out();
    let file = app.get(&url).send().await.unwrap();
    assert_eq!(file.text().await.unwrap(), "{}");
    let (_, query) = url.split_once('?').unwrap();
    let (_, signature) = query.split_once("&signature=").unwrap();
    let earlier = signed(
        &app.context.store.signing_key().await.unwrap(),
        &format!("{path}/flock.json"),
        1,
    );
    for closed in [
        format!("{path}/plan.svg?{query}"),
        format!("{path}?{query}"),
        format!("/v1/flocks?{query}"),
        format!("{path}/flock.json?expires=99999999999&signature={signature}"),
        url.replace(&signature[..4], "0000"),
        earlier,
    ] {
        assert_eq!(
            app.get(&closed).send().await.unwrap().status(),
            401,
            "{closed}"
        );
    }
    assert_eq!(app.post(&url).send().await.unwrap().status(), 401);
    app.assert_sound().await;
}

#[tokio::test]
async fn equal_films_of_two_owners_are_stored_separately() {
    let mut app = TestApp::idle().await;
    let (first, second) = (
        app.token(Scope::Write, 9).await,
        app.token(Scope::Write, 9).await,
    );
    let mut ids = Vec::new();
    for token in [&first, &second] {
        app.sign_in(token);
        ids.push(app.upload(&TINY).await);
    }
    assert_ne!(ids[0], ids[1]);
    app.sign_out();
    assert_eq!(app.json("/v1/footage").await["items"], json!([]));
    assert_eq!(app.n_folders("footage").await, 2);
    app.assert_sound().await;
}
