//! What those do who run the service: count what there is, remove what nobody refers to, copy everything
//! (RELIABILITY.md, store rules, R5 and R11).

pub mod backup;
pub mod census;
pub mod gc;
pub mod sweep;
