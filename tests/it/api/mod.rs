//! The API, through the real router over a real connection; a file per noun.

mod at_once;
mod auth;
mod contract;
mod corpus;
mod deletes;
mod docs;
mod downloads;
mod events;
mod footage;
mod idempotency;
mod jobs;
mod limits;
mod metrics;
mod names;
mod one_call;
mod uploads;
mod wait;
mod walls;
