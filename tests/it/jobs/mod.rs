//! The life of jobs: stepped by hand, run by a real pool, and under a killed server.

mod kills;
mod life_cycle;
mod steps;
mod uploads;
