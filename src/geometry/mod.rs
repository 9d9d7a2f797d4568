//! Angles, pixel rectangles and the pinhole camera (docs/reference/formats.md, "Conventions").

pub mod angle;
pub mod camera;
pub mod rect;

pub use angle::{Turns, wrap_rad};
pub use camera::Camera;
pub use rect::Rect;
