//! The life cycle of jobs: stepped by hand, run by worker pools, interrupted by kills, claimed concurrently.

mod attempts;
mod datasets;
mod durable;
mod full_disk;
mod kills;
mod life_cycle;
mod poison;
mod races;
mod sample;
mod steps;
mod sweeps;
mod upgrades;
mod uploads;
mod views;
