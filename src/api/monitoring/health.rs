//! Liveness (`/healthz`) and readiness (`/readyz`) of the service.

use axum::extract::State;
use axum::http::StatusCode;
use serde::Serialize;
use utoipa::ToSchema;

use crate::api::AppState;
use crate::media::SandboxStatus;

/// Readiness of the service and of everything that it needs.
#[derive(Debug, Serialize, ToSchema)]
pub(in crate::api) struct Readiness {
    /// Whether the service can take work: it is not stopping, and everything below except `sandbox` is
    /// available.
    ready: bool,
    /// Whether the database can be written to.
    database: bool,
    /// Whether files can be written on this machine. If files are kept in a bucket, the bucket must also
    /// answer within 2 seconds.
    blob_store: bool,
    /// Version of ffmpeg; null if it is missing.
    media_tool: Option<String>,
    /// Layers of the sandbox around ffmpeg. A missing layer does not affect `ready`. With `--sandbox strict`
    /// the service does not start without all layers.
    sandbox: Vec<LayerView>,
    /// Free space for uploads.
    disk: DiskView,
}

/// One layer of the sandbox.
#[derive(Debug, Serialize, ToSchema)]
pub(super) struct LayerView {
    /// Name: `leash`, `privileges`, `limits`, `files`, `network`, `signals` or `calls`.
    name: &'static str,
    /// Whether it is in use.
    on: bool,
    /// Reason why it is not in use; null if it is.
    lack: Option<String>,
}

/// Free space on the disk.
#[derive(Debug, Serialize, ToSchema)]
pub(super) struct DiskView {
    /// Free space, bytes; null if unknown.
    room_bytes: Option<u64>,
    /// Space that uploads leave free, bytes.
    reserve_bytes: u64,
    /// Whether more than this reserve is free.
    ok: bool,
}

/// Check that the process is alive.
#[utoipa::path(get, path = "/healthz", security(()), responses((status = 200, body = str)))]
pub(in crate::api) async fn healthz() -> &'static str {
    "ok\n"
}

/// Check that the service can take work.
///
/// The status is 200 if it can, else 503. The body says what is missing.
#[utoipa::path(get, path = "/readyz", security(()), responses(
    (status = 200, body = Readiness),
    (status = 503, body = Readiness),
))]
pub(in crate::api) async fn readyz(
    State(state): State<AppState>,
) -> (StatusCode, axum::Json<Readiness>) {
    let database = state.context.store.is_writable().await;
    let blobs = state.context.store.blobs().clone();
    let blob_store = blobs.is_writable().await;
    let free_bytes = tokio::task::spawn_blocking(move || blobs.free_bytes().ok());
    let room_bytes = free_bytes.await.ok().flatten();
    let disk = DiskView {
        room_bytes,
        reserve_bytes: state.config.disk_reserve_bytes,
        ok: room_bytes.is_some_and(|free_bytes| free_bytes > state.config.disk_reserve_bytes),
    };
    let (media_tool, sandbox) = match &state.media_tool {
        Ok(status) => (Some(status.version.clone()), LayerView::all(status)),
        Err(_) => (None, Vec::new()),
    };
    let stops = state.context.draining.is_cancelled();
    let ready = database && blob_store && media_tool.is_some() && disk.ok && !stops;
    let status = if ready {
        StatusCode::OK
    } else {
        StatusCode::SERVICE_UNAVAILABLE
    };
    let body = Readiness {
        ready,
        database,
        blob_store,
        media_tool,
        sandbox,
        disk,
    };
    (status, axum::Json(body))
}

impl LayerView {
    fn all(status: &SandboxStatus) -> Vec<LayerView> {
        let views = status.layers.iter().map(|(layer, lack)| LayerView {
            name: layer.name(),
            on: lack.is_none(),
            lack: lack.clone(),
        });
        views.collect()
    }
}
