//! Memory for what led where, kept from one plan to the next: to ask the system for it anew takes as
//! long as a tenth of a plan.

use std::sync::{Mutex, PoisonError};

/// Memory that nobody uses at the moment.
#[derive(Debug, Default)]
pub struct Shelf {
    spare: Mutex<Vec<Sheets>>,
}

/// Memory of one half of a plan.
#[derive(Debug, Default)]
pub(super) struct Sheets {
    pub(super) ranks: Vec<u16>,
    pub(super) wins: Vec<u8>,
}

impl Shelf {
    /// Memory of at least so many numbers, of any content.
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

    pub(super) fn give_back(&self, sheets: Sheets) {
        let mut spare = self.spare.lock().unwrap_or_else(PoisonError::into_inner);
        spare.push(sheets);
    }
}
