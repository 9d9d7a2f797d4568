//! Angles, pixel rectangles and the pinhole camera (conventions of DESIGN.md).

pub mod angle;
pub mod camera;
pub mod rect;

pub use angle::{Turns, wrap_rad};
pub use camera::Camera;
pub use rect::Rect;
