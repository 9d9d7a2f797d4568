//! The data set job (docs/explanation/algorithms.md, "Data sets"). Each finished flock is kept as a part, so another attempt
//! draws at most the flock again that the last one was drawing. The files in the folder of the result are `manifest.json`,
//! `README.md`, `sheet.jpg` and the last piece of the archive; the other pieces are in the parts.

use std::collections::BTreeMap;
use std::fs::{self, File};
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use super::archive::{self, Entry, PIECE};
use super::files::Record;
use super::folder::{Folder, FolderError};
use super::manifest::{LibraryHash, MANIFEST, Manifest, library_sha256};
use super::{Dataset, MakeError, sequence};
use crate::jobs::attempt::KEPT_FILES;
use crate::jobs::{Attempt, Error, Extent, JobInput, Product, Stages, Subject};
use crate::store::jobs::Kind;
use flockreel_core::dataset::{Params, Sequence};
use flockreel_core::formats::{library_dir, picture};
use flockreel_core::ids::{DatasetId, LibraryId};
use flockreel_core::progress::Progress;

/// Stages with their share of the running time. Drawing takes almost all of it.
pub const STAGES: Stages = &[("loading", 0.02), ("drawing", 0.95), ("joining", 0.03)];
/// Name of the sheet of samples.
pub const SHEET: &str = "sheet.jpg";
/// Quality of the sheet as JPEG. Free choice: outlines of one pixel stay clear.
pub(super) const SHEET_QUALITY: u8 = 90;
/// Area of a picture for the estimate of the cost, if the library does not exist yet, pixels. Free choice.
const PICTURE_PX: f64 = 1e6;

/// Input of a data set.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Input {
    /// The libraries that the flocks are made from, at least one.
    pub library_ids: Vec<LibraryId>,
    /// Parameters of the data set.
    pub params: Params,
    /// Licence of the footage, as the user states it.
    pub licence: Option<String>,
    /// Source of the footage, as the user states it.
    pub source: Option<String>,
}

/// Summary of a data set.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
#[schema(as = DatasetSummary)]
pub struct Summary {
    /// Libraries that the flocks are made from.
    #[schema(value_type = Vec<uuid::Uuid>)]
    pub library_ids: Vec<LibraryId>,
    /// Number of flocks.
    pub flocks: u32,
    /// Number of pictures of all flocks.
    pub pictures: u64,
    /// Licence of the footage, as the user states it.
    pub licence: Option<String>,
    /// Source of the footage, as the user states it.
    pub source: Option<String>,
}

/// Files of a flock that is a part.
#[derive(Serialize, Deserialize)]
struct Index {
    /// Version of the program that made the part. Another one may make other bytes.
    version: String,
    entries: Vec<Entry>,
}

impl JobInput for Input {
    const KIND: Kind = Kind::Dataset;
    type ResultId = DatasetId;

    fn subjects(&self) -> Vec<Subject> {
        self.library_ids
            .iter()
            .copied()
            .map(Subject::Library)
            .collect()
    }

    fn cost_px(&self, library: Option<Extent>) -> Option<f64> {
        let film = |film: Extent| {
            Extent {
                n_frames: 1,
                ..film
            }
            .film_px()
        };
        let n_pictures = f64::from(self.params.flocks) * f64::from(self.params.pictures);
        Some(n_pictures * library.map_or(PICTURE_PX, film))
    }

    fn run(&self, attempt: &Attempt) -> Result<Product, Error> {
        attempt.reporter.report("loading", 0.0);
        let (dataset, manifest) = self.load(attempt)?;
        let work = Work::begin(attempt, &dataset, &manifest)?;
        let n = dataset.plan.n_flocks();
        let parts: BTreeMap<u32, &Path> = (attempt.kept_parts().iter())
            .map(|part| (part.number, part.folder.as_path()))
            .collect();
        for (k, sequence) in dataset.plan.sequences().enumerate() {
            let kept = parts.get(&sequence.number).copied();
            if !work.restore(&sequence, kept)? {
                work.make(&sequence)?;
            }
            attempt
                .reporter
                .report("drawing", (k + 1) as f64 / n as f64);
        }
        attempt.reporter.report("joining", 0.0);
        work.finish(manifest)?;
        let sheet = dataset.sheet(attempt.reporter)?;
        let sheet = picture::write_jpeg_of(&sheet, SHEET_QUALITY);
        fs::write(attempt.folder().join(SHEET), sheet)?;
        let summary = Summary {
            library_ids: self.library_ids.clone(),
            flocks: self.params.flocks,
            pictures: u64::from(self.params.flocks) * u64::from(self.params.pictures),
            licence: self.licence.clone(),
            source: self.source.clone(),
        };
        Ok(Product {
            film: None,
            params: serde_json::to_string(&self.params)?,
            summary: serde_json::to_string(&summary)?,
        })
    }
}

impl Input {
    /// Reads the libraries.
    fn load(&self, attempt: &Attempt) -> Result<(Dataset, Manifest), Error> {
        let (mut libraries, mut hashes) = (Vec::new(), Vec::new());
        for folder in attempt.libraries() {
            let stored = library_dir::read(folder, attempt.scratch())?;
            hashes.push(LibraryHash {
                footage_sha256: stored.footage.sha256,
                sha256: library_sha256(folder)?,
            });
            libraries.push(stored.library);
        }
        let terms = [self.licence.clone(), self.source.clone()];
        let manifest = Manifest::new(self.params.clone(), terms, hashes, Vec::new());
        let dataset = Dataset::new(self.params.clone(), libraries, Vec::new());
        Ok((dataset.map_err(io::Error::other)?, manifest))
    }
}

