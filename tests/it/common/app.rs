//! Runs the real service with its router, on its own port and data folder.

use std::time::Duration;

use clap::Parser;
use flockreel::api::server::Stop;
use flockreel::api::{self, AppState};
use flockreel::config::Config;
use flockreel::jobs::Context;
use flockreel::jobs::clock::now_ms;
use flockreel::jobs::supervisor::Supervisor;
use flockreel::store::owners::Owner;
use flockreel::store::tokens::{NewToken, Scope};
use reqwest::header::{self, HeaderMap};
use reqwest::multipart::Form;
use reqwest::{Client, Method, RequestBuilder, Response, StatusCode};
use serde_json::Value;
use tokio::net::TcpListener;
use tokio_util::sync::CancellationToken;

use super::{Place, client};

/// The service under test, with a client for it.
pub(crate) struct TestApp {
    pub(crate) context: Context,
    pub(crate) client: Client,
    pub(crate) base: String,
    /// Owner of the token that requests send, or the local one.
    pub(crate) owner: Owner,
    place: Place,
    stop: CancellationToken,
    supervisor: Option<Supervisor>,
}

#[derive(Parser)]
struct Arguments {
    #[command(flatten)]
    config: Config,
}

impl TestApp {
    /// Starts a service without workers: jobs stay queued until a test steps a worker.
    pub(crate) async fn idle() -> TestApp {
        TestApp::start(&[]).await
    }

    /// Starts a service with one worker.
    pub(crate) async fn working() -> TestApp {
        let mut app = TestApp::start(&[]).await;
        app.supervisor = Some(Supervisor::start(app.context.clone(), 1));
        app
    }

    /// Starts a service without workers and with additional command-line flags.
    pub(crate) async fn start(flags: &[&str]) -> TestApp {
        TestApp::on(Place::from_environment(), flags).await
    }

    /// Like [`TestApp::start`], on a place that may have data.
    pub(crate) async fn on(place: Place, flags: &[&str]) -> TestApp {
        // The program of the test is another one.
        let program = (env!("CARGO_BIN_EXE_flockreel").into(), Vec::new());
        TestApp::with_context(place, flags, |context| context.attempt_program = program).await
    }

    /// Starts a service whose checks of received files run this shell command, for at most two seconds.
    pub(crate) async fn with_script(script: &str) -> TestApp {
        let arguments = ["-c", script].map(Into::into).to_vec();
        TestApp::with_context(Place::from_environment(), &[], |context| {
            context.attempt_program = ("/bin/sh".into(), arguments);
            context.check_time = Duration::from_secs(2);
        })
        .await
    }

    async fn with_context(
        place: Place,
        flags: &[&str],
        change: impl FnOnce(&mut Context),
    ) -> TestApp {
        let flags = flags.iter().map(|flag| (*flag).to_owned());
        let flags = [vec!["test".to_owned()], place.flags(), flags.collect()].concat();
        let config = Arguments::parse_from(flags).config;
        let state = AppState::open(config).await.unwrap();
        let state = state.with_context(change);
        let listener = TcpListener::bind("127.0.0.1:0").await.unwrap();
        let base = format!("http://{}", listener.local_addr().unwrap());
        let (context, stop) = (state.context.clone(), CancellationToken::new());
        tokio::spawn(api::server::serve(
            listener,
            api::router(state),
            Stop {
                begun: stop.clone(),
                over: stop.clone(),
            },
        ));
        TestApp {
            context,
            client: client(),
            base,
            owner: Owner::local(),
            place,
            stop,
            supervisor: None,
        }
    }

    /// Returns the data folder of the service.
    pub(crate) fn folder(&self) -> &std::path::Path {
        self.place.data()
    }

    /// Returns the URL of a path.
    pub(crate) fn address(&self, path: &str) -> String {
        format!("{}{path}", self.base)
    }

    /// Creates a token with its own owner and returns it. `quota` limits the owner's jobs.
    pub(crate) async fn token(&self, scope: Scope, quota: i64) -> String {
        let new = NewToken {
            name: "test".to_owned(),
            owner: None,
            scope,
            quota,
            expires_ms: None,
        };
        let made = self.context.store.add_token(&new, now_ms()).await;
        made.unwrap().1
    }

    /// Makes every later request send this token.
    pub(crate) fn sign_in(&mut self, token: &str) {
        // A new token has an owner of its own, with its id.
        let id = token.split('_').nth(1).unwrap_or_default();
        self.owner = Owner(id.to_owned());
        let value = format!("Bearer {token}").parse().unwrap();
        let headers = HeaderMap::from_iter([(header::AUTHORIZATION, value)]);
        let client = Client::builder().default_headers(headers).build();
        self.client = client.unwrap();
    }

    /// Makes every later request go without a token.
    pub(crate) fn sign_out(&mut self) {
        self.client = client();
        self.owner = Owner::local();
    }

    pub(crate) fn request(&self, method: Method, path: &str) -> RequestBuilder {
        self.client.request(method, format!("{}{path}", self.base))
    }

    pub(crate) fn get(&self, path: &str) -> RequestBuilder {
        self.client.get(format!("{}{path}", self.base))
    }

