//! The accept loop and the graceful stop (docs/explanation/promises.md, "Slow clients" and "Graceful stop").
//!
//! `axum::serve` installs no timer, so the header timeout of hyper would have no effect. This loop installs
//! one. If all connections are in use, others give way (`connections`). If none does, a few more are
//! accepted for one response each: `busy`, or that of /healthz.

mod connections;
mod slow_clients;

use std::io;
use std::net::IpAddr;
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

use connections::{Connection, Connections};
pub(super) use slow_clients::is_too_slow;
use slow_clients::{MinRateBody, MinRateStream, Unread};

use super::Problem;
use super::access::{Peer, hold_until_sent, network_of};
use flockreel_core::code::Code;

/// Largest number of connections that are served normally. Free choice.
const MAX_CONNECTIONS: usize = 2048;
/// Largest number of further connections, which get one response each. Free choice.
const MAX_OVERFLOW_CONNECTIONS: usize = 64;
/// Longest wait for a connection that gives way. It needs no message from its client.
const GIVE_WAY_TIMEOUT: Duration = Duration::from_millis(100);
/// Longest wait for the head of a request, and for the next request on an idle connection. Free choice.
const HEAD_TIMEOUT: Duration = Duration::from_secs(30);
/// Size of the read buffer for the head of a request, bytes. Free choice.
const MAX_HEAD_BYTES: usize = 64 << 10;
/// Longest wait for running requests when the service stops. Free choice.
const DRAIN_TIMEOUT: Duration = Duration::from_secs(10);

/// Longest wait for the responses to connections that arrived during the stop. Free choice.
const LAST_RESPONSES_TIMEOUT: Duration = Duration::from_secs(1);

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
    let (connections, late_connections) = (TaskTracker::new(), TaskTracker::new());
    let acceptor = Acceptor::new(listener, router, MAX_CONNECTIONS, MAX_OVERFLOW_CONNECTIONS);
    let keep_alive = keep_alive_builder();
    tokio::select! {
        () = acceptor.accept_all(&keep_alive, &connections, &stop.begun) => {}
        () = stop.begun.cancelled() => {}
    }
    connections.close();
    let ended = async {
        if timeout(DRAIN_TIMEOUT, connections.wait()).await.is_err() {
            let n_connections = connections.len();
            tracing::warn!(
                n_connections,
                "open requests were cut off at the end of the grace period"
            );
        }
        stop.over.cancelled().await;
    };
    let (one_request, never) = (one_request_builder(), CancellationToken::new());
    tokio::select! {
        () = acceptor.accept_all(&one_request, &late_connections, &never) => {}
        () = ended => {}
    }
    drop(acceptor);
    late_connections.close();
    timeout(LAST_RESPONSES_TIMEOUT, late_connections.wait())
        .await
        .ok();
}

/// The listener and its limits.
struct Acceptor {
    listener: TcpListener,
    router: Router,
    /// Router for connections beyond the limit.
    overflow_router: Router,
    permits: Arc<Semaphore>,
    overflow_permits: Arc<Semaphore>,
    connections: Connections,
}

impl Acceptor {
    fn new(
        listener: TcpListener,
        router: Router,
        n_permits: usize,
        n_overflow_permits: usize,
    ) -> Acceptor {
        Acceptor {
            listener,
            overflow_router: router.clone().layer(from_fn(answer_overflow)),
            router,
            permits: Arc::new(Semaphore::new(n_permits)),
            overflow_permits: Arc::new(Semaphore::new(n_overflow_permits)),
            connections: Connections::default(),
        }
    }

