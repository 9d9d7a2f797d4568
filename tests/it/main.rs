//! All integration tests, linked as one program to save link time. Each folder tests one interface, except
//! `film` (accuracy against known truth) and `tidy` (conventions of the source code).

#![expect(
    clippy::unwrap_used,
    reason = "a test fails by panicking, helpers of tests too"
)]

mod api;
mod cli;
mod common;
mod film;
mod fuzz;
mod jobs;
pub(crate) mod media;
mod scale;
mod tidy;
