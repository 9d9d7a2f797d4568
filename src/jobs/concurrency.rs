//! Limits of simultaneous work on behalf of waiting requests (docs/explanation/promises.md, "Overload"). If
//! no permit becomes free in time, the request is refused before its work starts.

use std::sync::Arc;
use std::time::Duration;

use tokio::sync::{OwnedSemaphorePermit, Semaphore};
use tokio::time::timeout;

use super::Error;

/// Maximum wait for a permit. Free choice.
const MAX_WAIT: Duration = Duration::from_secs(20);

/// A limited number of permits. Clones share them.
#[derive(Clone, Debug)]
pub struct ConcurrencyLimit {
    permits: Arc<Semaphore>,
    max_wait: Duration,
}

impl ConcurrencyLimit {
    /// Returns a limit of `n` permits. `max_wait` is the maximum wait for one.
    pub(super) fn new(n: usize, max_wait: Duration) -> ConcurrencyLimit {
        ConcurrencyLimit {
            permits: Arc::new(Semaphore::new(n)),
            max_wait,
        }
    }

    /// Returns a limit of one permit per processor core.
    pub fn per_core() -> ConcurrencyLimit {
        let n_cores = std::thread::available_parallelism().map_or(1, usize::from);
        ConcurrencyLimit::new(n_cores, MAX_WAIT)
    }

    /// Returns a limit of one permit.
    pub fn one() -> ConcurrencyLimit {
        ConcurrencyLimit::new(1, MAX_WAIT)
    }

    /// Waits for a permit, which is returned when dropped. Fails with [`Error::Busy`] after the maximum wait.
    pub(super) async fn acquire(&self) -> Result<OwnedSemaphorePermit, Error> {
        let permit = timeout(self.max_wait, self.permits.clone().acquire_owned());
        permit.await.ok().and_then(Result::ok).ok_or(Error::Busy)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[tokio::test]
    async fn acquiring_times_out_while_all_permits_are_taken_and_succeeds_after_release() {
        let limit = ConcurrencyLimit::new(1, Duration::from_millis(20));
        let first = limit.acquire().await.unwrap();
        assert!(matches!(limit.acquire().await, Err(Error::Busy)));
        drop(first);
        assert!(limit.acquire().await.is_ok());
    }
}
