//! How often one owner may ask (RELIABILITY.md, H5): a bucket for each, filled at a steady rate, emptied by
//! one for every request, so that one program in a loop does not slow everybody's page. By owner, never by
//! address: many sit behind one address, and a header that names another is anybody's to write.

use std::collections::HashMap;
use std::sync::{Mutex, PoisonError};
use std::time::Instant;

use crate::store::owners::{Account, Owner};

/// A burst may be as large as this many seconds' requests.
const BURST_S: f64 = 4.0;
/// Buckets kept; the full ones are forgotten beyond.
const MAX_BUCKETS: usize = 10_000;

/// The buckets of all owners.
#[derive(Debug)]
pub(in crate::api) struct Rates {
    /// Requests a second, 0 for any number.
    per_s: f64,
    buckets: Mutex<HashMap<Owner, Bucket>>,
}

#[derive(Clone, Copy, Debug)]
struct Bucket {
    n_left: f64,
    at: Instant,
}

impl Rates {
    /// Full buckets, filled with `per_s` requests a second.
    pub(in crate::api) fn new(per_s: u32) -> Rates {
        Rates {
            per_s: f64::from(per_s),
            buckets: Mutex::default(),
        }
    }

    /// Takes one request out of the bucket of the account's owner; false where it is empty. Whoever has
    /// no quota, on the machine itself, has no rate either.
    pub(super) fn take(&self, account: &Account, now: Instant) -> bool {
        if self.per_s == 0.0 || account.quota.is_none() {
            return true;
        }
        let owner = &account.owner;
        let full = self.per_s * BURST_S;
        let filled = |bucket: &Bucket| {
            let passed_s = now.saturating_duration_since(bucket.at).as_secs_f64();
            full.min(bucket.n_left + passed_s * self.per_s)
        };
        let mut buckets = self.buckets.lock().unwrap_or_else(PoisonError::into_inner);
        if buckets.len() >= MAX_BUCKETS {
            buckets.retain(|_, bucket| filled(bucket) < full);
        }
        let n_left = buckets.get(owner).map_or(full, filled);
        let taken = n_left >= 1.0;
        let n_left = if taken { n_left - 1.0 } else { n_left };
        buckets.insert(owner.clone(), Bucket { n_left, at: now });
        taken
    }
}

#[cfg(test)]
mod tests {
    use std::time::Duration;

    use super::*;

    #[test]
    fn a_burst_is_answered_and_then_the_steady_rate() {
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
    fn a_rate_of_zero_bounds_nobody_and_no_rate_bounds_this_machine() {
        let (now, local) = (Instant::now(), Account::local());
        let bounded = Account {
            quota: Some(1),
            ..Account::local()
        };
        assert!((0..1000).all(|_| Rates::new(0).take(&bounded, now)));
        let rates = Rates::new(1);
        assert!((0..1000).all(|_| rates.take(&local, now)));
    }
}
