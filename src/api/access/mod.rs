//! Access control before any handler runs
//! (docs/explanation/promises.md, "Owners are isolated" and "No cross-site writes").
//!
//! The parts are origin checks (`guard`), tokens (`auth`), sessions of browsers (`session`), signed links to
//! one file (`link`), and rate limits (`rate`).

mod auth;
mod guard;
mod link;
mod rate;
pub(super) mod session;

pub(super) use auth::{Caller, Peer, authenticate};
pub(super) use guard::{Names, guard};
pub use link::signed;
pub(super) use rate::Rates;
