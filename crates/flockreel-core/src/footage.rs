//! The interface through which algorithms read a video. `media` implements it with ffmpeg, `fish` with its
//! virtual camera, and tests with small generated pictures.

use std::ops::{ControlFlow, Range};

use crate::code::Code;
use crate::raster::{ColorSpec, Frame, GivenMask};

/// Properties of a video that are known before its frames are read.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FootageFormat {
    /// Number of columns, in square pixels.
    pub width: u32,
    /// Number of rows, in square pixels.
    pub height: u32,
    /// Constant frame rate of the stream, frames per second, > 0.
    pub fps: f64,
    /// Estimated number of frames. The stream may hold more or fewer.
    pub n_frames_hint: usize,
    /// Conversion of YUV values to RGB.
    pub color: ColorSpec,
}

/// A video that can be read from its start any number of times.
pub trait FrameSource: Send + Sync {
    /// Returns size, rate and colors, which hold for every frame.
    fn format(&self) -> FootageFormat;

    /// Starts reading at the first frame.
    fn open(&self) -> Result<Box<dyn FrameStream + '_>, SourceError>;

    /// Returns the number of the first frame in the footage: not 0 for a part of it.
    fn first_frame(&self) -> usize {
        0
    }

    /// Calls `visit` with `n` frames spread evenly over the video, in order. The k-th is the middle frame of
    /// the k-th of `n` equal parts (see [`spread_idx`]).
    ///
    /// Yields fewer frames if the video is shorter than estimated, and stops early when `visit` breaks.
    /// Sources that can skip frames faster than they read them override this method.
    fn spread(&self, n: usize, visit: &mut Visit<'_>) -> Result<(), SourceError> {
        spread_by_reading(self, n, visit)
    }
}

/// Receives a frame and returns whether to continue.
pub type Visit<'a> = dyn FnMut(&Frame) -> ControlFlow<()> + 'a;

/// Implements [`FrameSource::spread`] by reading every frame up to the last one needed.
pub fn spread_by_reading<S: FrameSource + ?Sized>(
    source: &S,
    n: usize,
    visit: &mut Visit<'_>,
) -> Result<(), SourceError> {
    let mut wanted = spread_idx(source.format().n_frames_hint, n)
        .into_iter()
        .peekable();
    let mut stream = source.open()?;
    let mut frame = Frame::default();
    let mut frame_idx = 0;
    while wanted.peek().is_some() && stream.next_frame(&mut frame)?.is_some() {
        if wanted.next_if_eq(&frame_idx).is_some() && visit(&frame).is_break() {
            break;
        }
        frame_idx += 1;
    }
    Ok(())
}

/// Returns the middle indices of `n` equal parts of `n_frames` frames, strictly increasing. Returns all
/// indices if there are fewer than `n` frames.
///
/// ```
/// assert_eq!(flockreel_core::footage::spread_idx(10, 2), [2, 7]);
/// assert_eq!(flockreel_core::footage::spread_idx(2, 5), [0, 1]);
/// ```
pub fn spread_idx(n_frames: usize, n: usize) -> Vec<usize> {
    let n = n.min(n_frames);
    (0..n).map(|k| (2 * k + 1) * n_frames / (2 * n)).collect()
}

/// A part of a video, as a video of its own: its frames count from the start of the part, its times from the
/// start of the video.
pub struct Part<'a> {
    source: &'a dyn FrameSource,
    /// Frame indices in the source.
    frames: Range<usize>,
}

impl<'a> Part<'a> {
    /// Selects the frames from `from_s` up to `to_s`, seconds from the first frame of `source`. `None` leaves
    /// that end open.
    pub fn new(source: &'a dyn FrameSource, from_s: Option<f64>, to_s: Option<f64>) -> Part<'a> {
        let format = source.format();
        // The cast saturates: a time beyond the end of the video selects its end.
        let idx = |time_s: f64| (time_s * format.fps).round() as usize;
        let first = from_s.map_or(0, idx);
        // Without `to_s` the stream decides: it may be longer than estimated.
        let end = to_s.map_or(usize::MAX, idx);
        Part {
            source,
            frames: first..end.max(first),
        }
    }
}

impl FrameSource for Part<'_> {
    fn format(&self) -> FootageFormat {
        let format = self.source.format();
        let end = self.frames.end.min(format.n_frames_hint);
        FootageFormat {
            n_frames_hint: end.saturating_sub(self.frames.start),
            ..format
        }
    }

    fn open(&self) -> Result<Box<dyn FrameStream + '_>, SourceError> {
        Ok(Box::new(PartStream {
            stream: self.source.open()?,
            frames: self.frames.clone(),
            n_read: 0,
        }))
    }

    fn first_frame(&self) -> usize {
        self.frames.start
    }

    fn spread(&self, n: usize, visit: &mut Visit<'_>) -> Result<(), SourceError> {
        if self.frames == (0..usize::MAX) {
            self.source.spread(n, visit)
        } else {
            spread_by_reading(self, n, visit)
        }
    }
}

/// A reader of one part.
struct PartStream<'a> {
    stream: Box<dyn FrameStream + 'a>,
    frames: Range<usize>,
    n_read: usize,
}

