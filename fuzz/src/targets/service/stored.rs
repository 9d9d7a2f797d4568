//! The service of the targets: a data folder with a footage, a library, a flock and a virtual fish. A request that may
//! have changed the data gets a fresh copy of the folder afterwards, so that every input meets the same data.

use std::fs;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};

use axum::Router;
use axum::body::Body;
use axum::http::{HeaderMap, HeaderName, Method, Request, StatusCode, header};
use clap::Parser;
use flockreel::api::{self, AppState};
use flockreel::config::Config;
use flockreel::jobs::worker::{Step, Worker};
use flockreel::jobs::{Context, IdSequence, analysis, fish, flock};
use flockreel::store::footage::{Footage, POSTER, VIDEO};
use flockreel::store::owners::{Account, Owner};
use flockreel_core::ids::FootageId;
use serde_json::{Value, json};
use tempfile::TempDir;
use tokio::runtime::Runtime;
use tower::ServiceExt;
use uuid::Uuid;

/// The stored film. Nothing decodes it.
pub(super) const FILM: &[u8] = b"0123456789abcdefghijklmnopqrstuvwxyz, 41 bytes";

/// Words in requests, and the ids for which they stand.
type Ids = [(&'static str, Uuid); 6];

/// A running service and its data.
pub(super) struct Service {
    runtime: Runtime,
    /// Data with which every service begins.
    template: TempDir,
    ids: Ids,
    /// Service and data of the next request; `None` after a change.
    ready: Option<(Router, TempDir)>,
}

/// A response that was read.
pub(super) struct Reply {
    pub(super) status: StatusCode,
    pub(super) headers: HeaderMap,
    pub(super) body: Vec<u8>,
    /// Whether it answers a HEAD request, and so has no body.
    pub(super) is_head: bool,
}

impl Reply {
    /// Returns a header of plain text.
    pub(super) fn text(&self, name: HeaderName) -> Option<&str> {
        self.headers.get(name)?.to_str().ok()
    }
}

#[derive(Parser)]
struct Arguments {
    #[command(flatten)]
    config: Config,
}

/// Calls `act` with the service of this process.
pub(super) fn with_service<T>(act: impl FnOnce(&mut Service) -> T) -> T {
    static SERVICE: Mutex<Option<Service>> = Mutex::new(None);
    let mut service = SERVICE.lock().unwrap_or_else(PoisonError::into_inner);
    act(service.get_or_insert_with(Service::new))
}

impl Service {
    fn new() -> Service {
        let runtime = tokio::runtime::Builder::new_current_thread()
            .enable_all()
            .build();
        let runtime = runtime.expect("a runtime");
        let template = tempfile::tempdir().expect("a temporary folder");
        let ids = runtime.block_on(async {
            let state = open(template.path()).await;
            let ids = fill(&state.context).await;
            state.context.store.close().await;
            ids
        });
        Service {
            runtime,
            template,
            ids,
            ready: None,
        }
    }

    /// Replaces words by the ids for which they stand.
    pub(super) fn with_ids(&self, text: &str) -> String {
        let ids = self.ids.iter();
        ids.fold(text.to_owned(), |text, (word, id)| {
            text.replace(word, &id.to_string())
        })
    }

    /// Sends a request and reads the response. A request that may have changed the data is the last of its service.
    pub(super) fn send(&mut self, request: Request<Body>) -> Reply {
        let is_write = !request.method().is_safe();
        let reply = self.send_keeping(request);
        if is_write {
            self.ready = None;
        }
        reply
    }

    /// Like [`Service::send`], but the next request meets the same data.
    pub(super) fn send_keeping(&mut self, mut request: Request<Body>) -> Reply {
        let host = header::HeaderValue::from_static("localhost");
        request.headers_mut().entry(header::HOST).or_insert(host);
        let is_head = request.method() == Method::HEAD;
        let (router, folder) = self.ready.take().unwrap_or_else(|| self.start());
        let reply = self.runtime.block_on(async {
            let answered = router.clone().oneshot(request).await;
            let (head, body) = answered.expect("the router is infallible").into_parts();
            Reply {
                status: head.status,
                headers: head.headers,
                body: super::read(body).await,
                is_head,
            }
        });
        self.ready = Some((router, folder));
        reply
    }

    fn start(&self) -> (Router, TempDir) {
        let folder = tempfile::tempdir().expect("a temporary folder");
        copy(self.template.path(), folder.path());
        let state = self.runtime.block_on(open(folder.path()));
        (api::router(state), folder)
    }
}

async fn open(folder: &Path) -> AppState {
    let folder = folder.to_str().expect("a plain path");
    let flags = [
        "--rate",
        "0",
        "--disk-reserve-bytes",
        "0",
        "--max-upload-bytes",
        "100000",
    ];
    let config = Arguments::parse_from(["fuzz", "--data", folder].into_iter().chain(flags)).config;
    AppState::open(config).await.expect("the service starts")
}

fn copy(from: &Path, to: &Path) {
    for entry in fs::read_dir(from).expect("a folder") {
        let path = entry.expect("an entry").path();
        let target = to.join(path.file_name().expect("a name"));
        if path.is_dir() {
            fs::create_dir_all(&target).expect("a temporary folder has room");
            copy(&path, &target);
        } else {
            fs::copy(&path, &target).expect("a temporary folder has room");
        }
    }
}

/// Stores one thing of each kind and returns their ids.
async fn fill(context: &Context) -> Ids {
    let footage = store_film(context).await;
    let (account, mut ids) = (Account::local(), IdSequence::random());
    let of_footage = analysis::Input {
        footage_id: FootageId(footage),
        params: Default::default(),
    };
    let queued = context.enqueue(&of_footage, None, &account, &mut ids).await;
    let (job, library_id) = queued.expect("a job");
    let of_library = flock::Input {
        library_id,
        params: Default::default(),
    };
    let queued = context
        .enqueue(&of_library, Some(job), &account, &mut ids)
        .await;
    let (_, flock) = queued.expect("a job");
    let of_library = fish::Input {
        library_id,
        params: Default::default(),
    };
    let queued = context
        .enqueue(&of_library, Some(job), &account, &mut ids)
        .await;
    let (_, fish) = queued.expect("a job");
    work(context).await;
    let pending = context.enqueue(&of_library, None, &account, &mut ids).await;
    pending.expect("a job");
    [
        ("FOOTAGE", footage),
        ("LIBRARY", library_id.0),
        ("FLOCK", flock.0),
        ("FISH", fish.0),
        ("JOB", job.0),
        ("UPLOAD", Uuid::nil()),
    ]
}

async fn store_film(context: &Context) -> Uuid {
    let store = &context.store;
    let draft = store.blobs().draft("film").expect("a draft");
    for (name, bytes) in [(VIDEO, FILM), (POSTER, b"a picture")] {
        fs::write(draft.path().join(name), bytes).expect("a temporary folder has room");
    }
    let files = store.blobs().seal(&draft).expect("sealed files");
    let film = files
        .iter()
        .find(|file| file.name == VIDEO)
        .expect("the film");
    let footage = Footage {
        id: Uuid::now_v7(),
        owner: Owner::local(),
        folder: String::new(),
        sha256: film.sha256.clone(),
        background_sha256: Vec::new(),
        masks_sha256: Vec::new(),
        name: "film.mp4".into(),
        size_bytes: files.iter().map(|file| file.size_bytes).sum(),
        width: 48,
        height: 32,
        fps: 25.0,
        n_frames_hint: 16,
        sample: false,
        pinned: false,
        used_ms: 0,
        created_ms: 0,
    };
    let id = footage.id;
    store
        .add_footage(footage, draft, &files, None)
        .await
        .expect("stored footage");
    id
}

/// Ends the queued jobs. The library is the small library of all targets. A shell script in place of
/// `flockreel attempt` copies the files of each result.
async fn work(context: &Context) {
    let blobs = context.store.blobs();
    for (kind, summary) in [
        ("library", library_summary()),
        ("flock", flock_summary()),
        ("fish", fish_summary()),
    ] {
        let made = blobs.draft(kind).expect("a draft");
        match kind {
            "library" => super::super::library::write_small(made.path()),
            _ => fs::write(made.path().join("video.mp4"), b"a film").expect("room"),
        }
        let files = blobs.seal(&made).expect("sealed files");
        let files: Vec<Value> = files
            .iter()
            .map(|file| json!({"name": file.name, "size_bytes": file.size_bytes, "sha256": file.sha256}))
            .collect();
        let product = json!({"film": null, "params": "{}", "summary": summary.to_string()});
        let end = json!({"end": {"done": [product, files]}});
        let script = format!(
            "for folder; do :; done; read -r order; cp '{}'/* \"$folder\"; printf '%s\\n' '{end}'",
            made.path().display()
        );
        let arguments = ["-c", &script, "sh"].map(Into::into).to_vec();
        let worker = Worker::new(Context {
            attempt_program: (PathBuf::from("/bin/sh"), arguments),
            ..context.clone()
        });
        let step = worker.step().await.expect("a step");
        assert!(matches!(step, Step::Done(_)), "the job did not end");
    }
}

fn library_summary() -> Value {
    json!({"fps": 25.0, "image_size_px": [48, 32], "view": "side", "n_frames": 16, "detected_share": 1.0,
        "n_transitions": 1, "component_share": 1.0, "clip_frames": 2, "length_px": 12.0})
}

fn flock_summary() -> Value {
    json!({"fps": 25.0, "image_size_px": [48, 32], "count": 3, "frames": 24, "seed": 1})
}

fn fish_summary() -> Value {
    json!({"fps": 25.0, "image_size_px": [48, 32], "frames": 16, "visible_frames": 16})
}
