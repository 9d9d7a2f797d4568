//! The API, tested through the real router over TCP. Most files test one noun of the API.

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
mod owners;
mod parameters;
mod synchronous;
mod uploads;
mod wait;
