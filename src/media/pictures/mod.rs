//! Pictures as footage: a folder, a zip, or the pages of one TIFF, as microscopes and lab cameras write them, or an
//! animated WebP. Libraries without unsafe C code decode each picture on request, under the same limits as films.
//! Still pictures have no frame rate: the user gives one, or it is assumed.

mod animation; // animated WebP
mod natural_order; // order of numbered names
mod picture; // decoding of one picture
mod source; // pictures of a folder, zip, TIFF or animation
mod tiff_stack; // pages of a TIFF

use std::path::{Path, PathBuf};

use super::error::Error;
use super::gray_range::{GrayRange, MIN_SAMPLED_FRAMES};
use super::limits::Limits;
use super::notice::Notice;
use super::probe::FULL_RANGE;
use super::probe::header::square_pixels;
use super::probe::timeline::{Claims, Timeline};
use super::read_options::ReadOptions;
use flockreel_core::footage::{
    FootageFormat, FrameSource, FrameStream, SourceError, Visit, spread_idx,
};
use flockreel_core::raster::{Frame, RgbImage};
use picture::Picture;
use source::{Reader, Source};

/// Resolution of the times of animated pictures, seconds.
const TICK_S: f64 = 0.001;

/// Pictures of one size, within the limits.
#[derive(Clone, Debug)]
pub(super) struct Pictures {
    source: Source,
    limits: Limits,
    /// Stored width and height, pixels.
    stored: [u32; 2],
    /// Width and height in square pixels.
    shown: [u32; 2],
    timeline: Timeline,
    /// Range of gray levels, if the first picture is gray of more than 8 bits.
    gray_range: Option<GrayRange>,
    /// Whether the first picture has an alpha channel.
    has_alpha: bool,
    /// Whether the alpha channel is returned, as gray.
    alpha_as_gray: bool,
    notices: Vec<Notice>,
}

impl Pictures {
    /// Opens the pictures at `path`: those of a folder, a zip, a TIFF or an animated WebP; `None` for
    /// anything else. Decodes the first one, and 16 if it is gray of 16 bits.
    pub(super) fn open(
        path: &Path,
        limits: &Limits,
        options: &ReadOptions,
    ) -> Result<Option<Pictures>, Error> {
        let Some(source) = Source::find(path, limits)? else {
            return Ok(None);
        };
        let claims = Claims {
            fps: Vec::new(),
            tick_s: TICK_S,
            given_fps: options.fps,
        };
        let (timeline, mut notices) = Timeline::new(&source.times_s(), &claims, limits)?;
        let (first, has_alpha) = source.read(limits, false)?.picture(0)?;
        let stored = first.size();
        let shown = square_pixels(stored.map(f64::from), options.pixel_aspect);
        let shown = shown.map(|side| side as u32);
        limits.check_size(shown[0].into(), shown[1].into())?;
        let mut pictures = Pictures {
            source,
            limits: limits.clone(),
            stored,
            shown,
            timeline,
            gray_range: None,
            has_alpha,
            alpha_as_gray: options.alpha_as_gray,
            notices: Vec::new(),
        };
        if let Picture::Gray16(_) = first
            && !options.alpha_as_gray
        {
            let gray_range = pictures.measure_gray()?;
            notices.push(gray_range.notice(16));
            pictures.gray_range = Some(gray_range);
        }
        pictures.notices = notices;
        Ok(Some(pictures))
    }

    /// Returns the assumptions made.
    pub(super) fn notices(&self) -> &[Notice] {
        &self.notices
    }

    /// Returns whether the pictures have an alpha channel.
    pub(super) fn has_alpha(&self) -> bool {
        self.has_alpha
    }

    /// Returns the files that hold them.
    pub(super) fn files(&self) -> &[PathBuf] {
        self.source.files()
    }

    /// Returns the range of gray levels in pictures spread over the footage.
    fn measure_gray(&self) -> Result<GrayRange, Error> {
        let mut reader = self.source.read(&self.limits, false)?;
        let mut counts = vec![0_u64; 1 << 16];
        for idx in spread_idx(self.source.n_pictures(), MIN_SAMPLED_FRAMES) {
            if let (Picture::Gray16(picture), _) = reader.picture(idx)? {
                picture
                    .iter()
                    .for_each(|&level| counts[usize::from(level)] += 1);
            }
        }
        Ok(GrayRange::from_histogram(&counts))
    }

    /// Returns the picture that a frame shows, and its time in seconds; `None` after the last frame.
    fn picture_at(&self, frame_idx: usize) -> Option<(usize, f64)> {
        let n_pictures = self.source.n_pictures();
        let at = self.timeline.picture_at(frame_idx, n_pictures);
        at.filter(|&(idx, _)| idx < n_pictures)
    }

    /// Decodes a picture into a frame. Fails if its size differs from the first picture's.
    fn show(&self, reader: &mut Reader<'_>, idx: usize, frame: &mut Frame) -> Result<(), Error> {
        let (picture, _) = reader.picture(idx)?;
        if picture.size() != self.stored {
            return Err(Error::PicturesDiffer {
                number: idx + 1,
                found: picture.size(),
                first: self.stored,
            });
        }
        let pixels = picture.into_rgb(self.gray_range.as_ref(), self.shown);
        let [width, height] = self.shown;
        let canvas = RgbImage {
            width,
            height,
            pixels,
        };
        if (frame.width, frame.height, frame.color) != (width, height, FULL_RANGE) {
            *frame = Frame::new(width, height, FULL_RANGE);
        }
        frame.draw_all_rgb(&canvas);
        Ok(())
    }
}

impl FrameSource for Pictures {
    fn format(&self) -> FootageFormat {
        let [width, height] = self.shown;
        FootageFormat {
            width,
            height,
            fps: self.timeline.fps(),
            n_frames_hint: self.timeline.n_frames(self.source.n_pictures()),
            color: FULL_RANGE,
        }
    }

    fn open(&self) -> Result<Box<dyn FrameStream + '_>, SourceError> {
        Ok(Box::new(PictureStream {
            pictures: self,
            reader: self.source.read(&self.limits, self.alpha_as_gray)?,
            n_returned: 0,
        }))
    }

    /// Decodes only the selected pictures.
    fn spread(&self, n: usize, visit: &mut Visit<'_>) -> Result<(), SourceError> {
        let mut reader = self.source.read(&self.limits, self.alpha_as_gray)?;
        let mut frame = Frame::default();
        for frame_idx in spread_idx(self.format().n_frames_hint, n) {
            let Some((idx, _)) = self.picture_at(frame_idx) else {
                break;
            };
            self.show(&mut reader, idx, &mut frame)?;
            if visit(&frame).is_break() {
                break;
            }
        }
        Ok(())
    }
}

/// A reader of the pictures.
struct PictureStream<'a> {
    pictures: &'a Pictures,
    reader: Reader<'a>,
    n_returned: usize,
}

impl FrameStream for PictureStream<'_> {
    fn next_frame(&mut self, frame: &mut Frame) -> Result<Option<f64>, SourceError> {
        let Some((idx, time_s)) = self.pictures.picture_at(self.n_returned) else {
            return Ok(None);
        };
        self.pictures.show(&mut self.reader, idx, frame)?;
        self.n_returned += 1;
        Ok(Some(time_s))
    }
}
