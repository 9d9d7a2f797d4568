//! Pool of memory for traces, kept from one plan to the next. Requesting that memory from the system takes
//! about a tenth of the time of a plan.

use std::sync::{Mutex, PoisonError};

/// Pool of unused memory.
#[derive(Debug, Default)]
pub struct Shelf {
    spare: Mutex<Vec<Sheets>>,
}

/// Memory for the trace of one half of a plan.
#[derive(Debug, Default)]
pub(super) struct Sheets {
    pub(super) ranks: Vec<u16>,
    pub(super) wins: Vec<u8>,
}

impl Shelf {
    /// Returns memory for at least `n_ranks` and `n_wins` numbers, with unspecified content.
    pub(super) fn take(&self, n_ranks: usize, n_wins: usize) -> Sheets {
        let mut spare = self.spare.lock().unwrap_or_else(PoisonError::into_inner);
        let mut sheets = spare.pop().unwrap_or_default();
        drop(spare);
        if sheets.ranks.len() < n_ranks {
            sheets.ranks = vec![0; n_ranks];
        }
        if sheets.wins.len() < n_wins {
            sheets.wins = vec![0; n_wins];
        }
        sheets
    }

    /// Returns memory to the pool.
    pub(super) fn give_back(&self, sheets: Sheets) {
        let mut spare = self.spare.lock().unwrap_or_else(PoisonError::into_inner);
        spare.push(sheets);
    }
}