    /// Accepts connections forever and serves each in its own task.
    async fn accept_all(
        &self,
        builder: &Builder<TokioExecutor>,
        connections: &TaskTracker,
        stop: &CancellationToken,
    ) {
        loop {
            match self.accept().await {
                Ok(connection) => {
                    let (builder, router, table) = if connection.is_overflow {
                        let table = Connections::default();
                        (one_request_builder(), self.overflow_router.clone(), table)
                    } else {
                        (
                            builder.clone(),
                            self.router.clone(),
                            self.connections.clone(),
                        )
                    };
                    let (stop, entry) = (stop.clone(), table.enter(network_of(connection.peer)));
                    connections.spawn(async move {
                        answer(&builder, connection, router, stop, entry).await;
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

    async fn accept(&self) -> io::Result<Accepted> {
        let usual_permit = || self.permits.clone().try_acquire_owned().ok();
        let (mut permit, mut is_overflow) = match usual_permit() {
            Some(permit) => (permit, false),
            None => {
                let permit = self.overflow_permits.clone().acquire_owned().await;
                (permit.map_err(io::Error::other)?, true)
            }
        };
        let (stream, peer) = self.listener.accept().await?;
        let peer = peer.ip();
        stream.set_nodelay(true)?;
        // Another connection may have closed during the wait, or may close now.
        if is_overflow {
            let usual = match usual_permit() {
                None if self.connections.make_room(network_of(peer)) => {
                    let closed = self.permits.clone().acquire_owned();
                    timeout(GIVE_WAY_TIMEOUT, closed)
                        .await
                        .ok()
                        .and_then(Result::ok)
                }
                usual => usual,
            };
            if let Some(usual) = usual {
                (permit, is_overflow) = (usual, false);
            }
        }
        Ok(Accepted {
            stream,
            peer,
            is_overflow,
            _permit: permit,
        })
    }
}

/// An accepted connection.
struct Accepted {
    stream: TcpStream,
    /// Address of the other end.
    peer: IpAddr,
    /// Whether the connection is beyond the limit.
    is_overflow: bool,
    _permit: OwnedSemaphorePermit,
}

/// Middleware of connections beyond the limit: refuses requests with `busy`, except /healthz.
async fn answer_overflow(request: Request, next: Next) -> Response {
    match request.uri().path() {
        "/healthz" => next.run(request).await,
        _ => Problem::from(Code::Busy).into_response(),
    }
}

/// Serves one connection to its end. Once `stop` is cancelled, only the current request is finished. A connection that
/// gives way ends at once.
async fn answer(
    builder: &Builder<TokioExecutor>,
    accepted: Accepted,
    router: Router,
    stop: CancellationToken,
    entry: Arc<Connection>,
) {
    let peer = Peer(accepted.peer);
    let unread = Unread::default();
    let stream = MinRateStream::new(accepted.stream, unread.clone());
    let (begun, ending) = (entry.clone(), entry.clone());
    // HTTP/1 answers one request after the other, so a response belongs to the request before it.
    let router = router
        .map_request(move |mut request: Request<Incoming>| {
            begun.begin();
            request.extensions_mut().insert(peer);
            request.map(|body| MinRateBody::new(body, unread.clone()))
        })
        .map_response(move |response| hold_until_sent(response, ending.busy()));
    let service = TowerToHyperService::new(router);
    let connection = builder.serve_connection(TokioIo::new(stream), service);
    let mut connection = std::pin::pin!(connection);
    let ended = tokio::select! {
        ended = connection.as_mut() => ended,
        () = stop.cancelled() => {
            connection.as_mut().graceful_shutdown();
            connection.await
        }
        () = entry.must_close() => return,
    };
    if let Err(error) = ended {
        tracing::debug!(error, "a connection ended early");
    }
}

/// Returns a builder without keep-alive: one request per connection.
fn one_request_builder() -> Builder<TokioExecutor> {
    let mut builder = keep_alive_builder();
    builder.http1().keep_alive(false);
    builder
}

/// Returns a builder with the limits of this module. It supports only HTTP/1: detecting HTTP/2 would wait for
/// the first bytes without a timeout. Browsers use HTTP/2 only over TLS, which a proxy provides.
fn keep_alive_builder() -> Builder<TokioExecutor> {
    let mut builder = Builder::new(TokioExecutor::new()).http1_only();
    builder
        .http1()
        .timer(TokioTimer::new())
        .header_read_timeout(HEAD_TIMEOUT)
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

    /// Accepts one connection and two beyond the limit.
    async fn small_service() -> std::net::SocketAddr {
        let listener = TcpListener::bind("127.0.0.1:0").await.unwrap();
        let address = listener.local_addr().unwrap();
        let endless = || async {
            let pieces = futures_util::stream::pending::<io::Result<bytes::Bytes>>();
            axum::body::Body::from_stream(pieces)
        };
        let router = Router::new()
            .route("/healthz", get(|| async { "well" }))
            .route("/endless", get(endless))
            .route("/", get(|| async { "the page" }));
        let acceptor = Acceptor::new(listener, router, 1, 2);
        tokio::spawn(async move {
            let (connections, never) = (TaskTracker::new(), CancellationToken::new());
            acceptor
                .accept_all(&keep_alive_builder(), &connections, &never)
                .await;
        });
        address
    }

    #[tokio::test]
    async fn connections_beyond_the_limit_get_503_except_for_healthz() {
        let address = small_service().await;
        let (taken, first) = ask(address, "/endless").await;
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
    }

    #[tokio::test]
    async fn idle_connection_gives_way() {
        let address = small_service().await;
        let _silent = TcpStream::connect(address).await.unwrap();
        let mut open = Vec::new();
        for _ in 0..3 {
            let (connection, line) = ask(address, "/").await;
            assert_eq!(line, "HTTP/1.1 200 OK");
            open.push(connection);
        }
    }
}
