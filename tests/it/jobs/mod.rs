//! The life of jobs: stepped by hand, run by a real pool, under a killed server, and raced for.

mod durable;
mod full_disk;
mod kills;
mod life_cycle;
mod poison;
mod races;
mod sample;
mod steps;
mod sweeps;
mod uploads;
