//! Monitoring: liveness and readiness (`health`), metrics for Prometheus (`metrics`), the space of an owner (`usage`),
//! and the id, log line and counters of every request (`observe`).

pub(super) mod health;
pub(super) mod metrics;
pub(super) mod observe;
pub(super) mod usage;
