//! All pictures of one flock of a data set, written with their labels.

use std::path::Path;

use rayon::prelude::*;

use super::Dataset;
use super::files::{HashedFile, Record, WORK, write_hashed};
use super::scene::{Film, Scene};
use crate::jobs::Error;
use flockreel_core::dataset::{Format, Sequence};
use flockreel_core::flock::Shot;
use flockreel_core::formats::ground_truth::report::Report;
use flockreel_core::formats::ground_truth::{FilmShape, mot};
use flockreel_core::progress::Progress;

/// Number of pictures that wait in memory for each thread. Free choice.
const N_AHEAD: usize = 4;

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
