//! Folder of a data set: the records of finished flocks, and the files that belong to all of them.
//!
//! While a data set is being made, `.work` holds what it is made from (`request.json`), the record of each
//! finished flock, and the parts of the COCO files. The manifest is written last, and `.work` is then removed.

use std::fs::{self, File, TryLockError};
use std::io;
use std::path::{Path, PathBuf};

use super::files::{HashedFile, Record, WORK, write_hashed};
use super::manifest::{MANIFEST, Manifest};
use super::{Dataset, card};
use flockreel_core::dataset::{Format, Split};
use flockreel_core::formats::ground_truth::{coco, yolo};

/// File in the work folder that says what the data set is made from.
const REQUEST: &str = "request.json";
/// File in the work folder that the process which makes the data set has locked.
const LOCK: &str = "lock";

/// Reasons why a folder cannot hold a data set.
#[derive(Debug, thiserror::Error)]
pub enum FolderError {
    /// The folder holds files that are no data set.
    #[error("the folder is not empty and holds no data set; choose another one: {}", .0.display())]
    NotEmpty(PathBuf),
    /// The folder holds a data set that is made from something else.
    #[error(
        "the folder holds another data set; give its libraries, parameters and version again, or choose another folder: {}",
        .0.display()
    )]
    Other(PathBuf),
    /// Another process makes the data set.
    #[error("another process makes a data set in this folder; wait until it has ended: {}", .0.display())]
    Busy(PathBuf),
    /// A file could not be read or written.
    #[error("a file of the data set could not be read or written: {0}")]
    Io(#[from] io::Error),
    /// A file of the data set is damaged.
    #[error("a file of the data set is damaged: {0}")]
    Damaged(#[from] serde_json::Error),
}

/// The folder of a data set that is being made.
pub(super) struct Folder {
    path: PathBuf,
    /// Keeps other processes out until it is dropped.
    _lock: File,
}

impl Folder {
    /// Opens a folder for a data set that is made from what the manifest says. Creates it if absent. Fails while
    /// another process makes a data set in it.
    pub(super) fn open(path: &Path, manifest: &Manifest) -> Result<Folder, FolderError> {
        fs::create_dir_all(path)?;
        let request = serde_json::to_vec_pretty(manifest)?;
        let is_begun = is_begun(path, manifest, &request)?;
        fs::create_dir_all(path.join(WORK))?;
        let lock = File::create(path.join(WORK).join(LOCK))?;
        lock.try_lock().map_err(|error| match error {
            TryLockError::WouldBlock => FolderError::Busy(path.into()),
            TryLockError::Error(error) => error.into(),
        })?;
        let folder = Folder {
            path: path.into(),
            _lock: lock,
        };
        if !is_begun {
            folder.write_whole(&format!("{WORK}/{REQUEST}"), &request)?;
        }
        Ok(folder)
    }

    pub(super) fn path(&self) -> &Path {
        &self.path
    }

    /// Returns the path of a file in the work folder.
    pub(super) fn work(&self, name: &str) -> PathBuf {
        self.path.join(WORK).join(name)
    }

    /// Returns whether the files of a flock are there.
    pub(super) fn is_finished(&self, sequence: &str) -> Result<bool, FolderError> {
        let bytes = match fs::read(self.work(&format!("{sequence}.json"))) {
            Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(false),
            read => read?,
        };
        let records: Vec<Record> = serde_json::from_slice(&bytes)?;
        Ok(records.iter().all(|record| record.is_in(&self.path)))
    }

    /// Writes the record of a finished flock.
    pub(super) fn finish_sequence(
        &self,
        sequence: &str,
        records: &[Record],
    ) -> Result<(), FolderError> {
        let path = format!("{WORK}/{sequence}.json");
        self.write_whole(&path, &serde_json::to_vec(records)?)
    }

    /// Joins the labels of all flocks, and writes the manifest and the README.
    pub(super) fn finish(
        &self,
        dataset: &Dataset,
        mut manifest: Manifest,
    ) -> Result<Manifest, FolderError> {
        let mut records = Vec::new();
        for sequence in dataset.plan.sequences() {
            let bytes = fs::read(self.work(&format!("{}.json", sequence.name())))?;
            records.extend(serde_json::from_slice::<Vec<Record>>(&bytes)?);
        }
        if dataset.params.formats.contains(&Format::Coco) {
            for split in Split::ALL {
                records.extend(self.join_coco(dataset, split, &manifest)?);
            }
        }
        if let Some(task) = dataset.params.yolo() {
            let text = yolo::data_yaml(task, &dataset.plan.splits());
            records.push(write_hashed(&self.path, "data.yaml", text.as_bytes())?);
        }
        records.sort_by(|a, b| a.path.cmp(&b.path));
        manifest.fill(dataset, records);
        let card = card::write(dataset, &manifest);
        let card = write_hashed(&self.path, "README.md", card.as_bytes())?;
        manifest.files.push(card);
        self.write_whole(MANIFEST, &manifest.to_bytes()?)?;
        clean(&self.path)?;
        Ok(manifest)
    }

    /// Writes the COCO file of a subset; `None` if it has no flocks.
    fn join_coco(
        &self,
        dataset: &Dataset,
        split: Split,
        manifest: &Manifest,
    ) -> Result<Option<Record>, FolderError> {
        let sequences = dataset.plan.sequences();
        let names: Vec<String> = (sequences.filter(|one| one.split == split))
            .map(|one| one.name())
            .collect();
        if names.is_empty() {
            return Ok(None);
        }
        let path = format!("annotations/{}.json", split.name());
        let mut file = HashedFile::create(&self.path, path)?;
        file.write(coco_head(manifest).as_bytes())?;
        self.join(&mut file, &names, "images")?;
        file.write(b"],\"annotations\":[")?;
        self.join(&mut file, &names, "annotations")?;
        file.write(b"\n]}\n")?;
        Ok(Some(file.finish()?))
    }

    /// Appends the lines of the parts of all flocks as the entries of a list.
    fn join(&self, file: &mut HashedFile, names: &[String], part: &str) -> io::Result<()> {
        let mut comma: &[u8] = b"\n";
        for name in names {
            let lines = fs::read(self.work(&format!("{name}.{part}")))?;
            for line in lines
                .split(|&byte| byte == b'\n')
                .filter(|line| !line.is_empty())
            {
                file.write(comma)?;
                file.write(line)?;
                comma = b",\n";
            }
        }
        Ok(())
    }

    /// Writes a file so that a stop leaves the whole file or none.
    fn write_whole(&self, path: &str, bytes: &[u8]) -> Result<(), FolderError> {
        let new = self.work("new");
        fs::write(&new, bytes)?;
        Ok(fs::rename(new, self.path.join(path))?)
    }
}

/// Returns whether the data set was begun in the folder. Fails if the folder holds something else.
fn is_begun(path: &Path, manifest: &Manifest, request: &[u8]) -> Result<bool, FolderError> {
    match fs::read(path.join(WORK).join(REQUEST)) {
        Ok(found) if found == request => return Ok(true),
        Ok(_) => return Err(FolderError::Other(path.into())),
        Err(error) if error.kind() != io::ErrorKind::NotFound => return Err(error.into()),
        Err(_) => {}
    }
    if let Some(found) = Manifest::read(path)? {
        if found.request() != *manifest {
            return Err(FolderError::Other(path.into()));
        }
        return Ok(false);
    }
    // A stop between the creation of `.work` and of the request leaves a `.work` without it.
    let is_other = |entry: io::Result<fs::DirEntry>| entry.map(|e| e.file_name() != WORK);
    let others = fs::read_dir(path)?.map(is_other);
    if others.collect::<io::Result<Vec<bool>>>()?.contains(&true) {
        return Err(FolderError::NotEmpty(path.into()));
    }
    Ok(false)
}

/// Removes what only an unfinished data set needs. A stop may have left it in a finished one.
pub(super) fn clean(path: &Path) -> Result<(), FolderError> {
    match fs::remove_dir_all(path.join(WORK)) {
        Err(error) if error.kind() == io::ErrorKind::NotFound => Ok(()),
        removed => Ok(removed?),
    }
}

/// Returns the COCO file up to the list of images.
fn coco_head(manifest: &Manifest) -> String {
    let info = serde_json::json!({
        "description": "a data set made by flockreel",
        "version": manifest.version,
        "contributor": manifest.source,
    });
    let licences = match &manifest.licence {
        Some(name) => serde_json::json!([{"id": 1, "name": name, "url": ""}]),
        None => serde_json::json!([]),
    };
    let category = coco::category();
    format!("{{\"info\":{info},\"licenses\":{licences},\"categories\":[{category}],\"images\":[")
}
