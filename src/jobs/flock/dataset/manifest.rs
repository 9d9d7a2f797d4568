//! manifest.json: what a data set was made from, what each of its flocks shows, and the hash of every file. The
//! same data set can be made from it again (docs/reference/formats.md, "Data sets").

use std::fs::{self, File};
use std::io;
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};

use super::Dataset;
use super::files::Record;
use crate::store::blobs::hex;
use flockreel_core::dataset::{Ground, Params, Sequence, Split};
use flockreel_core::formats::library_dir;

/// Name of the file.
pub const MANIFEST: &str = "manifest.json";
/// Format and its version.
const SCHEMA: &str = "flockreel/dataset@1";

/// Content of manifest.json.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Manifest {
    schema: String,
    /// Version of the program. Another version may make other bytes.
    pub version: String,
    /// Parameters of the data set.
    pub params: Params,
    /// Licence of the footage, as the user states it.
    pub licence: Option<String>,
    /// Source of the footage, as the user states it.
    pub source: Option<String>,
    /// Libraries in the order in which they were given.
    pub libraries: Vec<LibraryHash>,
    /// SHA-256 of the background pictures, in the order of their file names.
    pub backgrounds: Vec<String>,
    /// The flocks; empty until the data set is complete.
    pub sequences: Vec<Entry>,
    /// All files but this one, by path; empty until the data set is complete.
    pub files: Vec<Record>,
}

/// A library of a data set.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct LibraryHash {
    /// SHA-256 of the footage.
    pub footage_sha256: String,
    /// SHA-256 of the files of the library, one after the other.
    pub sha256: String,
}

/// A flock of a data set.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Entry {
    name: String,
    split: Split,
    library: usize,
    preset: String,
    count: Option<u32>,
    seed: u64,
    size_px: Option<[u32; 2]>,
    /// `plate`, a color as `#rrggbb`, or the index of a background picture.
    background: String,
    haze_per_bl: f64,
    shadow: Option<f64>,
    gain: [f64; 3],
    blur_px: f64,
    noise: f64,
    jpeg_quality: u8,
}

impl Manifest {
    /// Returns the manifest of a data set that is not made yet.
    pub fn new(
        params: Params,
        [licence, source]: [Option<String>; 2],
        libraries: Vec<LibraryHash>,
        backgrounds: Vec<String>,
    ) -> Manifest {
        Manifest {
            schema: SCHEMA.to_owned(),
            version: env!("CARGO_PKG_VERSION").to_owned(),
            params,
            licence,
            source,
            libraries,
            backgrounds,
            sequences: Vec::new(),
            files: Vec::new(),
        }
    }

    /// Reads the manifest of a folder; `None` if it has none.
    pub fn read(folder: &Path) -> io::Result<Option<Manifest>> {
        let bytes = match fs::read(folder.join(MANIFEST)) {
            Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(None),
            read => read?,
        };
        let read = serde_json::from_slice(&bytes);
        read.map(Some)
            .map_err(|error| io::Error::new(io::ErrorKind::InvalidData, error))
    }

    /// Returns the manifest of a folder if it holds this data set with all its files.
    pub(super) fn finished_in(&self, folder: &Path) -> io::Result<Option<Manifest>> {
        let found = Manifest::read(folder)?.filter(|found| found.request() == *self);
        Ok(found.filter(|found| found.files.iter().all(|file| file.is_in(folder))))
    }

    /// Returns the part that is known before the data set is made.
    pub fn request(&self) -> Manifest {
        Manifest {
            sequences: Vec::new(),
            files: Vec::new(),
            ..self.clone()
        }
    }

    pub(super) fn fill(&mut self, dataset: &Dataset, files: Vec<Record>) {
        self.sequences = dataset.plan.sequences().map(|one| entry(&one)).collect();
        self.files = files;
    }

    pub(super) fn to_bytes(&self) -> Result<Vec<u8>, serde_json::Error> {
        let mut bytes = serde_json::to_vec_pretty(self)?;
        bytes.push(b'\n');
        Ok(bytes)
    }
}

fn entry(sequence: &Sequence) -> Entry {
    let (params, look) = (&sequence.params, &sequence.look);
    Entry {
        name: sequence.name(),
        split: sequence.split,
        library: sequence.library,
        preset: sequence.preset.clone(),
        count: params.count,
        seed: params.seed,
        size_px: params.render.size_px,
        background: match sequence.ground {
            Ground::FromParams => params.render.background.into(),
            Ground::Picture(k) => k.to_string(),
        },
        haze_per_bl: params.render.haze_per_bl,
        shadow: params.render.shadow,
        gain: look.gain,
        blur_px: look.blur_px,
        noise: look.noise,
        jpeg_quality: look.jpeg_quality,
    }
}

/// Returns the SHA-256 of the files from which a library is read.
pub fn library_sha256(folder: &Path) -> io::Result<String> {
    sha256_of(library_dir::FILES.iter().map(|name| folder.join(name)))
}

/// Returns the SHA-256 of files, one after the other. Files that do not exist are left out.
pub fn sha256_of(paths: impl Iterator<Item = PathBuf>) -> io::Result<String> {
    let mut hasher = Sha256::new();
    for path in paths.filter(|path| path.exists()) {
        io::copy(&mut File::open(path)?, &mut hasher)?;
    }
    Ok(hex(&hasher.finalize()))
}
