//! Input and output of one attempt at a job.

use std::path::Path;
use std::sync::Arc;

use tokio::runtime::Handle;
use uuid::Uuid;

use super::{Error, Listener};
use crate::formats::library_dir;
use crate::ids::{FootageId, LibraryId};
use crate::scratch::Scratch;
use crate::store::jobs::finish::Made;
use crate::store::owners::Reach;
use crate::store::{Draft, Fetched, Spill, Store, footage, libraries};

/// One attempt at a job: its folder, its access to stored data, and its progress reports.
pub struct Attempt<'a> {
    /// Receives progress and passes on cancellation.
    pub listener: &'a Listener,
    /// Number of threads to use, at least 1.
    pub threads: usize,
    draft: &'a Draft,
    store: &'a Store,
    runtime: &'a Handle,
}

/// Result of an attempt. The files are in its draft.
#[derive(Clone, Debug)]
pub struct Product {
    /// Kind of the result, and its source.
    pub made: Made,
    /// All parameters, JSON.
    pub params: String,
    /// Summary for overviews, JSON.
    pub summary: String,
}

impl<'a> Attempt<'a> {
    pub(super) fn new(
        store: &'a Store,
        draft: &'a Draft,
        listener: &'a Listener,
        threads: usize,
        runtime: &'a Handle,
    ) -> Attempt<'a> {
        Attempt {
            listener,
            threads,
            draft,
            store,
            runtime,
        }
    }

    /// Returns the folder for the files of this attempt. It is empty at the start, and removed unless the job
    /// is finished.
    pub fn folder(&self) -> &Path {
        self.draft.path()
    }

    /// Returns a temporary storage for data that is too large for memory.
    pub fn scratch(&self) -> Arc<dyn Scratch> {
        Arc::new(Spill::into(self.folder()))
    }

    /// Returns the row of a footage. Must be called on a blocking thread. Fails if the footage does not
    /// exist.
    pub fn footage(&self, id: FootageId) -> Result<footage::Footage, Error> {
        let row = self
            .runtime
            .block_on(self.store.footage(id.0, &Reach::All))?;
        row.ok_or(Error::InputAbsent(id.0))
    }

    /// Returns the row of a library and its files as local files. Must be called on a blocking thread. Fails
    /// if the library does not exist.
    pub fn library(&self, id: LibraryId) -> Result<(libraries::Library, Fetched), Error> {
        let row = self
            .runtime
            .block_on(self.store.library(id.0, &Reach::All))?;
        let row = row.ok_or(Error::InputAbsent(id.0))?;
        let files = self.fetch(&row.folder, &library_dir::FILES)?;
        Ok((row, files))
    }

    /// Returns stored files as local files. Must be called on a blocking thread.
    pub fn fetch(&self, folder: &str, names: &[&str]) -> Result<Fetched, Error> {
        Ok(self.runtime.block_on(self.store.fetch(folder, names))?)
    }
}

/// Returns the folder of a result in the blob store. It contains the fence, so that two attempts never share
/// a folder.
pub(super) fn folder_of(made: Made, result: Uuid, fence: i64) -> String {
    let kind = match made {
        Made::Sample(_) => "footage",
        Made::Library(_) => "libraries",
        Made::Flock(_) => "flocks",
        Made::Fish(_) => "fish",
    };
    format!("{kind}/{result}.{fence}")
}
