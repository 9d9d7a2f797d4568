//! How much is done at once for those who wait for it (RELIABILITY.md, H5): who finds no place soon is told to come
//! again, before anything is begun.

use std::sync::Arc;
use std::time::Duration;

use tokio::sync::{OwnedSemaphorePermit, Semaphore};
use tokio::time::timeout;

use super::Error;

/// The longest wait for a place.
const LONGEST_WAIT: Duration = Duration::from_secs(20);

/// Some places.
#[derive(Clone, Debug)]
pub struct Places {
    free: Arc<Semaphore>,
    longest_wait: Duration,
}

impl Places {
    /// So many, for which others wait so long.
    pub(super) fn new(n: usize, longest_wait: Duration) -> Places {
        Places {
            free: Arc::new(Semaphore::new(n)),
            longest_wait,
        }
    }

    /// One for each core.
    pub fn of_cores() -> Places {
        let n_cores = std::thread::available_parallelism().map_or(1, usize::from);
        Places::new(n_cores, LONGEST_WAIT)
    }

    /// One alone.
    pub fn one() -> Places {
        Places::new(1, LONGEST_WAIT)
    }

    /// A place until it is dropped; [`Error::Busy`] where none becomes free soon.
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
