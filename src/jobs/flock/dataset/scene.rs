//! A flock of a data set: planned and drawn as every flock is, with the background that the data set chose, and the
//! paths of its files.

use super::Dataset;
use crate::jobs::Error;
use crate::media::{Limits, read_image};
use flockreel_core::dataset::{Ground, Look, Params, Sequence};
use flockreel_core::flock::{Compositor, Flock, plan_flock};
use flockreel_core::formats::ground_truth::FilmShape;
use flockreel_core::library::Library;
use flockreel_core::progress::{CancelOnly, Progress};
use flockreel_core::raster::RgbImage;

/// A planned flock with its background.
pub(super) struct Scene<'a> {
    dataset: &'a Dataset,
    sequence: &'a Sequence,
    library: &'a Library,
    flock: Flock,
    background: Option<RgbImage>,
}

/// A flock that is ready to be drawn.
pub(super) struct Film<'a> {
    scene: &'a Scene<'a>,
    compositor: Compositor<'a>,
}

impl<'a> Scene<'a> {
    /// Plans the first `n_pictures` pictures of a flock and reads its background.
    pub(super) fn new(
        dataset: &'a Dataset,
        sequence: &'a Sequence,
        n_pictures: u32,
        progress: &dyn Progress,
    ) -> Result<Scene<'a>, Error> {
        let library = &dataset.libraries[sequence.library];
        let mut params = sequence.params.clone();
        params.frames = (n_pictures - 1) * dataset.params.every + 1;
        let flock = plan_flock(library, &params, &CancelOnly(progress))?;
        let background = match sequence.ground {
            Ground::FromParams => None,
            Ground::Picture(k) => Some(read_image(&dataset.backgrounds[k], &Limits::default())?),
        };
        Ok(Scene {
            dataset,
            sequence,
            library,
            flock,
            background,
        })
    }

    /// Returns the film of the flock.
    pub(super) fn film(&self) -> Film<'_> {
        let compositor = Compositor::new(self.library, &self.flock).straight();
        let compositor = match &self.background {
            Some(picture) => compositor.before(picture),
            None => compositor,
        };
        Film {
            scene: self,
            compositor: compositor.with_truth(),
        }
    }
}

impl Film<'_> {
    pub(super) fn params(&self) -> &Params {
        &self.scene.dataset.params
    }

    pub(super) fn look(&self) -> &Look {
        &self.scene.sequence.look
    }

    pub(super) fn flock(&self) -> &Flock {
        &self.scene.flock
    }

    pub(super) fn compositor(&self) -> &Compositor<'_> {
        &self.compositor
    }

    pub(super) fn name(&self) -> String {
        self.scene.sequence.name()
    }

    /// Returns the frame of the flock that a picture shows.
    pub(super) fn frame(&self, number: u32) -> usize {
        number as usize * self.params().every as usize
    }

    /// Returns size, length and rate of the flock.
    pub(super) fn shape(&self) -> FilmShape {
        FilmShape {
            size_px: self.compositor.size_px(),
            n_frames: self.compositor.n_frames(),
            fps: self.flock().fps,
        }
    }

    /// Returns the number of a picture in the COCO files, from 1.
    pub(super) fn image_id(&self, number: u32) -> u64 {
        let before = u64::from(self.scene.sequence.number) * u64::from(self.params().pictures);
        before + u64::from(number) + 1
    }

    /// Returns the folder of the pictures in the data set.
    pub(super) fn picture_folder(&self) -> String {
        format!(
            "images/{}/{}",
            self.scene.sequence.split.name(),
            self.name()
        )
    }

    pub(super) fn picture_path(&self, number: u32) -> String {
        let extension = self.params().picture.extension();
        format!("{}/{:06}.{extension}", self.picture_folder(), number + 1)
    }

    /// Returns the folder of the sequence's own files in the data set.
    pub(super) fn folder(&self) -> String {
        format!(
            "sequences/{}/{}",
            self.scene.sequence.split.name(),
            self.name()
        )
    }
}
