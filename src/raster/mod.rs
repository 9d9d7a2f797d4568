//! Pictures as values: frames as they are decoded, RGB and RGBA images, masks.

pub mod color;
pub mod frame;
pub mod image;

pub use color::{ColorSpec, Matrix, Range};
pub use frame::Frame;
pub use image::{RgbImage, RgbaImage};
