//! The accept loop, our own because header time-outs need a timer (RELIABILITY.md, facts and H1),
//! and the graceful end (R4).

use std::io;
use std::sync::Arc;
use std::time::Duration;

use axum::Router;
use hyper_util::rt::{TokioExecutor, TokioIo, TokioTimer};
use hyper_util::server::conn::auto::Builder;
use hyper_util::service::TowerToHyperService;
use tokio::net::{TcpListener, TcpStream};
use tokio::sync::Semaphore;
use tokio::time::{sleep, timeout};
use tokio_util::sync::CancellationToken;
use tokio_util::task::TaskTracker;

const MAX_CONNECTIONS: usize = 2048;
/// The longest wait for a request's head, and for the next request on an idle connection.
const HEAD: Duration = Duration::from_secs(30);
/// The longest head.
const MAX_HEAD_BYTES: usize = 64 << 10;
/// The longest wait for requests under way once the service stops.
const DRAIN: Duration = Duration::from_secs(10);

/// Answers until `stop` is cancelled; then requests under way may end, for ten seconds.
pub async fn serve(listener: TcpListener, router: Router, stop: CancellationToken) {
    let (builder, room) = (builder(), Arc::new(Semaphore::new(MAX_CONNECTIONS)));
    let connections = TaskTracker::new();
    loop {
        let accepted = tokio::select! {
            () = stop.cancelled() => break,
            accepted = accept(&listener, &room) => accepted,
        };
        match accepted {
            Ok((stream, permit)) => {
                let (builder, router, stop) = (builder.clone(), router.clone(), stop.clone());
                connections.spawn(async move {
                    answer(&builder, stream, router, stop).await;
                    drop(permit);
                });
            }
            Err(error) => {
                // No descriptors left, most likely: others must close first.
                tracing::warn!(%error, "a connection could not be accepted");
                sleep(Duration::from_millis(100)).await;
            }
        }
    }
    drop(listener);
    connections.close();
    if timeout(DRAIN, connections.wait()).await.is_err() {
        tracing::warn!(
            n_connections = connections.len(),
            "requests under way were cut off"
        );
    }
}

async fn accept(
    listener: &TcpListener,
    room: &Arc<Semaphore>,
) -> io::Result<(TcpStream, tokio::sync::OwnedSemaphorePermit)> {
    let permit = room
        .clone()
        .acquire_owned()
        .await
        .map_err(io::Error::other)?;
    let (stream, _) = listener.accept().await?;
    stream.set_nodelay(true)?;
    Ok((stream, permit))
}

async fn answer(
    builder: &Builder<TokioExecutor>,
    stream: TcpStream,
    router: Router,
    stop: CancellationToken,
) {
    let service = TowerToHyperService::new(router);
    let connection = builder.serve_connection(TokioIo::new(stream), service);
    let mut connection = std::pin::pin!(connection);
    let ended = tokio::select! {
        ended = connection.as_mut() => ended,
        () = stop.cancelled() => {
            connection.as_mut().graceful_shutdown();
            connection.await
        }
    };
    if let Err(error) = ended {
        tracing::debug!(error, "a connection ended early");
    }
}

/// HTTP/1 alone: telling the versions apart waits for first bytes without a time-out, and browsers
/// speak HTTP/2 over TLS only, which is a proxy's work.
fn builder() -> Builder<TokioExecutor> {
    let mut builder = Builder::new(TokioExecutor::new()).http1_only();
    builder
        .http1()
        .timer(TokioTimer::new())
        .header_read_timeout(HEAD)
        .max_buf_size(MAX_HEAD_BYTES);
    builder
}
