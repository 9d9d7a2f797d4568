//! The API, tested through the real router over TCP. Most files test one noun of the API.

mod auth;
mod compression;
mod contract;
mod corpus;
mod deletes;
mod docs;
mod downloads;
mod events;
mod fairness;
mod footage;
mod idempotency;
mod jobs;
mod kept;
mod limits;
mod lists;
mod metrics;
mod names;
mod one_call;
mod owners;
mod parameters;
mod pictures;
mod quota;
mod slow_clients;
mod synchronous;
mod uploads;
mod wait;
