//! Footage to library: what the animal did in every frame, and which moments look alike
//! (ALGORITHMS.md 2 to 5).

pub mod distance;
pub mod error;
mod gate;
pub mod params;
pub mod playback;
pub mod transition;

pub use error::Error;
pub use params::Params;
