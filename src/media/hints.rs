//! Metadata given by the user where that of the file is wrong or missing.

/// Each value overrides the metadata of the file.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Hints {
    /// Frame rate, frames per second. Each picture of the file is then shown once, at this rate.
    pub fps: Option<f64>,
    /// Pixel aspect ratio: width of a pixel divided by its height.
    pub pixel_aspect: Option<f64>,
    /// Whether to return the alpha channel, as gray, instead of the colors.
    pub of_alpha: bool,
}
