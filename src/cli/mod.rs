//! The command line: one file a command.

pub mod analyze;
pub mod fish;
pub mod flock;
pub mod matrix;
pub mod sample;
pub mod serve;
pub mod sprites;
