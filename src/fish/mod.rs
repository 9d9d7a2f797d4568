//! Poses to virtual fish: a goldfish of our own geometry, moved as the measured animal moved, and
//! the film of it whose truth is known (ALGORITHMS.md 4, virtual fish; N 7).

pub mod drive;
pub mod error;
pub mod film;
pub mod mesh;
pub mod motion;
pub mod params;
pub mod render;
pub mod sample;
pub mod side_by_side;
pub mod spine;
pub mod swimmer;

mod body;
mod fins;
mod light;
mod paint;
mod scenery;

pub use drive::drive;
pub use error::Error;
pub use film::Film;
pub use motion::{Motion, Posture};
pub use params::{Palette, Params};
pub use render::Renderer;
