//! Raster types: decoded frames, RGB and RGBA images, masks, and the operations on them.

pub mod blend;
pub mod canvas;
pub mod color;
pub mod fill;
pub mod frame;
pub mod image;
pub mod mask;
pub mod outline;
pub mod pen;
pub mod resample;
pub mod resize;
pub mod runs;

pub use canvas::Canvas;
pub use color::{ColorSpec, Matrix, Range};
pub use frame::{Frame, GivenMask};
pub use image::{RgbImage, RgbaImage};
pub use mask::Mask;
pub use pen::Pen;
