//! Monitoring: liveness and readiness (`health`), metrics for Prometheus (`metrics`), and the id, log line
//! and counters of every request (`observe`).

pub(super) mod health;
pub(super) mod metrics;
pub(super) mod observe;
