//! What the algorithms ask of a video. Implemented by `media` (an ffmpeg child), by the virtual
//! camera of `fish`, and by small pictures in tests.

use crate::code::Code;
use crate::raster::{ColorSpec, Frame};

/// What is known of a footage before its frames are read.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FootageFormat {
    /// Columns, in square pixels.
    pub width: u32,
    /// Rows, in square pixels.
    pub height: u32,
    /// The constant rate at which frames are given, > 0.
    pub fps: f64,
    /// How many frames there seem to be; the stream itself decides.
    pub n_frames_hint: usize,
    /// How YUV values are to be read.
    pub color: ColorSpec,
}

/// A video that can be read from its start any number of times.
pub trait FrameSource: Send + Sync {
    /// Size, rate and colors: the same for every frame.
    fn format(&self) -> FootageFormat;

    /// Starts reading at the first frame.
    fn open(&self) -> Result<Box<dyn FrameStream + '_>, SourceError>;
}

/// The frames of a video, in order, at a constant rate.
pub trait FrameStream {
    /// Reads the next frame into `frame` (made the right size) and returns the true time, seconds
    /// from the first frame, of the picture taken; `None` after the last.
    fn next_frame(&mut self, frame: &mut Frame) -> Result<Option<f64>, SourceError>;
}

/// Reading a video failed: the code for people's programs, the cause for the log.
#[derive(Debug, thiserror::Error)]
#[error("{cause}")]
pub struct SourceError {
    /// The stable code.
    pub code: Code,
    /// What went wrong, with its own sources.
    #[source]
    pub cause: Box<dyn std::error::Error + Send + Sync>,
}
