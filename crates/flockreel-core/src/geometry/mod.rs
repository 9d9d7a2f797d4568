//! Angles, pixel rectangles, the pinhole camera and rounding (docs/reference/formats.md, "Conventions").

pub mod angle;
pub mod camera;
pub mod rect;
pub mod rounding;

pub use angle::{Turns, wrap_rad};
pub use camera::Camera;
pub use rect::Rect;
pub use rounding::rounded;
