//! The ground truth of a flock, written to a folder while the video is drawn, and the archive of this folder
//! (docs/reference/formats.md, "Ground truth"). `formats::ground_truth::README` describes the files.

use std::fs::{self, File};
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};

use zip::write::SimpleFileOptions;

use super::sink::remove_frames;
use flockreel_core::flock::Flock;
use flockreel_core::flock::composite::truth::FrameTruth;
use flockreel_core::formats::ground_truth::coco::Coco;
use flockreel_core::formats::ground_truth::dlc::{self, Layout};
use flockreel_core::formats::ground_truth::report::Report;
use flockreel_core::formats::ground_truth::{FilmShape, README, frame_name, mot, tracks};
use flockreel_core::formats::picture;

/// Subfolders with one picture per frame.
const MASKS: &str = "masks";
const SHADOWS: &str = "shadows";

/// The folder of a ground truth that is being written.
pub struct TruthFolder {
    folder: PathBuf,
    film: FilmShape,
    coco: Coco<BufWriter<File>>,
    mot: BufWriter<File>,
    tracks: BufWriter<File>,
    poses: BufWriter<File>,
    report: Report,
    /// Index after the last shadow picture written.
    n_shadows: usize,
}

impl TruthFolder {
    /// Starts a ground truth of `count` individuals in a folder. Creates the folder if absent.
    pub fn create(folder: &Path, film: FilmShape, count: usize) -> io::Result<TruthFolder> {
        fs::create_dir_all(folder.join(MASKS))?;
        fs::create_dir_all(folder.join("gt"))?;
        let file =
            |name: &str| Ok::<_, io::Error>(BufWriter::new(File::create(folder.join(name))?));
        fs::write(folder.join("README.txt"), README)?;
        fs::write(
            folder.join("seqinfo.ini"),
            mot::sequence(&film, "flock", "img1", "png"),
        )?;
        let mut tracks = file("tracks.csv")?;
        tracks.write_all(tracks::header().as_bytes())?;
        let mut poses = file("tracks_dlc.csv")?;
        dlc::write_header(&mut poses, Layout::Predictions, count)?;
        Ok(TruthFolder {
            folder: folder.to_owned(),
            film,
            coco: Coco::begin(file("coco.json")?, &film)?,
            mot: file("gt/gt.txt")?,
            tracks,
            poses,
            report: Report::default(),
            n_shadows: 0,
        })
    }

    /// Writes the ground truth of the next frame.
    pub fn add(&mut self, flock: &Flock, frame_idx: usize, truth: &FrameTruth) -> io::Result<()> {
        let [width, height] = truth.size_px;
        let mask = picture::write_labels(width, height, &truth.labels);
        fs::write(self.folder.join(MASKS).join(frame_name(frame_idx)), mask)?;
        if !truth.shadow.is_empty() {
            let shadow = picture::write_gray(width, height, &truth.shadow);
            let folder = self.folder.join(SHADOWS);
            fs::create_dir_all(&folder)?;
            fs::write(folder.join(frame_name(frame_idx)), shadow)?;
            self.n_shadows = frame_idx + 1;
        }
        self.coco.add(flock, frame_idx, truth)?;
        let frame = frame_idx.to_string();
        dlc::write_frame(&mut self.poses, Layout::Predictions, &frame, truth)?;
        self.report.add(frame_idx, &truth.seen);
        mot::write_frame(&mut self.mot, flock, frame_idx, truth)?;
        tracks::write_frame(&mut self.tracks, flock, &self.film, frame_idx, truth)
    }

    /// Completes all files, and removes pictures that a longer earlier video has left.
    ///
    /// `length_px` is a body length in the film, pixels.
    pub fn finish(mut self, length_px: f64) -> io::Result<()> {
        remove_frames(&self.folder.join(MASKS), self.film.n_frames)?;
        remove_frames(&self.folder.join(SHADOWS), self.n_shadows)?;
        let report = self.report.json(self.film.n_frames, length_px);
        fs::write(self.folder.join("report.json"), report)?;
        self.poses.flush()?;
        self.coco.end()?;
        self.mot.flush()?;
        self.tracks.flush()
    }
}

/// Writes all files below a folder into a ZIP archive, uncompressed, in the order of their names.
pub fn pack(folder: &Path, archive: &Path) -> io::Result<()> {
    let mut zip = zip::ZipWriter::new(BufWriter::new(File::create(archive)?));
    let stored = SimpleFileOptions::default()
        .compression_method(zip::CompressionMethod::Stored)
        .large_file(true);
    for path in files_below(folder)? {
        let name = path.strip_prefix(folder).unwrap_or(&path);
        zip.start_file(name.to_string_lossy(), stored)?;
        io::copy(&mut File::open(&path)?, &mut zip)?;
    }
    zip.finish()?.flush()
}

fn files_below(folder: &Path) -> io::Result<Vec<PathBuf>> {
    let mut entries: Vec<PathBuf> = fs::read_dir(folder)?
        .map(|entry| Ok(entry?.path()))
        .collect::<io::Result<_>>()?;
    entries.sort();
    let mut files = Vec::new();
    for path in entries {
        if path.is_dir() {
            files.extend(files_below(&path)?);
        } else {
            files.push(path);
        }
    }
    Ok(files)
}
