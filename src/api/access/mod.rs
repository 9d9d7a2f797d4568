//! Access control before any handler runs
//! (docs/explanation/promises.md, "Owners are isolated" and "No cross-site writes").
//!
//! The parts are origin checks (`guard`), tokens (`auth`), sessions of browsers (`session`, `cookie`), signed
//! links to one file (`link`), and rate limits (`rate`).

mod auth;
mod caller;
mod cookie;
mod guard;
mod link;
mod rate;
pub(super) mod session;

pub(super) use auth::{Peer, authenticate};
pub(super) use caller::Caller;
pub(super) use guard::{HostNames, guard};
pub use link::signed;
pub(super) use rate::Rates;
