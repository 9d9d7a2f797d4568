//! One test program, so one link. A folder per door, `film` for accuracy against known truth, and
//! `tidy` for the rules of the house.

#![expect(
    clippy::unwrap_used,
    reason = "a test fails by panicking, helpers of tests too"
)]

mod api;
mod cli;
mod common;
mod film;
mod jobs;
pub(crate) mod media;
mod scale;
mod tidy;
