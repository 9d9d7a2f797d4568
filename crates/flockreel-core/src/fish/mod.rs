//! The virtual fish: a goldfish mesh of our own geometry that moves as the measured animal moved.
//!
//! `drive` turns poses into motion, and `render` draws the motion. `sample` makes the sample film, in which
//! every pose is known exactly (Nakajima et al., section 7;
//! docs/explanation/algorithms.md, "Virtual fish").

pub mod drive;
pub mod error;
pub mod figure;
pub mod film;
pub mod likeness;
pub mod mesh;
pub mod motion;
pub mod params;
pub mod render;
pub mod sample;
pub mod side_by_side;
pub mod spine;
pub mod swimmer;

mod body;
mod colors;
mod fins;
mod goldfish;
mod light;
mod scenery;

pub use drive::drive;
pub use error::Error;
pub use figure::Figure;
pub use film::Film;
pub use likeness::{Likeness, likeness};
pub use motion::{Beat, Motion, Posture};
pub use params::{Body, Palette, Params};
pub use render::Renderer;
