//! Connections without a request under way. If all connections are in use, the one that has been idle for longest
//! gives way (docs/explanation/promises.md, "Slow clients").

use std::collections::BTreeMap;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use tokio_util::sync::CancellationToken;

/// The idle connections of the service.
#[derive(Clone, Debug, Default)]
pub(super) struct IdleConnections(Arc<Mutex<Line>>);

#[derive(Debug, Default)]
struct Line {
    /// Closing signals in the order in which the connections became idle.
    waiting: BTreeMap<u64, CancellationToken>,
    next_place: u64,
}

/// One connection. It is idle from its start until its first request, and between requests.
#[derive(Debug)]
pub(super) struct Idleness {
    line: IdleConnections,
    close: CancellationToken,
    place: Mutex<Option<u64>>,
}

/// A request under way. The connection becomes idle when this is dropped.
#[derive(Debug)]
pub(super) struct Busy(Arc<Idleness>);

impl IdleConnections {
    /// Adds a connection.
    pub(super) fn enter(&self) -> Arc<Idleness> {
        let idleness = Idleness {
            line: self.clone(),
            close: CancellationToken::new(),
            place: Mutex::new(None),
        };
        idleness.begin();
        Arc::new(idleness)
    }

    /// Asks the connection that has been idle for longest to close. Returns whether there was one.
    pub(super) fn close_longest(&self) -> bool {
        let longest = locked(&self.0).waiting.pop_first();
        longest.map(|(_, close)| close.cancel()).is_some()
    }
}

impl Idleness {
    /// Returns once the connection should close.
    pub(super) async fn must_close(&self) {
        self.close.cancelled().await;
    }

    /// Whether a request is under way.
    pub(super) fn is_busy(&self) -> bool {
        locked(&self.place).is_none()
    }

    /// Ends the idleness: a request begins.
    pub(super) fn end(self: &Arc<Self>) {
        if let Some(place) = locked(&self.place).take() {
            locked(&self.line.0).waiting.remove(&place);
        }
    }

    /// Returns the request that is under way. When it is dropped, the connection is idle again.
    pub(super) fn busy(self: &Arc<Self>) -> Busy {
        Busy(self.clone())
    }

    fn begin(&self) {
        let mut line = locked(&self.line.0);
        let place = line.next_place;
        line.next_place += 1;
        line.waiting.insert(place, self.close.clone());
        *locked(&self.place) = Some(place);
    }
}

impl Drop for Idleness {
    fn drop(&mut self) {
        if let Some(place) = locked(&self.place).take() {
            locked(&self.line.0).waiting.remove(&place);
        }
    }
}

impl Drop for Busy {
    fn drop(&mut self) {
        self.0.begin();
    }
}

fn locked<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn longest_idle_connection_closes_first_and_busy_ones_never() {
        let line = IdleConnections::default();
        let (first, second, third) = (line.enter(), line.enter(), line.enter());
        first.end();
        assert!(line.close_longest());
        assert!(second.close.is_cancelled() && !third.close.is_cancelled());
        drop(first.busy());
        assert!(line.close_longest());
        assert!(third.close.is_cancelled() && !first.close.is_cancelled());
        drop(first);
        assert!(!line.close_longest());
    }
}
