//! A thousand slow clients at once, and clients that take all connections (docs/explanation/promises.md, "Slow clients").
//! The service is a process of its own, so that its memory can be measured.

use std::net::SocketAddr;
use std::time::{Duration, Instant};

use rustix::process::{Resource, Rlimit, getrlimit, setrlimit};
use tokio::io::{AsyncReadExt, AsyncWriteExt};
use tokio::net::{TcpSocket, TcpStream};
use tokio::task::JoinSet;
use tokio::time::{sleep, timeout};

use crate::common::client;
use crate::common::film::Films;
use crate::common::process::Server;

const N_CLIENTS: usize = 1000;
/// More clients than the service has connections.
const N_READERS: usize = 2250;
/// Number of open files that the test and the service need, with room for other tests.
const OPEN_FILES: u64 = 8192;
/// The promise is 35 s. A busy machine gets more.
const LONGEST: Duration = Duration::from_secs(70);
/// Largest growth of the memory of the service, bytes.
const MAX_GROWTH_BYTES: u64 = 50 << 20;

/// Sends one byte every five seconds after the beginning, and returns once the service closes the connection.
async fn drip(address: String, beginning: &'static [u8]) {
    let mut connection = TcpStream::connect(address).await.unwrap();
    connection.write_all(beginning).await.unwrap();
    let (mut reader, mut writer) = connection.into_split();
    let dripping = tokio::spawn(async move {
        while !beginning.is_empty() && writer.write_all(b"x").await.is_ok() {
            sleep(Duration::from_secs(5)).await;
        }
        std::future::pending::<()>().await;
    });
    let mut answer = Vec::new();
    // A reset is an end too.
    reader.read_to_end(&mut answer).await.ok();
    dripping.abort();
}

/// Raises the limit of open files, for this process and those that it starts.
fn allow_open_files() {
    let limit = getrlimit(Resource::Nofile);
    let wanted = limit
        .maximum
        .map_or(OPEN_FILES, |most| most.min(OPEN_FILES));
    let more = Rlimit {
        current: limit.current.map(|now| now.max(wanted)),
        ..limit
    };
    setrlimit(Resource::Nofile, more).unwrap();
}

#[tokio::test(flavor = "multi_thread")]
async fn thousand_slow_clients_are_closed_and_cost_little() {
    allow_open_files();
    let films = Films::new();
    let server = Server::start(&films.path("data"));
    assert_eq!(server.get("/healthz").await.status(), 200);
    let before_bytes = server.resident_bytes();
    let address = server.base.trim_start_matches("http://").to_owned();
    let beginnings: [&[u8]; 3] = [
        b"",
        b"GET / HTTP/1.1\r\nhost: localhost\r\nx: ",
        // A body of JSON is read to its end before it is judged.
        b"POST /v1/analyses HTTP/1.1\r\nhost: localhost\r\ncontent-type: application/json\r\n\
          content-length: 1000\r\n\r\n",
    ];
    let start = Instant::now();
    let mut clients = JoinSet::new();
    for k in 0..N_CLIENTS {
        clients.spawn(drip(address.clone(), beginnings[k % beginnings.len()]));
    }
    let (mut most_bytes, mut waits) = (0, Vec::new());
    let all_are_closed = async { while clients.join_next().await.is_some() {} };
    let watch = async {
        loop {
            let asked = Instant::now();
            assert_eq!(server.get("/healthz").await.status(), 200);
            waits.push(asked.elapsed());
            most_bytes = most_bytes.max(server.resident_bytes());
            sleep(Duration::from_millis(200)).await;
        }
    };
    let closed = tokio::select! {
        closed = timeout(LONGEST, all_are_closed) => closed,
        () = watch => unreachable!("it watches for ever"),
    };
    assert!(
        closed.is_ok(),
        "{} clients are still connected after {LONGEST:?}",
        clients.len()
    );
    waits.sort_unstable();
    let grown_bytes = most_bytes.saturating_sub(before_bytes);
    println!(
        "closed in {:?}, memory +{} KiB, /healthz median {:?}, longest {:?}",
        start.elapsed(),
        grown_bytes >> 10,
        waits[waits.len() / 2],
        waits[waits.len() - 1]
    );
    assert!(
        grown_bytes < MAX_GROWTH_BYTES,
        "the memory grew by {grown_bytes} bytes"
    );
    assert!(
        waits[waits.len() / 2] < Duration::from_secs(1),
        "/healthz: {waits:?}"
    );
}

/// Asks for a file from a local address, and reads nothing. Returns the connection.
async fn ask_without_reading(from: [u8; 4], to: SocketAddr, coding: &str) -> TcpStream {
    let socket = TcpSocket::new_v4().unwrap();
    // A small buffer, so that the response waits in the service.
    socket.set_recv_buffer_size(4096).unwrap();
    socket.bind((from, 0).into()).unwrap();
    let mut connection = socket.connect(to).await.unwrap();
    let request = format!(
        "GET /docs/swagger-ui-bundle.js HTTP/1.1\r\nhost: localhost\r\naccept-encoding: {coding}\r\n\r\n"
    );
    connection.write_all(request.as_bytes()).await.unwrap();
    connection
}

#[tokio::test(flavor = "multi_thread")]
async fn clients_that_take_all_connections_and_read_nothing_shut_nobody_out() {
    allow_open_files();
    let films = Films::new();
    let server = Server::start(&films.path("data"));
    // The first response unpacks the file.
    assert_eq!(server.get("/docs/swagger-ui-bundle.js").await.status(), 200);
    let before_bytes = server.resident_bytes();
    let address = server.base.trim_start_matches("http://").parse().unwrap();
    let mut connections = Vec::new();
    for k in 0..N_READERS {
        let coding = ["identity", "gzip"][k % 2];
        let from = [127, 0, 1, (1 + k % 3) as u8];
        connections.push(ask_without_reading(from, address, coding).await);
    }
    let mut waits = Vec::new();
    for _ in 0..20 {
        let asked = Instant::now();
        // Every request on a connection of its own.
        let answer = client()
            .get(format!("{}/v1/footage", server.base))
            .send()
            .await;
        assert_eq!(answer.unwrap().status(), 200);
        waits.push(asked.elapsed());
    }
    waits.sort_unstable();
    let grown_bytes = server.resident_bytes().saturating_sub(before_bytes);
    println!("memory +{} KiB, requests {waits:?}", grown_bytes >> 10);
    assert!(waits[10] < Duration::from_millis(200), "{waits:?}");
    assert!(
        grown_bytes < 2 * MAX_GROWTH_BYTES,
        "the memory grew by {grown_bytes} bytes"
    );
    drop(connections);
}
