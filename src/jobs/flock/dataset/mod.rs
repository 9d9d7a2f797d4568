//! Makes a labelled data set: the pictures and labels of all planned flocks in one folder, and a manifest
//! (docs/reference/formats.md, "Data sets"; docs/explanation/algorithms.md, "Data sets").
//!
//! A flock is finished when its record is written. A data set that was stopped goes on with the first flock that
//! has no record, so a stop redoes at most one flock.

pub mod ahead; // what is told before it is made
pub mod archive; // ZIP archive in pieces
mod card; // README.md of the data set
mod files; // files with their hashes
pub mod folder; // the folder, with what a stopped run has finished
pub mod job; // libraries -> data set, with parts that later attempts keep
pub mod manifest; // what the data set was made from
mod picture; // one picture with its labels
mod scene; // a flock that is ready to be drawn
mod sequence; // all pictures of one flock
mod sheet; // samples with the truth drawn over them

use std::path::{Path, PathBuf};
use std::time::Instant;

use self::folder::{Folder, FolderError};
use self::manifest::Manifest;
use self::scene::Scene;
use crate::jobs::Error;
use flockreel_core::dataset::{Params, Plan};
use flockreel_core::formats::params;
use flockreel_core::library::Library;
use flockreel_core::progress::Progress;

/// Number of flocks of which some pictures are drawn for an estimate. Free choice: more take longer.
const N_ESTIMATED: usize = 4;
/// Number of pictures of each of these flocks.
const N_PICTURES: u32 = 4;

/// A data set to be made.
pub struct Dataset {
    /// Parameters.
    pub params: Params,
    /// The plan that follows from the parameters.
    pub plan: Plan,
    /// The libraries that the plan refers to.
    pub libraries: Vec<Library>,
    /// Files of background pictures.
    pub backgrounds: Vec<PathBuf>,
}

/// Expected size of a data set.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Estimate {
    /// Number of pictures.
    pub n_pictures: u64,
    /// Bytes of pictures and labels, estimated from a few pictures.
    pub n_bytes: u64,
    /// Seconds for drawing, estimated from the same pictures on this machine. Planning comes on top.
    pub drawing_s: f64,
}

/// A finished data set.
#[derive(Clone, Debug)]
pub struct Made {
    /// The manifest, as it was written.
    pub manifest: Manifest,
    /// Number of flocks that an earlier run had finished.
    pub n_kept: usize,
}

/// Reasons why a data set could not be made.
#[derive(Debug, thiserror::Error)]
pub enum MakeError {
    /// The folder cannot be used.
    #[error(transparent)]
    Folder(#[from] FolderError),
    /// A flock could not be made.
    #[error("flock {number}: {cause}")]
    Flock {
        /// Number of the flock.
        number: u32,
        /// Reason.
        #[source]
        cause: Error,
    },
}

impl Dataset {
    /// Plans a data set. `backgrounds` are files of pictures. Fails if a flock's parameters are invalid.
    pub fn new(
        params: Params,
        libraries: Vec<Library>,
        backgrounds: Vec<PathBuf>,
    ) -> Result<Dataset, params::Error> {
        let sizes_px = libraries.iter().map(|library| library.poses.image_size_px);
        let sizes_px: Vec<[u32; 2]> = sizes_px.collect();
        Ok(Dataset {
            plan: Plan::new(&params, &sizes_px, backgrounds.len())?,
            params,
            libraries,
            backgrounds,
        })
    }

    /// Estimates the size from a few pictures.
    pub fn estimate(&self, progress: &dyn Progress) -> Result<Estimate, MakeError> {
        let n_pictures = u64::from(self.params.flocks) * u64::from(self.params.pictures);
        let (mut n_bytes, mut n_drawn, mut drawing_s) = (0, 0, 0.0);
        let n_sequences = self.plan.n_flocks();
        let n = n_sequences.min(N_ESTIMATED);
        for k in 0..n {
            let sequence = &self.plan.sequence(k * n_sequences / n);
            let failed = |cause| MakeError::Flock {
                number: sequence.number,
                cause,
            };
            let wanted = self.params.pictures.min(N_PICTURES);
            let scene = Scene::new(self, sequence, wanted, progress).map_err(failed)?;
            let film = scene.film();
            let start = Instant::now();
            for number in 0..wanted {
                n_bytes += film.picture(number, &mut Default::default()).n_bytes() as u64;
                n_drawn += 1;
            }
            drawing_s += start.elapsed().as_secs_f64();
            progress.report("estimating", (k + 1) as f64 / n as f64);
        }
        let share = n_pictures as f64 / f64::from(n_drawn.max(1));
        Ok(Estimate {
            n_pictures,
            n_bytes: (n_bytes as f64 * share) as u64,
            drawing_s: drawing_s * share / rayon::current_num_threads() as f64,
        })
    }

    /// Makes the data set in a folder, or goes on with one that was stopped. `manifest` says what it is made from;
    /// its files and sequences are filled in.
    pub fn make(
        &self,
        folder: &Path,
        manifest: Manifest,
        progress: &dyn Progress,
    ) -> Result<Made, MakeError> {
        let n = self.plan.n_flocks();
        if let Some(manifest) = manifest.finished_in(folder).map_err(FolderError::Io)? {
            folder::clean(folder)?;
            return Ok(Made {
                manifest,
                n_kept: n,
            });
        }
        let folder = Folder::open(folder, &manifest)?;
        let mut n_kept = 0;
        for (k, sequence) in self.plan.sequences().enumerate() {
            let name = sequence.name();
            if folder.is_finished(&name)? {
                n_kept += 1;
            } else {
                let failed = |cause| MakeError::Flock {
                    number: sequence.number,
                    cause,
                };
                let records = sequence::make(self, &sequence, folder.path(), progress);
                folder.finish_sequence(&name, &records.map_err(failed)?)?;
            }
            progress.report("drawing", (k + 1) as f64 / n as f64);
        }
        let manifest = folder.finish(self, manifest)?;
        Ok(Made { manifest, n_kept })
    }
}
