//! The API, through the real router over a real connection; a file per noun.

mod auth;
mod contract;
mod deletes;
mod downloads;
mod footage;
mod idempotency;
mod jobs;
mod one_call;
mod limits;
mod names;
mod uploads;
mod wait;
mod walls;
