//! Rate limits (docs/explanation/promises.md, "Overload"): a token bucket for each owner. It refills at a
//! steady rate, and every request takes one unit. One program in a loop therefore does not slow down other
//! owners.
//!
//! Requests are counted per owner and not per address, because many users may share an address, and a header
//! that names another address can be forged. Requests refused with 401 have no owner. They are counted by the
//! address of the connection. A crate for rate limits would replace only the bucket, the smaller part of this
//! file.

use std::collections::HashMap;
use std::hash::Hash;
use std::net::{IpAddr, Ipv6Addr};
use std::sync::{Mutex, PoisonError};
use std::time::Instant;

use crate::store::owners::{Account, Owner};

/// Size of a bucket, seconds of its rate. Free choice.
const BURST_S: f64 = 4.0;
/// Number of buckets from which full ones are removed. A removed bucket counts as full. Free choice.
const MAX_BUCKETS: usize = 10_000;

/// Refused requests of an address, and sessions of an owner, at once and per second. Free choice.
const RARE: Limit = Limit {
    burst: 30.0,
    per_s: 1.0,
};

/// Buckets of the requests and sessions of all owners, and of all addresses with refused requests.
#[derive(Debug)]
pub(in crate::api) struct Rates {
    /// Requests per second of each owner; 0 = no limit.
    per_s: f64,
    owners: Buckets<Owner>,
    sessions: Buckets<Owner>,
    refused_addresses: Buckets<IpAddr>,
}

/// Size and refill rate of a bucket.
#[derive(Clone, Copy, Debug)]
struct Limit {
    /// Requests at once.
    burst: f64,
    /// Requests per second.
    per_s: f64,
}

#[derive(Debug)]
struct Buckets<Key>(Mutex<HashMap<Key, Bucket>>);

#[derive(Clone, Copy, Debug)]
struct Bucket {
    n_left: f64,
    at: Instant,
}

impl Rates {
    /// Returns full buckets. Those of owners refill at `per_s` requests per second; 0 = no limit.
    pub(in crate::api) fn new(per_s: u32) -> Rates {
        Rates {
            per_s: f64::from(per_s),
            owners: Buckets(Mutex::default()),
            sessions: Buckets(Mutex::default()),
            refused_addresses: Buckets(Mutex::default()),
        }
    }

    /// Takes one request from the bucket of the account's owner. Returns false if the bucket is empty.
    /// Accounts without a quota, which are local requests, have no limit.
    pub(super) fn take(&self, account: &Account, now: Instant) -> bool {
        if self.per_s == 0.0 || account.quota.is_none() {
            return true;
        }
        let limit = Limit {
            burst: self.per_s * BURST_S,
            per_s: self.per_s,
        };
        self.owners.take(&account.owner, limit, now)
    }

    /// Takes one request and one session from the buckets of the account's owner. Returns false if one is empty.
    pub(super) fn take_session(&self, account: &Account, now: Instant) -> bool {
        self.take(account, now) && self.sessions.take(&account.owner, RARE, now)
    }

    /// Takes one refusal from the bucket of an address. Returns false if the bucket is empty. Requests with a
    /// valid token from this address are not affected.
    pub(super) fn take_refusal(&self, peer: IpAddr, now: Instant) -> bool {
        self.refused_addresses.take(&network_of(peer), RARE, now)
    }
}

/// Returns the address by which a client is counted. A client with one IPv6 address usually has its whole /64 network.
pub(in crate::api) fn network_of(peer: IpAddr) -> IpAddr {
    match peer {
        IpAddr::V4(_) => peer,
        IpAddr::V6(address) => Ipv6Addr::from_bits(address.to_bits() >> 64 << 64).into(),
    }
}

impl<Key: Clone + Eq + Hash> Buckets<Key> {
    fn take(&self, key: &Key, limit: Limit, now: Instant) -> bool {
        let filled = |bucket: &Bucket| {
            let passed_s = now.saturating_duration_since(bucket.at).as_secs_f64();
            limit.burst.min(bucket.n_left + passed_s * limit.per_s)
        };
        let mut buckets = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        if buckets.len() >= MAX_BUCKETS {
            buckets.retain(|_, bucket| filled(bucket) < limit.burst);
        }
        let n_left = buckets.get(key).map_or(limit.burst, filled);
        let taken = n_left >= 1.0;
        let n_left = if taken { n_left - 1.0 } else { n_left };
        buckets.insert(key.clone(), Bucket { n_left, at: now });
        taken
    }
}

#[cfg(test)]
mod tests {
    use std::time::Duration;

    use super::*;

    #[test]
    fn owner_gets_a_burst_and_then_the_steady_rate() {
        let (rates, start) = (Rates::new(5), Instant::now());
        let of = |name: &str| Account {
            owner: Owner(name.to_owned()),
            quota: Some(1),
        };
        let (one, other) = (of("one"), of("other"));
        let n_taken = |account: &Account, after_ms: u64| {
            let now = start + Duration::from_millis(after_ms);
            (0..100).filter(|_| rates.take(account, now)).count()
        };
        assert_eq!(n_taken(&one, 0), 20);
        assert_eq!(n_taken(&one, 100), 0);
        assert_eq!(n_taken(&one, 1_000), 5);
        assert_eq!(n_taken(&other, 1_000), 20, "another's bucket is its own");
        assert_eq!(
            n_taken(&one, 3_600_000),
            20,
            "no more than a burst is saved"
        );
    }

    #[test]
    fn sessions_take_from_the_rate_of_their_owner_and_have_a_lower_one() {
        let now = Instant::now();
        let owner = Account {
            quota: Some(1),
            ..Account::local()
        };
        for (rate, n_sessions) in [(5, 20), (200, 30), (0, 30)] {
            let rates = Rates::new(rate);
            let taken = (0..100).filter(|_| rates.take_session(&owner, now));
            assert_eq!(taken.count(), n_sessions, "{rate}");
        }
    }

    #[test]
    fn rate_zero_and_local_requests_have_no_limit() {
        let (now, local) = (Instant::now(), Account::local());
        let bounded = Account {
            quota: Some(1),
            ..Account::local()
        };
        assert!((0..1000).all(|_| Rates::new(0).take(&bounded, now)));
        let rates = Rates::new(1);
        assert!((0..1000).all(|_| rates.take(&local, now)));
    }

    #[test]
    fn address_has_thirty_refusals_and_then_one_per_second() {
        let (rates, start) = (Rates::new(0), Instant::now());
        let n_taken = |peer: &str, after_s: u64| {
            let now = start + Duration::from_secs(after_s);
            let peer = peer.parse().unwrap();
            (0..100).filter(|_| rates.take_refusal(peer, now)).count()
        };
        assert_eq!(n_taken("192.0.2.1", 0), 30);
        assert_eq!(n_taken("192.0.2.1", 5), 5);
        assert_eq!(n_taken("192.0.2.2", 5), 30);
        assert_eq!(n_taken("2001:db8::1", 5), 30);
        assert_eq!(n_taken("2001:db8::2", 5), 0, "the same network");
    }
}
