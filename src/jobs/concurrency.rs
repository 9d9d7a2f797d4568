//! Limits of simultaneous work on behalf of waiting requests (docs/explanation/promises.md, "Overload").
//! Owners take turns, and one owner cannot hold all permits, so an owner with one request does not wait for the work of
//! another. If no permit becomes free in time, the request is refused before its work starts.

use std::collections::{HashMap, VecDeque};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use tokio::sync::oneshot;
use tokio::time::timeout;

use super::Error;
use crate::store::owners::Owner;

/// Maximum wait for a permit. Free choice.
const MAX_WAIT: Duration = Duration::from_secs(20);

/// A limited number of permits. Clones share them.
#[derive(Clone, Debug)]
pub struct ConcurrencyLimit {
    line: Arc<Mutex<Line>>,
    max_wait: Duration,
}

/// Permission to work. Dropping it passes it on.
#[derive(Debug)]
pub(super) struct Permit {
    /// `None` for a permit that nobody took.
    line: Option<Arc<Mutex<Line>>>,
    owner: Owner,
}

/// The free permits, those who hold one, and those who wait.
#[derive(Debug)]
struct Line {
    n_free: usize,
    /// Largest number of permits of one owner.
    max_of_owner: usize,
    /// Number of permits by owner.
    n_held: HashMap<Owner, usize>,
    /// Owners in the order of their turns, each with its requests in the order of their arrival. No owner is
    /// listed twice.
    owners: VecDeque<(Owner, VecDeque<oneshot::Sender<Permit>>)>,
}

impl ConcurrencyLimit {
    /// Returns a limit of `n` permits, of which one owner holds at most `max_of_owner`. `max_wait` is the maximum wait for
    /// one.
    pub(super) fn new(n: usize, max_of_owner: usize, max_wait: Duration) -> ConcurrencyLimit {
        let line = Line {
            n_free: n,
            max_of_owner,
            n_held: HashMap::new(),
            owners: VecDeque::new(),
        };
        ConcurrencyLimit {
            line: Arc::new(Mutex::new(line)),
            max_wait,
        }
    }

    /// Returns a limit of one permit per processor core, at least two. One of them is for other owners.
    pub fn per_core() -> ConcurrencyLimit {
        let n_cores = std::thread::available_parallelism().map_or(1, usize::from);
        let n = n_cores.max(2);
        ConcurrencyLimit::new(n, n - 1, MAX_WAIT)
    }

    /// Returns a limit of one permit.
    pub fn one() -> ConcurrencyLimit {
        ConcurrencyLimit::new(1, 1, MAX_WAIT)
    }

    /// Waits for a permit, which is passed on when dropped. Fails with [`Error::Busy`] after the maximum wait.
    pub(super) async fn acquire(&self, owner: &Owner) -> Result<Permit, Error> {
        let turn = {
            let mut line = locked(&self.line);
            if line.n_free > 0 && line.may_hold_more(owner) {
                return Ok(line.permit(owner.clone(), self.line.clone()));
            }
            let (sender, turn) = oneshot::channel();
            line.add(owner, sender);
            turn
        };
        let permit = timeout(self.max_wait, turn).await;
        permit.ok().and_then(Result::ok).ok_or(Error::Busy)
    }
}

impl Line {
    fn add(&mut self, owner: &Owner, sender: oneshot::Sender<Permit>) {
        match self.owners.iter_mut().find(|(other, _)| other == owner) {
            Some((_, requests)) => {
                requests.retain(|request| !request.is_closed());
                requests.push_back(sender);
            }
            None => (self.owners).push_back((owner.clone(), VecDeque::from([sender]))),
        }
    }

    fn may_hold_more(&self, owner: &Owner) -> bool {
        self.n_held.get(owner).copied().unwrap_or(0) < self.max_of_owner
    }

    /// Returns one of the free permits.
    fn permit(&mut self, owner: Owner, line: Arc<Mutex<Line>>) -> Permit {
        self.n_free -= 1;
        *self.n_held.entry(owner.clone()).or_default() += 1;
        Permit {
            line: Some(line),
            owner,
        }
    }

    fn take_back(&mut self, owner: &Owner) {
        self.n_free += 1;
        if let Some(n_held) = self.n_held.get_mut(owner) {
            *n_held -= 1;
            if *n_held == 0 {
                self.n_held.remove(owner);
            }
        }
    }

    /// Takes the next request of an owner that may hold a permit, and puts its owner at the end of the line.
    fn next(&mut self) -> Option<(Owner, oneshot::Sender<Permit>)> {
        let at = (self.owners.iter()).position(|(owner, _)| self.may_hold_more(owner))?;
        let (owner, mut requests) = self.owners.remove(at)?;
        let request = requests.pop_front()?;
        if !requests.is_empty() {
            self.owners.push_back((owner.clone(), requests));
        }
        Some((owner, request))
    }
}

impl Drop for Permit {
    fn drop(&mut self) {
        let Some(shared) = self.line.take() else {
            return;
        };
        let mut line = locked(&shared);
        line.take_back(&self.owner);
        while line.n_free > 0
            && let Some((owner, request)) = line.next()
        {
            let permit = line.permit(owner, shared.clone());
            // The request may have given up.
            if let Err(mut unused) = request.send(permit) {
                unused.line = None;
                line.take_back(&unused.owner);
            }
        }
    }
}

fn locked(line: &Mutex<Line>) -> MutexGuard<'_, Line> {
    line.lock().unwrap_or_else(PoisonError::into_inner)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn owner(name: &str) -> Owner {
        Owner(name.to_owned())
    }

    #[tokio::test]
    async fn acquiring_times_out_while_all_permits_are_taken_and_succeeds_after_release() {
        let limit = ConcurrencyLimit::new(1, 1, Duration::from_millis(20));
        let first = limit.acquire(&owner("a")).await.unwrap();
        assert!(matches!(limit.acquire(&owner("a")).await, Err(Error::Busy)));
        drop(first);
        let second = limit.acquire(&owner("a")).await.unwrap();
        drop(second);
        assert_eq!(locked(&limit.line).n_free, 1);
    }

    #[tokio::test]
    async fn one_request_waits_only_for_one_turn_of_another_owner() {
        let limit = ConcurrencyLimit::new(1, 1, Duration::from_secs(60));
        let first = limit.acquire(&owner("a")).await.unwrap();
        let order = Arc::new(Mutex::new(Vec::new()));
        let mut tasks = Vec::new();
        for name in ["a", "a", "a", "b", "a"] {
            let (limit, order) = (limit.clone(), order.clone());
            tasks.push(tokio::spawn(async move {
                let _permit = limit.acquire(&owner(name)).await.unwrap();
                order.lock().unwrap().push(name);
            }));
            // Every task waits in the line before the next one starts.
            tokio::task::yield_now().await;
        }
        drop(first);
        for task in tasks {
            task.await.unwrap();
        }
        assert_eq!(*order.lock().unwrap(), ["a", "b", "a", "a", "a"]);
    }

    #[tokio::test]
    async fn one_owner_never_holds_all_permits() {
        let limit = ConcurrencyLimit::new(3, 2, Duration::from_millis(20));
        let first = limit.acquire(&owner("a")).await.unwrap();
        let _second = limit.acquire(&owner("a")).await.unwrap();
        assert!(matches!(limit.acquire(&owner("a")).await, Err(Error::Busy)));
        let _other = limit.acquire(&owner("b")).await.unwrap();
        drop(first);
        let _third = limit.acquire(&owner("a")).await.unwrap();
    }
}
