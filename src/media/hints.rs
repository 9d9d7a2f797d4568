//! What a person says of a film where its file is wrong or silent.

/// Each overrides what the file says.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Hints {
    /// Frames a second: every picture of the file is then shown once, at this rate.
    pub fps: Option<f64>,
    /// Width of a pixel over its height.
    pub pixel_aspect: Option<f64>,
    /// Gives the alpha channel instead of the colors, as gray.
    pub of_alpha: bool,
}
