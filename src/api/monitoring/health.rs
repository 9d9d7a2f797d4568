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
    /// Whether stored data can be read: the service is not stopping, and the database and the bucket, if there is one,
    /// answer.
    ready: bool,
    /// Work that is refused although the service is ready, with the reason. Everything else works.
    refused: Vec<RefusedView>,
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

/// A kind of work that is refused.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, ToSchema)]
pub(super) struct RefusedView {
    /// `uploads`, `jobs`, or `deletes`.
    work: &'static str,
    /// Reason, one sentence.
    reason: &'static str,
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
    free_bytes: Option<u64>,
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

/// Check that the service can be used.
///
/// The status is 200 if stored data can be read, else 503. The body says what is missing, and which work is refused for that
/// reason: below the reserve of the disk only uploads and jobs are.
#[utoipa::path(get, path = "/readyz", security(()), responses(
    (status = 200, body = Readiness),
    (status = 503, body = Readiness),
))]
pub(in crate::api) async fn readyz(
    State(state): State<AppState>,
) -> (StatusCode, axum::Json<Readiness>) {
    let (context, store) = (&state.context, &state.context.store);
    let is_readable = store.is_readable().await;
    let database = is_readable && store.is_writable().await;
    let blobs = store.blobs().clone();
    let (is_reached, is_local) = tokio::join!(blobs.is_reached(), blobs.is_writable());
    let free_bytes = tokio::task::spawn_blocking(move || blobs.free_bytes().ok());
    let free_bytes = free_bytes.await.ok().flatten();
    let has_more = |n_bytes| free_bytes.is_some_and(|free_bytes| free_bytes > n_bytes);
    let disk = DiskView {
        free_bytes,
        reserve_bytes: state.config.disk_reserve_bytes,
        ok: has_more(state.config.disk_reserve_bytes),
    };
    let (media_tool, sandbox) = match &state.media_tool {
        Ok(status) => (Some(status.version.clone()), LayerView::all(status)),
        Err(_) => (None, Vec::new()),
    };
    let lacks = Lacks {
        writes: !database,
        rows: store.require_rows().await.is_err(),
        files: !is_local,
        media_tool: media_tool.is_none(),
        reserve: !disk.ok,
        // If machines share the queue, others may run the jobs.
        job_reserve: store.is_alone() && !has_more(context.min_free_bytes),
    };
    let ready = is_readable && is_reached && !context.draining.is_cancelled();
    let status = if ready {
        StatusCode::OK
    } else {
        StatusCode::SERVICE_UNAVAILABLE
    };
    let body = Readiness {
        ready,
        refused: lacks.refused(),
        database,
        blob_store: is_reached && is_local,
        media_tool,
        sandbox,
        disk,
    };
    (status, axum::Json(body))
}

/// What a service that can be read lacks for other work.
#[derive(Clone, Copy, Debug, Default)]
struct Lacks {
    /// Writes to the database.
    writes: bool,
    /// Space of the disk for new rows.
    rows: bool,
    /// Writes to the local folder.
    files: bool,
    media_tool: bool,
    /// Space of the disk for uploads.
    reserve: bool,
    /// Space of the disk for jobs.
    job_reserve: bool,
}

impl Lacks {
    fn refused(self) -> Vec<RefusedView> {
        let reason = |lacks: &[(bool, &'static str)]| {
            let found = lacks.iter().find(|(is_lacking, _)| *is_lacking);
            found.map(|(_, reason)| *reason)
        };
        let writes = (self.writes, "the database cannot be written to");
        let common = [
            writes,
            (self.rows, "the disk has no space for new rows"),
            (self.files, "the local folder cannot be written to"),
            (self.media_tool, "ffmpeg is missing"),
        ];
        let disk = |is_lacking| (is_lacking, "the free disk space is below the reserve");
        let uploads = reason(&[&common[..], &[disk(self.reserve)]].concat());
        let jobs = reason(&[&common[..], &[disk(self.job_reserve)]].concat());
        let all = [
            ("uploads", uploads),
            ("jobs", jobs),
            ("deletes", reason(&[writes])),
        ];
        let refused = all.into_iter().filter_map(|(work, reason)| {
            Some(RefusedView {
                work,
                reason: reason?,
            })
        });
        refused.collect()
    }
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
