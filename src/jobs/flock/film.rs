//! Writes a planned flock to files: its video in all requested formats, an overlay with the simulated boids,
//! and the ground truth from the same layers (docs/explanation/algorithms.md, "Compositing"). Both the
//! commands and the service use it.
//!
//! The frames are drawn in at most two passes: as planes for encoders without transparency, and as RGBA for
//! the others.

use std::path::Path;

use super::background_video::BackgroundVideo;
use super::sink::{self, Sink};
use super::target::{Output, Target};
use super::truth::TruthFolder;
use crate::jobs::Error;
use crate::media::{Encoding, write_picture};
use flockreel_core::flock::composite::params::{Background, Format};
use flockreel_core::flock::{Compositor, Flock, Shot};
use flockreel_core::footage::FrameSource;
use flockreel_core::formats::ground_truth::FilmShape;
use flockreel_core::library::Library;
use flockreel_core::progress::Progress;
use flockreel_core::raster::RgbImage;

/// Largest small picture, bytes. A list shows many of them.
const MAX_THUMB_BYTES: u64 = 30_000;

/// Qualities of the small picture, tried in this order. The last is used whatever its size: at 320 pixels it is
/// below the limit even for noise.
const THUMB_QUALITIES: [u8; 4] = [80, 60, 30, 5];

/// A flock with everything needed to draw it.
#[derive(Clone, Copy)]
pub struct Film<'a> {
    /// The library that provides the sprites.
    pub library: &'a Library,
    /// The planned flock.
    pub flock: &'a Flock,
    /// The background, which may replace that of the flock's parameters.
    pub backdrop: Backdrop<'a>,
    /// Receives progress, and may cancel the work.
    pub progress: &'a dyn Progress,
}

/// Background of a video of a flock.
#[derive(Clone, Copy)]
pub enum Backdrop<'a> {
    /// The background selected by the flock's parameters.
    FromParams,
    /// A picture.
    Picture(&'a RgbImage),
    /// A video, repeated as needed.
    Film(&'a dyn FrameSource),
}

/// One pass over the frames.
struct Pass<'a> {
    /// Files to write.
    targets: &'a [&'a Target],
    /// Folder of the ground truth, if this pass writes it.
    truth: Option<&'a Path>,
    /// Number of passes before this one.
    n_before: usize,
    /// Number of all passes.
    n_passes: usize,
}

