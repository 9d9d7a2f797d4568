//! How to read footage: metadata that replaces that of the file, and the choice between colors and alpha.

/// Options of reading. The default reads the colors with the metadata of the file.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ReadOptions {
    /// Frame rate, frames per second. Each picture of the file is then shown once, at this rate.
    pub fps: Option<f64>,
    /// Pixel aspect ratio: width of a pixel divided by its height.
    pub pixel_aspect: Option<f64>,
    /// Whether to return the alpha channel, as gray, instead of the colors.
    pub alpha_as_gray: bool,
}
