//! Bytes put aside while something is computed: what a long footage has too much of to hold in memory,
//! mattes above all (ALGORITHMS.md 5, at any size).
//!
//! The algorithms know only that they can put bytes aside and have them back; `store` has the one that
//! goes to a file.

use std::fmt::Debug;
use std::io;
use std::sync::{PoisonError, RwLock};

use crate::code::Code;

/// A place where bytes are put aside, by any thread.
pub trait Scratch: Debug + Send + Sync {
    /// Puts bytes aside and says where.
    fn put(&self, bytes: &[u8]) -> Result<u64, Full>;

    /// Fills `bytes` with those that lie at `at`.
    ///
    /// Panics when they cannot be had back: what the system took and lost cannot be gone on from.
    fn get(&self, at: u64, bytes: &mut [u8]);
}

/// No more bytes can be put aside.
#[derive(Debug, thiserror::Error)]
#[error("the animal's pictures could not be put aside: {0}")]
pub struct Full(#[from] io::Error);

impl Full {
    /// The stable code.
    pub fn code(&self) -> Code {
        match self.0.kind() {
            io::ErrorKind::StorageFull | io::ErrorKind::QuotaExceeded => Code::StorageFull,
            _ => Code::Internal,
        }
    }
}

/// All in memory: for what is known to be small.
#[derive(Debug, Default)]
pub struct InMemory(RwLock<Vec<u8>>);

impl Scratch for InMemory {
    fn put(&self, bytes: &[u8]) -> Result<u64, Full> {
        let mut held = self.0.write().unwrap_or_else(PoisonError::into_inner);
        let at = held.len() as u64;
        held.extend_from_slice(bytes);
        Ok(at)
    }

    fn get(&self, at: u64, bytes: &mut [u8]) {
        let held = self.0.read().unwrap_or_else(PoisonError::into_inner);
        bytes.copy_from_slice(&held[at as usize..][..bytes.len()]);
    }
}
