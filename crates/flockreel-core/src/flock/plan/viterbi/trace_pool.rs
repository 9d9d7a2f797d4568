//! Pool of memory for traces, kept from one plan to the next. Requesting that memory from the system takes
//! about a tenth of the time of a plan.

use std::sync::{Mutex, PoisonError};

/// Pool of unused memory.
#[derive(Debug, Default)]
pub struct TracePool {
    spare: Mutex<Vec<TraceMemory>>,
}

/// Memory for the trace of one half of a plan.
#[derive(Debug, Default)]
pub(super) struct TraceMemory {
    pub(super) ranks: Vec<u16>,
    pub(super) wins: Vec<u8>,
}

impl TracePool {
    /// Returns memory for at least `n_ranks` and `n_wins` numbers, with unspecified content.
    pub(super) fn take(&self, n_ranks: usize, n_wins: usize) -> TraceMemory {
        let mut spare = self.spare.lock().unwrap_or_else(PoisonError::into_inner);
        let mut memory = spare.pop().unwrap_or_default();
        drop(spare);
        if memory.ranks.len() < n_ranks {
            memory.ranks = vec![0; n_ranks];
        }
        if memory.wins.len() < n_wins {
            memory.wins = vec![0; n_wins];
        }
        memory
    }

    /// Returns memory to the pool.
    pub(super) fn give_back(&self, memory: TraceMemory) {
        let mut spare = self.spare.lock().unwrap_or_else(PoisonError::into_inner);
        spare.push(memory);
    }
}
