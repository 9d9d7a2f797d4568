//! The life of jobs: stepped by hand, run by a real pool, under a killed server, and raced for.

mod kills;
mod life_cycle;
mod races;
mod steps;
mod uploads;