impl Film<'_> {
    /// Writes the files, and the ground truth if its folder is given.
    pub fn make(&self, targets: &[Target], truth: Option<&Path>) -> Result<(), Error> {
        let (posters, moving): (Vec<&Target>, Vec<&Target>) = targets
            .iter()
            .partition(|target| target.output == Output::Film(Format::Poster));
        let (planar, straight): (Vec<&Target>, Vec<&Target>) = moving
            .into_iter()
            .partition(|target| target.output.is_planar());
        let has_planar = !planar.is_empty() || (straight.is_empty() && truth.is_some());
        let n_passes = usize::from(has_planar) + usize::from(!straight.is_empty());
        let compositor = Compositor::new(self.library, self.flock);
        if has_planar {
            let pass = Pass {
                targets: &planar,
                truth,
                n_before: 0,
                n_passes,
            };
            self.run_pass(compositor, &pass)?;
        }
        if !straight.is_empty() {
            let compositor = Compositor::new(self.library, self.flock).straight();
            let pass = Pass {
                targets: &straight,
                // Foreground objects are drawn only in opaque videos, so the ground truth of the two passes
                // differs. It is computed with the opaque pass, if there is one.
                truth: truth.filter(|_| !has_planar),
                n_before: n_passes - 1,
                n_passes,
            };
            self.run_pass(compositor, &pass)?;
        }
        posters
            .into_iter()
            .try_for_each(|target| self.poster(target))
    }

    fn run_pass(&self, compositor: Compositor, pass: &Pass) -> Result<(), Error> {
        let targets = pass.targets;
        let compositor = match pass.truth {
            Some(_) => self.with_backdrop(compositor).with_truth(),
            None => self.with_backdrop(compositor),
        };
        let shape = FilmShape {
            size_px: compositor.size_px(),
            n_frames: compositor.n_frames(),
            fps: self.flock.fps,
        };
        // Encoders start with the first frame. More frames are drawn while they start.
        let mut sinks = Vec::new();
        let begin = |target: &&Target| Sink::begin(target, shape, self.flock, self.is_clear());
        let count = self.flock.individuals.len();
        let length_px = self.flock.length_px * compositor.scale();
        let truth = (pass.truth).map(|folder| TruthFolder::create(folder, shape, count));
        let mut truth = truth.transpose()?;
        let mut background = self.background_video()?;
        let n_wanted = targets.iter().map(|target| sink::n_wanted(target, shape));
        let n_frames = match truth {
            Some(_) => shape.n_frames,
            None => n_wanted.max().unwrap_or(0),
        };
        compositor.first(n_frames).render_all(
            |frame_idx, shot| {
                let drawn = background.as_mut().map(|video| video.draw(frame_idx, shot));
                drawn.unwrap_or(Ok(()))
            },
            |frame_idx, shot: &Shot| {
                if self.progress.cancelled() {
                    return Err(Error::Cancelled);
                }
                if frame_idx == 0 {
                    sinks = targets
                        .iter()
                        .map(begin)
                        .collect::<Result<Vec<Sink>, Error>>()?;
                }
                for sink in &mut sinks {
                    sink.take(self.flock, frame_idx, shot)?;
                }
                if let Some(truth) = &mut truth {
                    truth.add(self.flock, frame_idx, &shot.truth)?;
                }
                let done = pass.n_before as f64 + (frame_idx + 1) as f64 / n_frames as f64;
                self.progress
                    .report("rendering", done / pass.n_passes as f64);
                Ok(())
            },
        )?;
        sinks.into_iter().try_for_each(Sink::finish)?;
        Ok(truth.map_or(Ok(()), |truth| truth.finish(length_px))?)
    }

    /// Writes the middle frame as a picture.
    fn poster(&self, target: &Target) -> Result<(), Error> {
        let (size_px, rgba) = self.middle_frame()?;
        Ok(sink::poster(&target.path, size_px, self.is_clear(), &rgba)?)
    }

    /// Writes the middle frame as a small WebP for lists, at most `MAX_THUMB_BYTES` long.
    pub fn thumb(&self, path: &Path) -> Result<(), Error> {
        let (size_px, rgba) = self.middle_frame()?;
        for quality in THUMB_QUALITIES {
            write_picture(path, size_px, Encoding::Thumb(quality), &rgba)?;
            if std::fs::metadata(path)?.len() <= MAX_THUMB_BYTES {
                break;
            }
        }
        Ok(())
    }

    /// Returns width and height, pixels, and the middle frame as RGBA with straight alpha.
    fn middle_frame(&self) -> Result<([u32; 2], Vec<u8>), Error> {
        let compositor = self.with_backdrop(Compositor::new(self.library, self.flock).straight());
        let (mut shot, middle) = (Shot::default(), compositor.n_frames() / 2);
        if let Some(mut video) = self.background_video()? {
            video.draw(middle, &mut shot)?;
        }
        compositor.render(middle, &mut shot);
        Ok((compositor.size_px(), shot.rgba))
    }

    fn with_backdrop<'a>(&self, compositor: Compositor<'a>) -> Compositor<'a> {
        match self.backdrop {
            Backdrop::Picture(picture) => compositor.before(picture),
            Backdrop::FromParams | Backdrop::Film(_) => compositor,
        }
    }

    fn background_video(&self) -> Result<Option<BackgroundVideo<'_>>, Error> {
        match self.backdrop {
            Backdrop::Film(source) => Ok(Some(BackgroundVideo::open(source, self.flock.fps)?)),
            Backdrop::FromParams | Backdrop::Picture(_) => Ok(None),
        }
    }

    /// Returns whether the background is transparent, in formats that support it.
    fn is_clear(&self) -> bool {
        matches!(self.backdrop, Backdrop::FromParams)
            && self.flock.params.render.background == Background::Transparent
    }
}
