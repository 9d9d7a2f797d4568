//! What one run of a job is given, and what it gives back.

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

/// One run of a job: where to write, how to load, whom to report to.
pub struct Attempt<'a> {
    /// Progress out, cancellation in.
    pub listener: &'a Listener,
    /// Threads to use, at least 1.
    pub threads: usize,
    draft: &'a Draft,
    store: &'a Store,
    runtime: &'a Handle,
}

/// What a run made; the files lie in its draft.
#[derive(Clone, Debug)]
pub struct Product {
    /// What was made, and of what.
    pub made: Made,
    /// The parameters in full, JSON.
    pub params: String,
    /// What is worth knowing at a glance, JSON.
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

    /// The folder that this run's files go to; fresh, and thrown away unless the run is finished.
    pub fn folder(&self) -> &Path {
        self.draft.path()
    }

    /// Where the run may put aside what memory should not hold.
    pub fn scratch(&self) -> Arc<dyn Scratch> {
        Arc::new(Spill::into(self.folder()))
    }

    /// A footage's row; must be called on a blocking thread.
    pub fn footage(&self, id: FootageId) -> Result<footage::Footage, Error> {
        let row = self
            .runtime
            .block_on(self.store.footage(id.0, &Reach::All))?;
        row.ok_or(Error::InputAbsent(id.0))
    }

    /// A library's row, and its files as files of this machine; must be called on a blocking thread.
    pub fn library(&self, id: LibraryId) -> Result<(libraries::Library, Fetched), Error> {
        let row = self
            .runtime
            .block_on(self.store.library(id.0, &Reach::All))?;
        let row = row.ok_or(Error::InputAbsent(id.0))?;
        let files = self.fetch(&row.folder, &library_dir::FILES)?;
        Ok((row, files))
    }

    /// Files of the store as files of this machine; must be called on a blocking thread.
    pub fn fetch(&self, folder: &str, names: &[&str]) -> Result<Fetched, Error> {
        Ok(self.runtime.block_on(self.store.fetch(folder, names))?)
    }
}

/// Where the files of a result lie in the store: the fence keeps two runs apart.
pub(super) fn folder_of(made: Made, result: Uuid, fence: i64) -> String {
    let kind = match made {
        Made::Sample(_) => "footage",
        Made::Library(_) => "libraries",
        Made::Flock(_) => "flocks",
        Made::Fish(_) => "fish",
    };
    format!("{kind}/{result}.{fence}")
}
