//! Whether the process lives, and whether it can work.

use axum::extract::State;
use axum::http::StatusCode;
use serde::Serialize;
use utoipa::ToSchema;

use crate::api::AppState;
use crate::media::Walls;

/// What the service needs, and whether it has it.
#[derive(Debug, Serialize, ToSchema)]
pub(in crate::api) struct Readiness {
    /// Whether all below is well.
    ready: bool,
    /// Whether the database can be written.
    database: bool,
    /// Whether files can be written on this machine, and a bucket, where they are kept in one, answers within two seconds.
    blob_store: bool,
    /// The version of the media tool; null when it is missing.
    media_tool: Option<String>,
    /// The layers of the sandbox around the media tool. One that is missing does not make the service unready:
    /// whoever demands them all starts it with `--sandbox strict`.
    sandbox: Vec<LayerView>,
    /// Room for uploads.
    disk: DiskView,
}

/// One layer of the sandbox.
#[derive(Debug, Serialize, ToSchema)]
pub(super) struct LayerView {
    /// Its name: `leash`, `privileges`, `limits`, `files`, `network`, `signals` or `calls`.
    name: &'static str,
    /// Whether it stands.
    on: bool,
    /// Why not, where it does not.
    lack: Option<String>,
}

/// Room on the disk.
#[derive(Debug, Serialize, ToSchema)]
pub(super) struct DiskView {
    /// Bytes that can still be written; null where that cannot be found out.
    room_bytes: Option<u64>,
    /// Bytes that uploads leave free.
    reserve_bytes: u64,
    /// Whether there is more room than that.
    ok: bool,
}

/// The process lives.
#[utoipa::path(get, path = "/healthz", security(()), responses((status = 200, body = str)))]
pub(in crate::api) async fn healthz() -> &'static str {
    "ok\n"
}

/// The service can take work.
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
    let room = tokio::task::spawn_blocking(move || blobs.room_bytes().ok());
    let room_bytes = room.await.ok().flatten();
    let disk = DiskView {
        room_bytes,
        reserve_bytes: state.config.disk_reserve_bytes,
        ok: room_bytes.is_some_and(|room| room > state.config.disk_reserve_bytes),
    };
    let (media_tool, sandbox) = match &state.walls {
        Ok(walls) => (Some(walls.version.clone()), LayerView::all(walls)),
        Err(_) => (None, Vec::new()),
    };
    let stops = state.context.draining.is_cancelled();
    let ready = database && blob_store && media_tool.is_some() && disk.ok && !stops;
    let status = match ready {
        true => StatusCode::OK,
        false => StatusCode::SERVICE_UNAVAILABLE,
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
    fn all(walls: &Walls) -> Vec<LayerView> {
        let views = walls.layers.iter().map(|(layer, lack)| LayerView {
            name: layer.name(),
            on: lack.is_none(),
            lack: lack.clone(),
        });
        views.collect()
    }
}