impl FrameStream for PartStream<'_> {
    fn next_frame(&mut self, frame: &mut Frame) -> Result<Option<f64>, SourceError> {
        while self.n_read < self.frames.end {
            let Some(time_s) = self.stream.next_frame(frame)? else {
                return Ok(None);
            };
            self.n_read += 1;
            if self.n_read > self.frames.start {
                return Ok(Some(time_s));
            }
        }
        Ok(None)
    }
}

/// A video combined with a second video of masks, one for each frame. The luma of the mask is the alpha of
/// the animal in each pixel.
pub struct Masked<'a> {
    video: &'a dyn FrameSource,
    masks: &'a dyn FrameSource,
    is_mixed: bool,
}

/// A video and its masks differ in picture size or number of frames.
#[derive(Debug, thiserror::Error)]
pub enum MasksDiffer {
    /// The picture sizes differ.
    #[error("the masks have {masks:?} pixels, but the footage has {footage:?}")]
    Size {
        /// Width and height of the masks.
        masks: [u32; 2],
        /// Width and height of the footage.
        footage: [u32; 2],
    },
    /// There are fewer masks than frames.
    #[error("the footage has more frames than masks: send one mask per frame (masks: {n_masks})")]
    TooFew {
        /// Number of masks.
        n_masks: usize,
    },
    /// There are more masks than frames.
    #[error("the masks outnumber the frames: send one mask per frame (frames: {n_frames})")]
    TooMany {
        /// Number of frames.
        n_frames: usize,
    },
}

impl From<MasksDiffer> for SourceError {
    fn from(cause: MasksDiffer) -> SourceError {
        SourceError {
            code: Code::MasksDiffer,
            cause: Box::new(cause),
        }
    }
}

impl<'a> Masked<'a> {
    /// Combines a video with its masks; [`GivenMask`] explains `is_mixed`. Fails if the picture sizes differ.
    pub fn new(
        video: &'a dyn FrameSource,
        masks: &'a dyn FrameSource,
        is_mixed: bool,
    ) -> Result<Masked<'a>, SourceError> {
        let size = |source: &dyn FrameSource| {
            let format = source.format();
            [format.width, format.height]
        };
        let sizes = (size(masks), size(video));
        if sizes.0 != sizes.1 {
            let (masks, footage) = sizes;
            return Err(MasksDiffer::Size { masks, footage }.into());
        }
        Ok(Masked {
            video,
            masks,
            is_mixed,
        })
    }
}

impl FrameSource for Masked<'_> {
    fn format(&self) -> FootageFormat {
        self.video.format()
    }

    fn open(&self) -> Result<Box<dyn FrameStream + '_>, SourceError> {
        Ok(Box::new(MaskedStream {
            video: self.video.open()?,
            masks: self.masks.open()?,
            is_mixed: self.is_mixed,
            mask: Frame::default(),
            n_read: 0,
        }))
    }

    // A decoder that skips frames may choose different frames of the masks than of the video.
    fn spread(&self, n: usize, visit: &mut Visit<'_>) -> Result<(), SourceError> {
        spread_by_reading(self, n, visit)
    }
}

/// A reader of a video with its masks.
struct MaskedStream<'a> {
    video: Box<dyn FrameStream + 'a>,
    masks: Box<dyn FrameStream + 'a>,
    is_mixed: bool,
    /// The mask read last.
    mask: Frame,
    n_read: usize,
}

impl FrameStream for MaskedStream<'_> {
    fn next_frame(&mut self, frame: &mut Frame) -> Result<Option<f64>, SourceError> {
        let alpha = frame.mask.take().map(|mask| mask.alpha);
        let time_s = self.video.next_frame(frame)?;
        let masked_s = self.masks.next_frame(&mut self.mask)?;
        let n_read = self.n_read;
        match (time_s, masked_s) {
            (Some(_), None) => Err(MasksDiffer::TooFew { n_masks: n_read }.into()),
            (None, Some(_)) => Err(MasksDiffer::TooMany { n_frames: n_read }.into()),
            (None, None) => Ok(None),
            (Some(time_s), Some(_)) => {
                self.n_read += 1;
                let levels = self.mask.gray_levels();
                let masked = self.mask.luma().iter();
                let mut alpha = alpha.unwrap_or_default();
                alpha.clear();
                alpha.extend(masked.map(|&luma| levels[usize::from(luma)]));
                frame.mask = Some(GivenMask {
                    alpha,
                    is_mixed: self.is_mixed,
                });
                Ok(Some(time_s))
            }
        }
    }
}

/// A reader of the frames of a video, in order, at a constant rate.
pub trait FrameStream {
    /// Reads the next frame into `frame`, which is resized as needed. Returns the true time of that frame in
    /// the file, seconds from the first frame; `None` after the last.
    fn next_frame(&mut self, frame: &mut Frame) -> Result<Option<f64>, SourceError>;
}

/// A failure to read a video: a stable code for the client, a cause for the log.
#[derive(Debug, thiserror::Error)]
#[error("{cause}")]
pub struct SourceError {
    /// The stable code.
    pub code: Code,
    /// The underlying error.
    #[source]
    pub cause: Box<dyn std::error::Error + Send + Sync>,
}
