//! Still pictures as footage: a folder, a zip, or the pages of one TIFF, as microscopes and lab cameras write
//! them. Libraries without unsafe C code decode each picture on request, under the same limits as films.
//! Pictures have no frame rate: it comes from a hint or is assumed.

mod order; // order of numbered names
mod picture; // decoding of one picture
mod source; // pictures of a folder, zip or TIFF
mod stack; // pages of a TIFF

use std::path::{Path, PathBuf};

use super::error::Error;
use super::hints::Hints;
use super::limits::Limits;
use super::note::Note;
use super::probe::check_size;
use super::probe::timeline::{Claims, Timeline};
use super::stretch::{LEAST_FRAMES, Stretch};
use crate::footage::{FootageFormat, FrameSource, FrameStream, SourceError, Visit, spread_idx};
use crate::raster::{ColorSpec, Frame, Matrix, Range, RgbImage};
use picture::Picture;
use source::{Reader, Source};

/// Full range, so gray keeps its levels.
const COLOR: ColorSpec = ColorSpec {
    matrix: Matrix::Bt601,
    range: Range::Full,
};

/// Pictures of one size, within the limits.
#[derive(Clone, Debug)]
pub(super) struct Pictures {
    source: Source,
    limits: Limits,
    /// Stored width and height, pixels.
    stored: [u32; 2],
    /// Width and height in square pixels.
    shown: [u32; 2],
    fps: f64,
    /// Range of gray levels, if the first picture is gray of more than 8 bits.
    stretch: Option<Stretch>,
    /// Whether the first picture has an alpha channel.
    has_alpha: bool,
    /// Whether the alpha channel is returned, as gray.
    of_alpha: bool,
    notes: Vec<Note>,
}

impl Pictures {
    /// Opens the pictures at `path`: those of a folder, a zip or a TIFF; `None` for anything else. Decodes
    /// the first one, and 16 if it is gray of 16 bits.
    pub(super) fn open(
        path: &Path,
        limits: &Limits,
        hints: &Hints,
    ) -> Result<Option<Pictures>, Error> {
        let Some(source) = Source::find(path, limits)? else {
            return Ok(None);
        };
        let n_pictures = source.n_pictures();
        let claims = Claims {
            fps: Vec::new(),
            tick_s: 0.0,
            wanted_fps: hints.fps,
        };
        let (timeline, mut notes) = Timeline::found(&vec![None; n_pictures], &claims, limits)?;
        let (first, has_alpha) = source.read(limits, false)?.picture(0)?;
        let stored = first.size();
        let shown = shown_size(stored, hints);
        check_size(u64::from(shown[0]), u64::from(shown[1]), limits)?;
        let mut pictures = Pictures {
            source,
            limits: limits.clone(),
            stored,
            shown,
            fps: timeline.fps(),
            stretch: None,
            has_alpha,
            of_alpha: hints.of_alpha,
            notes: Vec::new(),
        };
        if let Picture::Gray16(_) = first
            && !hints.of_alpha
        {
            let stretch = pictures.measure_gray()?;
            notes.push(stretch.note(16));
            pictures.stretch = Some(stretch);
        }
        pictures.notes = notes;
        Ok(Some(pictures))
    }

    /// Returns the assumptions made.
    pub(super) fn notes(&self) -> &[Note] {
        &self.notes
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
    fn measure_gray(&self) -> Result<Stretch, Error> {
        let mut reader = self.source.read(&self.limits, false)?;
        let mut counts = vec![0_u64; 1 << 16];
        for idx in spread_idx(self.source.n_pictures(), LEAST_FRAMES) {
            if let (Picture::Gray16(picture), _) = reader.picture(idx)? {
                picture
                    .iter()
                    .for_each(|&level| counts[usize::from(level)] += 1);
            }
        }
        Ok(Stretch::of(&counts))
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
        let pixels = picture.into_rgb(self.stretch.as_ref(), self.shown);
        let [width, height] = self.shown;
        let canvas = RgbImage {
            width,
            height,
            pixels,
        };
        if (frame.width, frame.height, frame.color) != (width, height, COLOR) {
            *frame = Frame::new(width, height, COLOR);
        }
        frame.draw_all_rgb(&canvas);
        Ok(())
    }
}

/// Returns the size in square pixels. The smaller dimension is stretched, so that no measured detail is lost.
fn shown_size([width, height]: [u32; 2], hints: &Hints) -> [u32; 2] {
    match hints.pixel_aspect {
        Some(aspect) if aspect > 1.0 => [(f64::from(width) * aspect).round() as u32, height],
        Some(aspect) if aspect > 0.0 => [width, (f64::from(height) / aspect).round() as u32],
        _ => [width, height],
    }
}

impl FrameSource for Pictures {
    fn format(&self) -> FootageFormat {
        let [width, height] = self.shown;
        FootageFormat {
            width,
            height,
            fps: self.fps,
            n_frames_hint: self.source.n_pictures(),
            color: COLOR,
        }
    }

    fn open(&self) -> Result<Box<dyn FrameStream + '_>, SourceError> {
        Ok(Box::new(PictureStream {
            pictures: self,
            reader: self.source.read(&self.limits, self.of_alpha)?,
            n_given: 0,
        }))
    }

    /// Decodes only the wanted pictures.
    fn spread(&self, n: usize, visit: &mut Visit<'_>) -> Result<(), SourceError> {
        let mut reader = self.source.read(&self.limits, self.of_alpha)?;
        let mut frame = Frame::default();
        for idx in spread_idx(self.source.n_pictures(), n) {
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
    n_given: usize,
}

impl FrameStream for PictureStream<'_> {
    fn next_frame(&mut self, frame: &mut Frame) -> Result<Option<f64>, SourceError> {
        let idx = self.n_given;
        if idx == self.pictures.source.n_pictures() {
            return Ok(None);
        }
        self.pictures.show(&mut self.reader, idx, frame)?;
        self.n_given += 1;
        Ok(Some(idx as f64 / self.pictures.fps))
    }
}
