//! The API, through the real router over a real connection; a file per noun.

mod auth;
mod contract;
mod corpus;
mod deletes;
mod downloads;
mod footage;
mod idempotency;
mod jobs;
mod limits;
mod names;
mod one_call;
mod uploads;
mod wait;
mod walls;