/// State of an attempt: the files of the current flock, and those entries of finished flocks that the end needs.
struct Work<'a> {
    attempt: &'a Attempt<'a>,
    dataset: &'a Dataset,
    folder: Folder,
    /// Folder of all that is removed at the end.
    path: PathBuf,
}

impl<'a> Work<'a> {
    fn begin(
        attempt: &'a Attempt<'a>,
        dataset: &'a Dataset,
        manifest: &Manifest,
    ) -> Result<Work<'a>, Error> {
        let path = attempt.folder().join("work");
        fs::create_dir_all(path.join("indices"))?;
        Ok(Work {
            attempt,
            dataset,
            folder: Folder::open(&path.join("set"), manifest)?,
            path,
        })
    }

    fn index(&self, name: &str) -> PathBuf {
        self.path.join("indices").join(name)
    }

    /// Takes the flock from a part, if there is one of this version. Returns whether there is.
    fn restore(&self, sequence: &Sequence, part: Option<&Path>) -> Result<bool, Error> {
        let [index_name, texts @ ..] = KEPT_FILES;
        let Some(part) = part else {
            return Ok(false);
        };
        let index: Index = serde_json::from_slice(&fs::read(part.join(index_name))?)?;
        if index.version != env!("CARGO_PKG_VERSION") {
            return Ok(false);
        }
        let name = sequence.name();
        for text in texts {
            link(
                &part.join(text),
                &self.folder.work(&format!("{name}.{text}")),
            )?;
        }
        let records: Vec<Record> = (index.entries.iter()).map(Entry::record).collect();
        self.folder.finish_sequence(&name, &records)?;
        link(&part.join(index_name), &self.index(&name))?;
        Ok(true)
    }

    /// Draws a flock and keeps it as a part.
    fn make(&self, sequence: &Sequence) -> Result<(), Error> {
        let (name, root, number) = (sequence.name(), self.folder.path(), sequence.number);
        let records = sequence::make(self.dataset, sequence, root, self.attempt.reporter)?;
        self.folder.finish_sequence(&name, &records)?;
        let part = self.attempt.part_folder(number);
        fs::create_dir(&part)?;
        let mut piece = BufWriter::new(File::create(part.join(PIECE))?);
        let mut entries = Vec::new();
        for record in records {
            let path = root.join(&record.path);
            entries.push(archive::append(&mut piece, root, record)?);
            fs::remove_file(path)?;
        }
        piece.flush()?;
        let [index_name, texts @ ..] = KEPT_FILES;
        let version = env!("CARGO_PKG_VERSION").to_owned();
        let index = serde_json::to_vec(&Index { version, entries })?;
        fs::write(self.index(&name), index)?;
        link(&self.index(&name), &part.join(index_name))?;
        for text in texts {
            link(
                &self.folder.work(&format!("{name}.{text}")),
                &part.join(text),
            )?;
        }
        self.attempt.keep(number)
    }

    /// Writes the files that belong to all flocks to the folder of the attempt, and removes the rest.
    fn finish(self, manifest: Manifest) -> Result<(), Error> {
        let (root, target) = (self.folder.path(), self.attempt.folder());
        let manifest = self.folder.finish(self.dataset, manifest)?;
        let mut piece = BufWriter::new(File::create(target.join(PIECE))?);
        let mut rest = Vec::new();
        // The files of the flocks are in their parts.
        for record in manifest.files.iter().filter(|record| record.is_in(root)) {
            rest.push(archive::append(&mut piece, root, record.clone())?);
        }
        let last = Record::of(root, MANIFEST)?;
        rest.push(archive::append(&mut piece, root, last)?);
        let names = self.dataset.plan.sequences().map(|one| one.name());
        let indices = names.map(|name| {
            let index: Index = serde_json::from_slice(&fs::read(self.index(&name))?)?;
            Ok(index.entries)
        });
        let entries = indices.flat_map(|entries: io::Result<Vec<Entry>>| match entries {
            Ok(entries) => entries.into_iter().map(Ok).collect(),
            Err(error) => vec![Err(error)],
        });
        archive::finish(&mut piece, entries.chain(rest.into_iter().map(Ok)))?;
        piece.flush()?;
        for name in [MANIFEST, "README.md"] {
            fs::copy(root.join(name), target.join(name))?;
        }
        Ok(fs::remove_dir_all(&self.path)?)
    }
}

/// Gives a file a second name, or copies it where that is impossible. A file that does not exist is left out.
fn link(from: &Path, to: &Path) -> io::Result<()> {
    if from.exists() && fs::hard_link(from, to).is_err() {
        fs::copy(from, to)?;
    }
    Ok(())
}

impl From<MakeError> for Error {
    fn from(error: MakeError) -> Error {
        match error {
            MakeError::Folder(error) => error.into(),
            MakeError::Flock { cause, .. } => cause,
        }
    }
}

impl From<FolderError> for Error {
    fn from(error: FolderError) -> Error {
        match error {
            FolderError::Io(error) => error.into(),
            error => io::Error::other(error).into(),
        }
    }
}
