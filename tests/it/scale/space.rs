//! The limit of an owner's space, checked by two services at the same moment (docs/explanation/promises.md, "Limited
//! space").

use futures_util::future::join_all;
use reqwest::{Response, StatusCode};

use crate::common::app::code_of;
use crate::common::process::{Server, numbered_film};
use crate::common::{Place, tus};

/// Number of requests that come at the same moment.
const N_REQUESTS: usize = 24;

/// Two services, each as on its own machine, that grant every owner this many bytes.
struct Pair {
    servers: [Server; 2],
    _machines: [Place; 2],
}

impl Pair {
    fn start(max_owner_bytes: usize) -> Pair {
        let place = Place::shared();
        let machines = [place.second_machine(), place.second_machine()];
        let servers = machines.each_ref().map(|machine| {
            let mut flags = machine.server_flags();
            flags.push(format!("--max-owner-bytes={max_owner_bytes}"));
            let flags: Vec<&str> = flags.iter().map(String::as_str).collect();
            Server::start_with(machine.data(), &flags)
        });
        Pair {
            servers,
            _machines: machines,
        }
    }

    /// Sends requests to both services at the same moment. Returns how many were accepted; asserts that the others
    /// were refused for lack of space.
    async fn n_accepted(&self, send: impl AsyncFn(&Server, usize) -> Response) -> usize {
        let both = (0..N_REQUESTS).map(|k| send(&self.servers[k % 2], k));
        let mut n_accepted = 0;
        for answer in join_all(both).await {
            if answer.status() == StatusCode::CREATED {
                n_accepted += 1;
            } else {
                assert_eq!(code_of(answer, 507).await, "owner_storage_full");
            }
        }
        n_accepted
    }

    /// Returns the bytes that count against the limit.
    async fn used_bytes(&self) -> usize {
        let usage = self.servers[0].json("/v1/usage").await;
        usize::try_from(usage["used_bytes"].as_u64().unwrap()).unwrap()
    }
}

#[tokio::test(flavor = "multi_thread")]
#[ignore = "needs PostgreSQL and a bucket: make scale-test"]
async fn uploads_begun_at_two_services_do_not_exceed_the_limit_of_their_owner() {
    let (n_bytes, n_fitting) = (1000, 5);
    let pair = Pair::start(n_fitting * n_bytes + n_bytes / 2);
    let begin = async |server: &Server, _: usize| {
        let request = tus::request(&server.base, "POST", "/v1/uploads");
        let request = request.header("upload-length", n_bytes);
        request.send().await.unwrap()
    };
    assert_eq!(pair.n_accepted(begin).await, n_fitting);
    assert_eq!(pair.used_bytes().await, n_fitting * n_bytes);
}

#[tokio::test(flavor = "multi_thread")]
#[ignore = "needs PostgreSQL and a bucket: make scale-test"]
async fn films_sent_to_two_services_do_not_exceed_the_limit_of_their_owner() {
    // A body counts while it arrives, so fewer films than fit may be accepted.
    let n_fitting = 3;
    let max_owner_bytes = n_fitting * stored_size().await;
    let pair = Pair::start(max_owner_bytes);
    let upload = async |server: &Server, k: usize| server.upload(numbered_film(k)).await;
    let n_accepted = pair.n_accepted(upload).await;
    assert!((1..=n_fitting).contains(&n_accepted), "{n_accepted} films");
    assert!(pair.used_bytes().await <= max_owner_bytes);
}

/// Returns the stored size of a film with its poster, bytes.
async fn stored_size() -> usize {
    let pair = Pair::start(1 << 30);
    pair.servers[0].upload(numbered_film(0)).await;
    pair.used_bytes().await
}
