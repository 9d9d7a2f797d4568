//! Maintenance of the store by its operator: counts, removal of leftovers and of old data, and backup
//! (docs/explanation/promises.md, "No orphans", "Limited space" and "Restore and upgrade").

pub mod backup;
pub mod census;
pub mod gc;
pub mod retention;
pub mod sweep;
