//! All pictures of one flock of a data set: planned and drawn as every flock is, and written with their labels.

use std::path::Path;

use rayon::prelude::*;

use super::Dataset;
use super::folder::{HashedFile, Record, WORK, write_hashed};
use super::picture::Text;
use crate::jobs::Error;
use crate::media::{Limits, read_image};
use flockreel_core::dataset::{Format, Ground, Look, Params, Sequence};
use flockreel_core::flock::{Compositor, Flock, Shot, plan_flock};
use flockreel_core::formats::ground_truth::FilmShape;
use flockreel_core::formats::ground_truth::dlc::{self, Layout};
use flockreel_core::formats::ground_truth::report::Report;
use flockreel_core::formats::ground_truth::{mot, tracks};
use flockreel_core::library::Library;
use flockreel_core::progress::{CancelOnly, Progress};
use flockreel_core::raster::RgbImage;

/// Number of pictures that wait in memory for each thread. Free choice.
const N_AHEAD: usize = 4;

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

    /// Returns the files to which every picture adds lines.
    pub(super) fn texts(&self) -> Vec<Text> {
        let formats = self.params().formats.iter();
        formats
            .flat_map(|&format| Text::of(format))
            .copied()
            .collect()
    }

    /// Returns the path of such a file in the data set.
    fn text_path(&self, text: Text) -> String {
        let (folder, name) = (self.folder(), self.name());
        match text {
            Text::CocoImages => format!("{WORK}/{name}.images"),
            Text::CocoAnnotations => format!("{WORK}/{name}.annotations"),
            Text::Mot => format!("{folder}/gt/gt.txt"),
            Text::Tracks => format!("{folder}/tracks.csv"),
            Text::TracksDlc => format!("{folder}/tracks_dlc.csv"),
            Text::Dlc => format!("{folder}/CollectedData_flockreel.csv"),
        }
    }

    /// Returns the first lines of such a file.
    fn header(&self, text: Text) -> Vec<u8> {
        let count = self.flock().individuals.len();
        let mut header = Vec::new();
        let written = match text {
            Text::CocoImages | Text::CocoAnnotations | Text::Mot => Ok(()),
            Text::Tracks => {
                header = tracks::header().into_bytes();
                Ok(())
            }
            Text::TracksDlc => dlc::write_header(&mut header, Layout::Predictions, count),
            Text::Dlc => dlc::write_header(&mut header, Layout::Labels, count),
        };
        written.expect("writing to memory cannot fail");
        header
    }
}

/// Writes all files of a flock below the folder of the data set. Returns their paths, sizes and hashes.
pub(super) fn make(
    dataset: &Dataset,
    sequence: &Sequence,
    root: &Path,
    progress: &dyn Progress,
) -> Result<Vec<Record>, Error> {
    let n_pictures = dataset.params.pictures;
    let scene = Scene::new(dataset, sequence, n_pictures, progress)?;
    let film = scene.film();
    let mut texts = Vec::new();
    for text in film.texts() {
        let mut file = HashedFile::create(root, film.text_path(text))?;
        file.write(&film.header(text))?;
        texts.push(file);
    }
    let (mut records, mut report) = (Vec::new(), Report::default());
    let numbers: Vec<u32> = (0..n_pictures).collect();
    for numbers in numbers.chunks(N_AHEAD * rayon::current_num_threads()) {
        if progress.cancelled() {
            return Err(Error::Cancelled);
        }
        let drawn = numbers.par_iter().map_init(Shot::default, |shot, &number| {
            let labelled = film.picture(number, shot);
            let files = labelled.files.iter();
            let files = files.map(|(path, bytes)| Ok(write_hashed(root, path, bytes)?));
            let files: Vec<Record> = files.collect::<Result<_, Error>>()?;
            Ok((labelled.lines, labelled.seen, files))
        });
        let drawn: Vec<_> = drawn.collect::<Result<_, Error>>()?;
        for (&number, (lines, seen, files)) in numbers.iter().zip(drawn) {
            for (file, lines) in texts.iter_mut().zip(lines) {
                file.write(&lines)?;
            }
            report.add(number as usize, &seen);
            records.extend(files);
        }
    }
    for file in texts {
        records.push(file.finish()?);
    }
    records.extend(rest(&film, root, report)?);
    // Parts of the COCO files are joined later, and are no files of the data set.
    records.retain(|record| !record.path.starts_with(WORK));
    Ok(records)
}

/// Writes the small files of a sequence.
fn rest(film: &Film, root: &Path, report: Report) -> Result<Vec<Record>, Error> {
    let folder = film.folder();
    let length_px = film.flock().length_px * film.compositor().scale();
    let report = report.json(film.params().pictures as usize, length_px);
    let path = format!("{folder}/report.json");
    let mut records = vec![write_hashed(root, &path, report.as_bytes())?];
    if film.params().formats.contains(&Format::Mot) {
        let shape = FilmShape {
            n_frames: film.params().pictures as usize,
            fps: film.shape().fps / f64::from(film.params().every),
            ..film.shape()
        };
        let pictures = format!("../../../{}", film.picture_folder());
        let extension = film.params().picture.extension();
        let text = mot::sequence(&shape, &film.name(), &pictures, extension);
        let path = format!("{folder}/seqinfo.ini");
        records.push(write_hashed(root, &path, text.as_bytes())?);
    }
    Ok(records)
}
