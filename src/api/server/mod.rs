//! The accept loop and the graceful stop (docs/explanation/promises.md, "Slow clients" and "Graceful stop").
//!
//! `axum::serve` installs no timer, so the header timeout of hyper would have no effect. This loop installs
//! one. If all connections are in use, a few more are accepted for one response each: `busy`, or that of
//! /healthz.

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

/// Largest number of connections that are served normally. Free choice.
const MAX_CONNECTIONS: usize = 2048;
/// Largest number of further connections, which get one response each. Free choice.
const MAX_CROWD: usize = 64;
/// Longest wait for the head of a request, and for the next request on an idle connection. Free choice.
const HEAD: Duration = Duration::from_secs(30);
/// Size of the read buffer for the head of a request, bytes. Free choice.
const MAX_HEAD_BYTES: usize = 64 << 10;
/// Longest wait for running requests when the service stops. Free choice.
const DRAIN: Duration = Duration::from_secs(10);

/// Longest wait for the responses to connections that arrived during the stop. Free choice.
const FAREWELL: Duration = Duration::from_secs(1);

/// The two steps of a stop.
#[derive(Clone, Debug, Default)]
pub struct Stop {
    /// Cancelled when the service begins to stop. Running requests then have 10 seconds to finish.
    pub begun: CancellationToken,
    /// Cancelled when the rest of the service has stopped. Until then new connections are still answered, so
    /// clients learn that the service is stopping.
    pub over: CancellationToken,
}

/// Serves connections until the stop begins, and then as described at [`Stop`].
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
            tracing::warn!(
                n_connections,
                "open requests were cut off at the end of the grace period"
            );
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

/// The listener and its limits.
struct Door {
    listener: TcpListener,
    router: Router,
    /// Router for connections beyond the limit.
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

    /// Accepts connections forever and serves each in its own task.
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
                    // Most likely no file descriptor is left until other connections close.
                    tracing::warn!(%error, "a connection could not be accepted");
                    sleep(Duration::from_millis(100)).await;
                }
            }
        }
    }

    /// Returns the next connection, its permit, and whether it is beyond the limit.
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
        // Another connection may have closed during the wait.
        if let Some(place) = usual().filter(|_| is_crowd) {
            (permit, is_crowd) = (place, false);
        }
        Ok((stream, permit, is_crowd))
    }
}

/// Middleware of connections beyond the limit: refuses requests with `busy`, except /healthz.
async fn answer_in_crowd(request: Request, next: Next) -> Response {
    match request.uri().path() {
        "/healthz" => next.run(request).await,
        _ => Problem::from(Code::Busy).into_response(),
    }
}

/// Serves one connection to its end. Once `stop` is cancelled, only the current request is finished.
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

/// Returns a builder without keep-alive: one request per connection.
fn once() -> Builder<TokioExecutor> {
    let mut once = builder();
    once.http1().keep_alive(false);
    once
}

/// Returns a builder with the limits of this module. It supports only HTTP/1: detecting HTTP/2 would wait for
/// the first bytes without a timeout. Browsers use HTTP/2 only over TLS, which a proxy provides.
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

    /// Sends a request on a new connection. Returns the connection and the first line of the response.
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
