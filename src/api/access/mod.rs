//! Access control before any handler runs
//! (docs/explanation/promises.md, "Owners are isolated" and "No cross-site writes").
//!
//! The parts are origin checks (`guard`), tokens (`auth`), sessions of browsers (`session`, `cookie`), signed
//! links to one file (`link`), rate limits (`rate`), and limits of open requests (`open_requests`).

mod auth;
mod caller;
mod cookie;
mod guard;
mod held_body;
mod link;
mod open_requests;
mod rate;
pub(super) mod session;

pub(super) use auth::{Peer, authenticate};
pub(super) use caller::Caller;
pub(super) use guard::{HostNames, guard};
pub(super) use held_body::hold_until_sent;
pub use link::signed;
pub(super) use open_requests::OpenRequests;
pub(super) use rate::{Rates, network_of};
