//! The accept loop, our own because header time-outs need a timer (RELIABILITY.md, facts and H1),
//! and the graceful end (R4).

use std::io;
use std::sync::Arc;
use std::time::Duration;

use axum::Router;
use axum::http::Request;
use hyper::body::Incoming;
use hyper_util::rt::{TokioExecutor, TokioIo, TokioTimer};
use hyper_util::server::conn::auto::Builder;
use hyper_util::service::TowerToHyperService;
use tokio::net::{TcpListener, TcpStream};
use tokio::sync::Semaphore;
use tokio::time::{sleep, timeout};
use tokio_util::sync::CancellationToken;
use tokio_util::task::TaskTracker;
use tower::ServiceExt;

use super::access::Peer;

const MAX_CONNECTIONS: usize = 2048;
/// The longest wait for a request's head, and for the next request on an idle connection.
const HEAD: Duration = Duration::from_secs(30);
/// The longest head.
const MAX_HEAD_BYTES: usize = 64 << 10;
/// The longest wait for requests under way once the service stops.
const DRAIN: Duration = Duration::from_secs(10);

/// The longest wait for answers to those who came after that.
const FAREWELL: Duration = Duration::from_secs(1);

/// How a server ends.
#[derive(Clone, Debug, Default)]
pub struct Stop {
    /// Cancelled when the service begins to stop: requests under way may end, for ten seconds.
    pub begun: CancellationToken,
    /// Cancelled when the rest of the service has stopped: newcomers are told so until then, not turned away.
    pub over: CancellationToken,
}

/// Answers until it is told to stop, and then as long as [`Stop`] says.
pub async fn serve(listener: TcpListener, router: Router, stop: Stop) {
    let room = Arc::new(Semaphore::new(MAX_CONNECTIONS));
    let (under_way, newcomers) = (TaskTracker::new(), TaskTracker::new());
    let door = Door {
        listener,
        router,
        room,
    };
    let usual = builder();
    tokio::select! {
        () = door.let_in(&usual, &under_way, &stop.begun) => {}
        () = stop.begun.cancelled() => {}
    }
    under_way.close();
    let ended = async {
        if timeout(DRAIN, under_way.wait()).await.is_err() {
            let n_connections = under_way.len();
            tracing::warn!(n_connections, "requests under way were cut off");
        }
        stop.over.cancelled().await;
    };
    // One request each: their connections are not kept.
    let mut once = builder();
    once.http1().keep_alive(false);
    let never = CancellationToken::new();
    tokio::select! {
        () = door.let_in(&once, &newcomers, &never) => {}
        () = ended => {}
    }
    drop(door);
    newcomers.close();
    timeout(FAREWELL, newcomers.wait()).await.ok();
}

/// Where connections come in.
struct Door {
    listener: TcpListener,
    router: Router,
    room: Arc<Semaphore>,
}

impl Door {
    /// Answers each in a task of its own, for ever.
    async fn let_in(
        &self,
        builder: &Builder<TokioExecutor>,
        connections: &TaskTracker,
        stop: &CancellationToken,
    ) {
        loop {
            match accept(&self.listener, &self.room).await {
                Ok((stream, permit)) => {
                    let (builder, router) = (builder.clone(), self.router.clone());
                    let stop = stop.clone();
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
    let peer = stream.peer_addr().map(|address| Peer(address.ip())).ok();
    let router = router.map_request(move |mut request: Request<Incoming>| {
        if let Some(peer) = peer {
            request.extensions_mut().insert(peer);
        }
        request
    });
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
