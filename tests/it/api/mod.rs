//! The API, through the real router over a real connection; a file per noun.

mod auth;
mod contract;
mod downloads;
mod footage;
mod jobs;
mod walls;
