//! Limits of the requests that are open at the same time (docs/explanation/promises.md, "Overload"). A request is
//! open until its response is sent, so an event stream is open for as long as its reader stays. One client can
//! therefore not occupy all connections.

use std::collections::HashMap;
use std::net::IpAddr;
use std::sync::{Arc, Mutex, PoisonError};

use crate::store::owners::Owner;

/// Open requests of one address to routes that need no token. Many people may share an address, and a proxy has
/// one for all of them, so this is half of all connections.
const MAX_OF_ADDRESS: u32 = 1024;

/// Whose open requests are counted together.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
pub(super) enum Client {
    Owner(Owner),
    Address(IpAddr),
}

/// The numbers of open requests.
#[derive(Debug)]
pub(in crate::api) struct OpenRequests {
    /// Largest number of one owner; 0 = no limit.
    max_of_owner: u32,
    counts: Arc<Counts>,
}

type Counts = Mutex<HashMap<Client, u32>>;

/// One open request. It ends when this is dropped.
#[derive(Debug)]
pub(super) struct OpenRequest {
    client: Client,
    counts: Arc<Counts>,
}

impl OpenRequests {
    pub(in crate::api) fn new(max_of_owner: u32) -> OpenRequests {
        OpenRequests {
            max_of_owner,
            counts: Arc::default(),
        }
    }

    /// Counts a request. Returns `None` if the client has as many open requests as it may.
    pub(super) fn open(&self, client: Client) -> Option<OpenRequest> {
        let max = match (&client, self.max_of_owner) {
            (Client::Address(_), _) => MAX_OF_ADDRESS,
            (Client::Owner(_), 0) => u32::MAX,
            (Client::Owner(_), max) => max,
        };
        let mut counts = self.counts.lock().unwrap_or_else(PoisonError::into_inner);
        let count = counts.entry(client.clone()).or_default();
        if *count >= max {
            return None;
        }
        *count += 1;
        Some(OpenRequest {
            client,
            counts: self.counts.clone(),
        })
    }
}

impl Drop for OpenRequest {
    fn drop(&mut self) {
        let mut counts = self.counts.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(count) = counts.get_mut(&self.client) {
            *count -= 1;
            if *count == 0 {
                counts.remove(&self.client);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn owner_gets_no_more_than_its_requests_until_one_ends() {
        let requests = OpenRequests::new(2);
        let client = |name: &str| Client::Owner(Owner(name.to_owned()));
        let first = requests.open(client("a")).unwrap();
        let second = requests.open(client("a")).unwrap();
        assert!(requests.open(client("a")).is_none());
        assert!(requests.open(client("b")).is_some());
        drop(second);
        let third = requests.open(client("a"));
        assert!(third.is_some());
        drop((first, third));
        assert!(requests.counts.lock().unwrap().is_empty());
    }
}
