//! The accept loop, our own because header time-outs need a timer (RELIABILITY.md, facts and H1),
//! and the graceful end (R4). When all connections are taken a few more are let in, to be told so, and to ask
//! whether the service lives.

mod patience;

use std::io;
use std::sync::Arc;
use std::time::Duration;

use axum::Router;
use axum::extract::Request;
use axum::middleware::{Next, from_fn};
use axum::response::{IntoResponse, Response};
use hyper::body::Incoming;
use hyper_util::rt::{TokioExecutor, TokioIo, TokioTimer};
use hyper_util::server::conn::auto::Builder;
use hyper_util::service::TowerToHyperService;
use tokio::net::{TcpListener, TcpStream};
use tokio::sync::{OwnedSemaphorePermit, Semaphore};
use tokio::time::{sleep, timeout};
use tokio_util::sync::CancellationToken;
use tokio_util::task::TaskTracker;
use tower::ServiceExt;

pub(super) use patience::is_too_slow;
use patience::{Paced, Patient};

use super::Problem;
use super::access::Peer;
use crate::code::Code;

const MAX_CONNECTIONS: usize = 2048;
/// Those that are let in besides, for one answer each.
const MAX_CROWD: usize = 64;
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
    let (under_way, newcomers) = (TaskTracker::new(), TaskTracker::new());
    let door = Door::new(listener, router, [MAX_CONNECTIONS, MAX_CROWD]);
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
    let (once, never) = (once(), CancellationToken::new());
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
    /// Answers those for whom there is no room.
    in_crowd: Router,
    room: Arc<Semaphore>,
    crowd: Arc<Semaphore>,
}

impl Door {
    fn new(listener: TcpListener, router: Router, [room, crowd]: [usize; 2]) -> Door {
        Door {
            listener,
            in_crowd: router.clone().layer(from_fn(answer_in_crowd)),
            router,
            room: Arc::new(Semaphore::new(room)),
            crowd: Arc::new(Semaphore::new(crowd)),
        }
    }

    /// Answers each in a task of its own, for ever.
    async fn let_in(
        &self,
        builder: &Builder<TokioExecutor>,
        connections: &TaskTracker,
        stop: &CancellationToken,
    ) {
        loop {
            match self.accept().await {
                Ok((stream, permit, is_crowd)) => {
                    let (builder, router) = match is_crowd {
                        false => (builder.clone(), self.router.clone()),
                        true => (once(), self.in_crowd.clone()),
                    };
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

    /// The next connection, with its place, and whether that is one in the crowd.
    async fn accept(&self) -> io::Result<(TcpStream, OwnedSemaphorePermit, bool)> {
        let usual = || self.room.clone().try_acquire_owned().ok();
        let (mut permit, mut is_crowd) = match usual() {
            Some(permit) => (permit, false),
            None => {
                let permit = self.crowd.clone().acquire_owned().await;
                (permit.map_err(io::Error::other)?, true)
            }
        };
        let (stream, _) = self.listener.accept().await?;
        stream.set_nodelay(true)?;
        // Somebody may have left meanwhile.
        if let Some(place) = usual().filter(|_| is_crowd) {
            (permit, is_crowd) = (place, false);
        }
        Ok((stream, permit, is_crowd))
    }
}

/// Whether the service lives can be asked all the same.
async fn answer_in_crowd(request: Request, next: Next) -> Response {
    match request.uri().path() {
        "/healthz" => next.run(request).await,
        _ => Problem::from(Code::Busy).into_response(),
    }
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
        request.map(Paced::new)
    });
    let service = TowerToHyperService::new(router);
    let connection = builder.serve_connection(TokioIo::new(Patient::new(stream)), service);
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

/// One request each: their connections are not kept.
fn once() -> Builder<TokioExecutor> {
    let mut once = builder();
    once.http1().keep_alive(false);
    once
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

#[cfg(test)]
mod tests {
    use axum::routing::get;
    use tokio::io::{AsyncReadExt, AsyncWriteExt};

    use super::*;

    /// Sends a request on a connection of its own; the connection, and the first line of the answer.
    async fn ask(address: std::net::SocketAddr, path: &str) -> (TcpStream, String) {
        let mut connection = TcpStream::connect(address).await.unwrap();
        let request = format!("GET {path} HTTP/1.1\r\nhost: x\r\n\r\n");
        connection.write_all(request.as_bytes()).await.unwrap();
        let mut answer = vec![0; 4096];
        let n_bytes = timeout(Duration::from_secs(5), connection.read(&mut answer)).await;
        answer.truncate(n_bytes.unwrap().unwrap());
        let answer = String::from_utf8(answer).unwrap();
        let line = answer.lines().next().unwrap_or_default();
        (connection, line.to_owned())
    }

    #[tokio::test]
    async fn when_all_connections_are_taken_others_are_told_so_and_may_ask_for_life() {
        let listener = TcpListener::bind("127.0.0.1:0").await.unwrap();
        let address = listener.local_addr().unwrap();
        let router = Router::new()
            .route("/healthz", get(|| async { "well" }))
            .route("/", get(|| async { "the page" }));
        let door = Door::new(listener, router, [1, 2]);
        let (connections, never) = (TaskTracker::new(), CancellationToken::new());
        let door = tokio::spawn(async move {
            door.let_in(&builder(), &connections, &never).await;
        });
        let (taken, first) = ask(address, "/").await;
        assert_eq!(first, "HTTP/1.1 200 OK");
        for _ in 0..4 {
            let (_closed, other) = ask(address, "/").await;
            assert_eq!(other, "HTTP/1.1 503 Service Unavailable");
            let (_closed, life) = ask(address, "/healthz").await;
            assert_eq!(life, "HTTP/1.1 200 OK");
        }
        drop(taken);
        sleep(Duration::from_millis(50)).await;
        let (_open, next) = ask(address, "/").await;
        assert_eq!(next, "HTTP/1.1 200 OK");
        door.abort();
    }
}
