//! Maintenance of the store by its operator: counts, removal of leftovers, and backup
//! (docs/explanation/promises.md, "No orphans" and "Restore and upgrade").

pub mod backup;
pub mod census;
pub mod gc;
pub mod sweep;
