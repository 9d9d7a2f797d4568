//! Limits of simultaneous work on behalf of waiting requests (docs/explanation/promises.md, "Overload"). If
//! no permit becomes free in time, the request is refused before its work starts.

use std::sync::Arc;
use std::time::Duration;

use tokio::sync::{OwnedSemaphorePermit, Semaphore};
use tokio::time::timeout;

use super::Error;

/// Maximum wait for a permit. Free choice.
const LONGEST_WAIT: Duration = Duration::from_secs(20);

/// A limited number of permits. Clones share them.
#[derive(Clone, Debug)]
pub struct Places {
    free: Arc<Semaphore>,
    longest_wait: Duration,
}

impl Places {
    /// Returns a limit of `n` permits. `longest_wait` is the maximum wait for one.
    pub(super) fn new(n: usize, longest_wait: Duration) -> Places {
        Places {
            free: Arc::new(Semaphore::new(n)),
            longest_wait,
        }
    }

    /// Returns a limit of one permit per processor core.
    pub fn of_cores() -> Places {
        let n_cores = std::thread::available_parallelism().map_or(1, usize::from);
        Places::new(n_cores, LONGEST_WAIT)
    }

    /// Returns a limit of one permit.
    pub fn one() -> Places {
        Places::new(1, LONGEST_WAIT)
    }

    /// Waits for a permit, which is returned when dropped. Fails with [`Error::Busy`] after the maximum wait.
    pub(super) async fn take(&self) -> Result<OwnedSemaphorePermit, Error> {
        let place = timeout(self.longest_wait, self.free.clone().acquire_owned());
        place.await.ok().and_then(Result::ok).ok_or(Error::Busy)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[tokio::test]
    async fn who_finds_no_place_soon_is_told_so_and_the_next_one_has_the_place_that_became_free() {
        let places = Places::new(1, Duration::from_millis(20));
        let first = places.take().await.unwrap();
        assert!(matches!(places.take().await, Err(Error::Busy)));
        drop(first);
        assert!(places.take().await.is_ok());
    }
}
