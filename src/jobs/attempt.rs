//! Input and output of one attempt at a job.

use std::path::Path;
use std::sync::Arc;

use tokio::runtime::Handle;
use uuid::Uuid;

use super::{Error, Listener};
use crate::store::footage::Footage;
use crate::store::jobs::finish::Source;
use crate::store::owners::OwnerFilter;
use crate::store::resources::{self, Resource};
use crate::store::{Draft, Fetched, Spill, Store};
use flockreel_core::formats::library_dir;
use flockreel_core::ids::{FootageId, LibraryId};
use flockreel_core::library::Library;
use flockreel_core::progress::Progress;
use flockreel_core::scratch::Scratch;

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
    /// Input of the job.
    pub source: Source,
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
    pub fn footage(&self, id: FootageId) -> Result<Footage, Error> {
        self.row::<Footage>(id.0)
    }

    /// Reads a library. Must be called on a blocking thread. Fails if the library does not exist.
    pub fn library(&self, id: LibraryId) -> Result<Library, Error> {
        let row = self.row::<resources::Library>(id.0)?;
        let files = self.fetch(&row.folder, &library_dir::FILES)?;
        self.listener.report("loading", 0.0);
        Ok(library_dir::read(files.path(), self.scratch())?.library)
    }

    fn row<R: Resource>(&self, id: Uuid) -> Result<R::Row, Error> {
        let row = self.store.resource::<R>(id, &OwnerFilter::All);
        self.runtime.block_on(row)?.ok_or(Error::InputAbsent(id))
    }

    /// Returns stored files as local files. Must be called on a blocking thread.
    pub fn fetch(&self, folder: &str, names: &[&str]) -> Result<Fetched, Error> {
        Ok(self.runtime.block_on(self.store.fetch(folder, names))?)
    }
}
