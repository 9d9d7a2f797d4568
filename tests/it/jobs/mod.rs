//! The life of jobs: stepped by hand, run by a real pool, and under a killed server.

mod kills;
mod full_disk;
mod life_cycle;
mod poison;
mod steps;
