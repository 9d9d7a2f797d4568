//! Decides which leases have ended (docs/explanation/promises.md, "Time jumps"). A lease has ended if no heartbeat has
//! changed it for its whole duration, as this process measures time. The clocks of the machines, which may be
//! wrong and may jump, have no part in it.

use std::collections::HashMap;
use std::time::{Duration, Instant};

use crate::store::jobs::rescue::HeldLease;

/// The leases of running jobs, each with the time at which it was first seen.
#[derive(Debug, Default)]
pub(super) struct LeaseWatch(HashMap<HeldLease, Instant>);

impl LeaseWatch {
    /// Takes the leases of all running jobs at the time `now`. Returns those that have not changed for `duration`.
    pub(super) fn ended(
        &mut self,
        held: Vec<HeldLease>,
        duration: Duration,
        now: Instant,
    ) -> Vec<HeldLease> {
        let seen = |lease: &HeldLease| self.0.get(lease).copied().unwrap_or(now);
        self.0 = held
            .into_iter()
            .map(|lease| (lease, seen(&lease)))
            .collect();
        let mut ended: Vec<_> = (self.0.iter())
            .filter(|(_, since)| now.saturating_duration_since(**since) >= duration)
            .map(|(lease, _)| *lease)
            .collect();
        ended.sort_by_key(|lease| lease.job_id);
        ended
    }
}

#[cfg(test)]
mod tests {
    use uuid::Uuid;

    use super::*;

    #[test]
    fn lease_ends_after_its_duration_without_a_change_whatever_its_clock_says() {
        let (mut watch, begin) = (LeaseWatch::default(), Instant::now());
        let after = |seconds| begin + Duration::from_secs(seconds);
        let duration = Duration::from_secs(15);
        let lease = |until_ms| HeldLease {
            job_id: Uuid::nil(),
            fence: 1,
            until_ms,
        };
        assert_eq!(watch.ended(vec![lease(0)], duration, after(0)), []);
        // A heartbeat of a worker whose clock has jumped back.
        assert_eq!(watch.ended(vec![lease(-9)], duration, after(14)), []);
        assert_eq!(watch.ended(vec![lease(-9)], duration, after(28)), []);
        assert_eq!(
            watch.ended(vec![lease(-9)], duration, after(29)),
            [lease(-9)]
        );
        assert_eq!(watch.ended(Vec::new(), duration, after(30)), []);
        assert_eq!(watch.ended(vec![lease(-9)], duration, after(31)), []);
    }
}
