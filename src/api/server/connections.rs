//! The open connections of each address. If all are in use, a connection of the address that has most of them gives way
//! to one of an address that has fewer (docs/explanation/promises.md, "Slow clients").

use std::collections::{BTreeMap, HashMap};
use std::net::IpAddr;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use tokio_util::sync::CancellationToken;

/// The open connections of the service.
#[derive(Clone, Debug, Default)]
pub(super) struct Connections(Arc<Mutex<Table>>);

#[derive(Debug, Default)]
struct Table {
    by_address: HashMap<IpAddr, OfAddress>,
    next_turn: u64,
}

/// Closing signals of the connections of an address, in the order in which they became idle or busy.
#[derive(Debug, Default)]
struct OfAddress {
    idle: BTreeMap<u64, CancellationToken>,
    busy: BTreeMap<u64, CancellationToken>,
}

/// One connection. It is idle from its start until its first request, and between requests.
#[derive(Debug)]
pub(super) struct Connection {
    table: Connections,
    address: IpAddr,
    close: CancellationToken,
    turn: Mutex<u64>,
}

/// A request under way. The connection becomes idle when this is dropped.
#[derive(Debug)]
pub(super) struct Busy(Arc<Connection>);

impl Connections {
    /// Adds a connection from an address.
    pub(super) fn enter(&self, address: IpAddr) -> Arc<Connection> {
        let close = CancellationToken::new();
        let turn = {
            let mut table = locked(&self.0);
            let turn = table.next_turn();
            table.of(address).idle.insert(turn, close.clone());
            turn
        };
        Arc::new(Connection {
            table: self.clone(),
            address,
            close,
            turn: Mutex::new(turn),
        })
    }

    /// Closes a connection so that `newcomer` can have one, and returns whether there was one to close. If an address
    /// has more connections than the newcomer would have, it is the longest idle one of the address with most, or its
    /// longest busy one. Otherwise it is the longest idle one of the newcomer.
    pub(super) fn make_room(&self, newcomer: IpAddr) -> bool {
        let mut table = locked(&self.0);
        let share = table.by_address.get(&newcomer).map_or(0, OfAddress::len) + 1;
        let most = table
            .by_address
            .iter()
            .max_by_key(|(address, of)| (of.len(), **address));
        let richest = most
            .filter(|(_, of)| of.len() > share)
            .map(|(address, _)| *address);
        let Some(of) = table.by_address.get_mut(&richest.unwrap_or(newcomer)) else {
            return false;
        };
        let longest = match of.idle.pop_first() {
            None if richest.is_some() => of.busy.pop_first(),
            idle => idle,
        };
        longest.map(|(_, close)| close.cancel()).is_some()
    }
}

impl Table {
    fn next_turn(&mut self) -> u64 {
        self.next_turn += 1;
        self.next_turn
    }

    fn of(&mut self, address: IpAddr) -> &mut OfAddress {
        self.by_address.entry(address).or_default()
    }
}

impl OfAddress {
    fn len(&self) -> usize {
        self.idle.len() + self.busy.len()
    }
}

impl Connection {
    /// Returns once the connection must close.
    pub(super) async fn must_close(&self) {
        self.close.cancelled().await;
    }

    /// Begins a request. The connection is idle again once [`Connection::busy`] is dropped.
    pub(super) fn begin(&self) {
        self.change(|of, turn, close| {
            of.idle.remove(&turn.0);
            of.busy.insert(turn.1, close);
        });
    }

    /// Returns the request that is under way.
    pub(super) fn busy(self: &Arc<Self>) -> Busy {
        Busy(self.clone())
    }

    /// Moves the connection in the table, unless it was asked to close. `turn` is its old and its new turn.
    fn change(&self, movement: impl FnOnce(&mut OfAddress, (u64, u64), CancellationToken)) {
        let mut table = locked(&self.table.0);
        if self.close.is_cancelled() {
            return;
        }
        let mut turn = locked(&self.turn);
        let next = table.next_turn();
        movement(table.of(self.address), (*turn, next), self.close.clone());
        *turn = next;
    }
}

impl Drop for Connection {
    fn drop(&mut self) {
        let mut table = locked(&self.table.0);
        let (of, turn) = (table.of(self.address), locked(&self.turn));
        of.idle.remove(&turn);
        of.busy.remove(&turn);
        if of.len() == 0 {
            table.by_address.remove(&self.address);
        }
    }
}

impl Drop for Busy {
    fn drop(&mut self) {
        self.0.change(|of, turn, close| {
            of.busy.remove(&turn.0);
            of.idle.insert(turn.1, close);
        });
    }
}

fn locked<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn address(last: u8) -> IpAddr {
        [192, 0, 2, last].into()
    }

    #[test]
    fn own_longest_idle_connection_closes_first_and_busy_ones_never() {
        let table = Connections::default();
        let (first, second, third) = (
            table.enter(address(1)),
            table.enter(address(1)),
            table.enter(address(1)),
        );
        first.begin();
        assert!(table.make_room(address(1)));
        assert!(second.close.is_cancelled() && !third.close.is_cancelled());
        drop(first.busy());
        assert!(table.make_room(address(1)));
        assert!(third.close.is_cancelled() && !first.close.is_cancelled());
        first.begin();
        assert!(!table.make_room(address(1)));
        drop((first, second, third));
        assert!(locked(&table.0).by_address.is_empty());
    }

    #[test]
    fn address_with_most_connections_gives_way_to_others_and_keeps_its_share() {
        let table = Connections::default();
        let many: Vec<_> = (0..5).map(|_| table.enter(address(1))).collect();
        many.iter().for_each(|connection| connection.begin());
        let mut others = Vec::new();
        for _ in 0..3 {
            assert!(table.make_room(address(2)) || others.len() == 2);
            others.push(table.enter(address(2)));
        }
        let closed = many
            .iter()
            .filter(|connection| connection.close.is_cancelled());
        assert_eq!(closed.count(), 2);
        assert!(many[0].close.is_cancelled() && many[1].close.is_cancelled());
    }
}
