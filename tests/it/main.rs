//! One test program, so one link. A folder per door, `film` for accuracy against known truth, and
//! `tidy` for the rules of the house.

mod api;
mod cli;
mod common;
mod film;
mod jobs;
mod media;
mod tidy;