    pub(crate) fn post(&self, path: &str) -> RequestBuilder {
        self.client.post(format!("{}{path}", self.base))
    }

    pub(crate) fn delete(&self, path: &str) -> RequestBuilder {
        self.client.delete(format!("{}{path}", self.base))
    }

    pub(crate) fn head(&self, path: &str) -> RequestBuilder {
        self.client.head(format!("{}{path}", self.base))
    }

    /// POSTs a form and returns the response.
    pub(crate) async fn send_form(&self, path: &str, form: Form) -> Response {
        self.post(path).multipart(form).send().await.unwrap()
    }

    /// Uploads a film, asserts status 201 and returns the footage id.
    pub(crate) async fn upload(&self, film: &[u8]) -> String {
        let answer = self.post("/v1/footage").body(film.to_vec()).send().await;
        let footage = json_of(answer.unwrap(), StatusCode::CREATED).await;
        footage["id"].as_str().unwrap().to_owned()
    }

    /// POSTs JSON, asserts status 202 and returns the response body.
    pub(crate) async fn accept(&self, path: &str, body: Value) -> Value {
        let answer = self.post(path).json(&body).send().await.unwrap();
        json_of(answer, StatusCode::ACCEPTED).await
    }

    /// GETs JSON and asserts status 200.
    pub(crate) async fn json(&self, path: &str) -> Value {
        json_of(self.get(path).send().await.unwrap(), StatusCode::OK).await
    }

    /// Waits until the job has ended and returns it. Panics after two minutes.
    pub(crate) async fn ended_job(&self, id: &Value) -> Value {
        self.job_when(id, |job| !job["finished_at"].is_null()).await
    }

    /// Polls the job until `is_so` holds and returns it. Panics after two minutes.
    pub(crate) async fn job_when(&self, id: &Value, is_so: impl Fn(&Value) -> bool) -> Value {
        let path = format!("/v1/jobs/{}", id.as_str().unwrap());
        for _ in 0..2400 {
            let job = self.json(&path).await;
            if is_so(&job) {
                return job;
            }
            tokio::time::sleep(Duration::from_millis(50)).await;
        }
        panic!("the job did not get there in two minutes");
    }

    /// Returns the number of drafts, those in use and those left by a crash.
    pub(crate) fn n_drafts(&self) -> usize {
        self.place.n_drafts()
    }

    /// Returns the number of unfinished uploads: of their files, or of their rows if their bytes are in a bucket.
    pub(crate) async fn n_uploads(&self) -> usize {
        if self.place.has_bucket() {
            let usage = self.context.store.usage(&Owner::local()).await;
            return usage.unwrap().uploads.n.try_into().unwrap();
        }
        self.place.n_uploads()
    }

    /// Returns the number of stored folders of one kind, such as `libraries`.
    pub(crate) async fn n_folders(&self, kind: &str) -> usize {
        let folders = self.context.store.blobs().folders().await.unwrap();
        let of_kind = |name: &str| name.split('/').next() == Some(kind);
        folders
            .iter()
            .filter(|folder| of_kind(&folder.name))
            .count()
    }

    /// Stops workers and server, then asserts that the invariants of the store hold and no drafts are left.
    pub(crate) async fn assert_sound(mut self) {
        if let Some(supervisor) = self.supervisor.take() {
            supervisor.drain().await;
        }
        self.stop.cancel();
        let faults = self.context.store.check(now_ms());
        assert_eq!(faults.await.unwrap(), Vec::<String>::new());
        assert_eq!(self.n_drafts(), 0, "drafts are left");
    }
}

impl Drop for TestApp {
    fn drop(&mut self) {
        self.stop.cancel();
        self.context.draining.cancel();
    }
}

/// Asserts the status of a response and returns its JSON.
pub(crate) async fn json_of(answer: Response, status: StatusCode) -> Value {
    let found = answer.status();
    let text = answer.text().await.unwrap();
    assert_eq!(found, status, "{text}");
    serde_json::from_str(&text).unwrap()
}

/// Asserts that a response is a complete problem document with this status, and returns its code.
pub(crate) async fn code_of(answer: Response, status: u16) -> String {
    let media_type = answer.headers()["content-type"].to_str().unwrap();
    assert_eq!(media_type, "application/problem+json");
    let problem = json_of(answer, StatusCode::from_u16(status).unwrap()).await;
    assert_eq!(problem["status"], status);
    let (url, code) = (&problem["type"], problem["code"].as_str().unwrap());
    assert_eq!(url, &format!("/docs/errors#{code}"));
    assert!(problem["title"].is_string() && problem["detail"].is_string());
    let advice = flockreel_core::code::Code::from_name(code).map(|code| code.advice());
    assert_eq!(problem["advice"].as_str(), advice);
    code.to_owned()
}

/// Returns method and path of every operation in the OpenAPI document.
pub(crate) fn routes(document: &Value) -> Vec<(Method, String)> {
    let paths = document["paths"].as_object().unwrap();
    let calls = paths.iter().flat_map(|(path, calls)| {
        let methods = calls.as_object().unwrap().keys();
        methods.map(move |method| (method.to_uppercase().parse().unwrap(), path.clone()))
    });
    calls.collect()
}
