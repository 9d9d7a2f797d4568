//! The service seen from outside (ECOSYSTEM.md, seen from outside): whether it lives and can work (`health`),
//! what it does and holds (`metrics`), and every request's id, log line and count (`observe`).

pub(super) mod health;
pub(super) mod metrics;
pub(super) mod observe;
