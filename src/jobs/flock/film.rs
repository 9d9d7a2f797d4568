//! A planned flock to files: its film in every format asked for, what its boids meant drawn over it, and
//! the ground truth from the same layers (ALGORITHMS.md 8). The command line and the service make them
//! here, in at most two passes: planes for encoders without transparency, RGBA for the rest.

use std::path::{Path, PathBuf};

use super::behind::Behind;
use super::sink::{self, Sink};
use super::truth::TruthFolder;
use crate::flock::composite::params::{Background, Format};
use crate::flock::{Compositor, Flock, Shot};
use crate::footage::FrameSource;
use crate::formats::ground_truth::FilmShape;
use crate::jobs::Error;
use crate::library::Library;
use crate::progress::Progress;
use crate::raster::RgbImage;

/// A flock that can be filmed.
#[derive(Clone, Copy)]
pub struct Film<'a> {
    /// Whose frames are shown.
    pub library: &'a Library,
    /// What they do.
    pub flock: &'a Flock,
    /// What lies behind, instead of what the flock's parameters say.
    pub backdrop: Backdrop<'a>,
    /// Told how far the film is; may cancel it.
    pub progress: &'a dyn Progress,
}

/// What lies behind a film.
#[derive(Clone, Copy)]
pub enum Backdrop<'a> {
    /// What the flock's parameters say.
    AsAsked,
    /// A picture.
    Picture(&'a RgbImage),
    /// Another film, over and over.
    Film(&'a dyn FrameSource),
}

/// A file to make.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Target {
    /// What it shows.
    pub output: Output,
    /// Where it goes. Pictures go to a folder, or to an archive where this ends in `.zip`; a poster is
    /// a JPEG where it ends in `.jpg`.
    pub path: PathBuf,
}

/// What a file shows.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Output {
    /// The flock.
    Film(Format),
    /// The flock, and where every boid is and heads, as MP4.
    Overlay,
}

impl Output {
    /// Whether it is encoded from planes, without transparency.
    fn is_planar(self) -> bool {
        match self {
            Output::Film(format) => !format.has_alpha(),
            Output::Overlay => true,
        }
    }
}

impl Film<'_> {
    /// Makes the files, and where a folder for it is given tells the ground truth.
    pub fn make(&self, targets: &[Target], truth: Option<&Path>) -> Result<(), Error> {
        let (posters, moving): (Vec<&Target>, Vec<&Target>) = targets
            .iter()
            .partition(|target| target.output == Output::Film(Format::Poster));
        let (planar, straight): (Vec<&Target>, Vec<&Target>) = moving
            .into_iter()
            .partition(|target| target.output.is_planar());
        // Truth is that of the film it lies beside: what stands before the animals is in an opaque one alone.
        let has_planar = !planar.is_empty() || (straight.is_empty() && truth.is_some());
        let of_straight = truth.filter(|_| !has_planar);
        let n_passes = usize::from(has_planar) + usize::from(!straight.is_empty());
        let compositor = Compositor::new(self.library, self.flock);
        if has_planar {
            self.pass(compositor, (&planar, truth), (0, n_passes))?;
        }
        if !straight.is_empty() {
            let compositor = Compositor::new(self.library, self.flock).straight();
            self.pass(
                compositor,
                (&straight, of_straight),
                (n_passes - 1, n_passes),
            )?;
        }
        posters
            .into_iter()
            .try_for_each(|target| self.poster(target))
    }

    fn pass(
        &self,
        compositor: Compositor,
        (targets, truth): (&[&Target], Option<&Path>),
        (pass, n_passes): (usize, usize),
    ) -> Result<(), Error> {
        let compositor = match truth {
            Some(_) => self.before(compositor).with_truth(),
            None => self.before(compositor),
        };
        let shape = FilmShape {
            size_px: compositor.size_px(),
            n_frames: compositor.n_frames(),
            fps: self.flock.fps,
        };
        // Begun with the first frame: by then some are drawn, if the encoder lets wait for it.
        let mut sinks = Vec::new();
        let begin = |target: &&Target| Sink::begin(target, shape, self.flock, self.is_clear());
        let mut truth = (truth.map(|folder| TruthFolder::create(folder, shape))).transpose()?;
        let mut behind = self.behind()?;
        let n_wanted = targets.iter().map(|target| sink::n_wanted(target, shape));
        let n_frames = match truth {
            Some(_) => shape.n_frames,
            None => n_wanted.max().unwrap_or(0),
        };
        compositor.first(n_frames).render_all(
            |frame_idx, shot| {
                let next = behind.as_mut().map(|behind| behind.at(frame_idx, shot));
                next.unwrap_or(Ok(()))
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
                let done = pass as f64 + (frame_idx + 1) as f64 / n_frames as f64;
                self.progress.report("rendering", done / n_passes as f64);
                Ok(())
            },
        )?;
        sinks.into_iter().try_for_each(Sink::finish)?;
        Ok(truth.map_or(Ok(()), TruthFolder::finish)?)
    }

    /// The frame in the middle.
    fn poster(&self, target: &Target) -> Result<(), Error> {
        let compositor = self.before(Compositor::new(self.library, self.flock).straight());
        let (mut shot, middle) = (Shot::default(), compositor.n_frames() / 2);
        if let Some(mut behind) = self.behind()? {
            behind.at(middle, &mut shot)?;
        }
        compositor.render(middle, &mut shot);
        Ok(sink::poster(
            &target.path,
            compositor.size_px(),
            self.is_clear(),
            &shot.rgba,
        )?)
    }

    fn before<'a>(&self, compositor: Compositor<'a>) -> Compositor<'a> {
        match self.backdrop {
            Backdrop::Picture(picture) => compositor.before(picture),
            Backdrop::AsAsked | Backdrop::Film(_) => compositor,
        }
    }

    fn behind(&self) -> Result<Option<Behind<'_>>, Error> {
        match self.backdrop {
            Backdrop::Film(source) => Ok(Some(Behind::of(source, self.flock.fps)?)),
            Backdrop::AsAsked | Backdrop::Picture(_) => Ok(None),
        }
    }

    /// Whether nothing lies behind, where a format can show that.
    fn is_clear(&self) -> bool {
        matches!(self.backdrop, Backdrop::AsAsked)
            && self.flock.params.render.background == Background::Transparent
    }
}
