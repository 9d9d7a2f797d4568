//! Temporary storage for intermediate data that a long footage makes too large for memory, above all mattes.
//!
//! The algorithms know only the trait [`Scratch`]. `store` implements it with a file; [`InMemory`] serves
//! tests and small data.

use std::fmt::Debug;
use std::io;
use std::sync::{PoisonError, RwLock};

use crate::code::Code;

/// A temporary storage for bytes. It may be used from any thread.
pub trait Scratch: Debug + Send + Sync {
    /// Appends bytes and returns their offset.
    fn put(&self, bytes: &[u8]) -> Result<u64, Full>;

    /// Reads the bytes at offset `at` into `bytes`.
    ///
    /// Panics if reading fails: the computation cannot continue without the data.
    fn get(&self, at: u64, bytes: &mut [u8]);
}

/// The storage cannot take more bytes.
#[derive(Debug, thiserror::Error)]
#[error("the temporary file for the pixels of the animal could not be written: {0}")]
pub struct Full(#[from] io::Error);

impl Full {
    /// Returns the stable code.
    pub fn code(&self) -> Code {
        match self.0.kind() {
            io::ErrorKind::StorageFull | io::ErrorKind::QuotaExceeded => Code::StorageFull,
            _ => Code::Internal,
        }
    }
}

/// Keeps all bytes in memory, for data known to be small.
#[derive(Debug, Default)]
pub struct InMemory(RwLock<Vec<u8>>);

impl Scratch for InMemory {
    fn put(&self, bytes: &[u8]) -> Result<u64, Full> {
        let mut stored = self.0.write().unwrap_or_else(PoisonError::into_inner);
        let at = stored.len() as u64;
        stored.extend_from_slice(bytes);
        Ok(at)
    }

    fn get(&self, at: u64, bytes: &mut [u8]) {
        let stored = self.0.read().unwrap_or_else(PoisonError::into_inner);
        bytes.copy_from_slice(&stored[at as usize..][..bytes.len()]);
    }
}
