//! Who may ask, before any handler is reached (RELIABILITY.md, S5 to S7): from where a browser asks
//! (`guard`), whose token came with the request (`auth`), browsers that signed in (`session`), links to one
//! file (`link`), how often (`rate`).

mod auth;
mod guard;
mod link;
mod rate;
pub(super) mod session;

pub(super) use auth::{Caller, Peer, authenticate};
pub(super) use guard::{Names, guard};
pub use link::signed;
pub(super) use rate::Rates;
