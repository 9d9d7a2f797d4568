//! Finished parts of a result (docs/explanation/promises.md, "No job is lost"): the child makes a folder for each, and the
//! worker stores it at once, so that a later attempt goes on from there. Only data sets have parts.

use std::path::PathBuf;
use std::thread::sleep;
use std::time::Duration;

use super::Attempt;
use super::message::{File, Message, Part};
use crate::jobs::{Context, Error, Listener};
use crate::store::blobs::seal_folder;
use crate::store::jobs::keep::KeptPart;
use crate::store::jobs::{Change, Kind, Lease};
use crate::store::{BlobFile, Draft, Fetched};
use flockreel_core::progress::Progress;

/// Files of a part that a later attempt needs: the index of its files, and its entries of the COCO files.
pub const KEPT_FILES: [&str; 3] = ["index.json", "images", "annotations"];
/// Interval at which the child looks whether its part is stored. Free choice; drawing a part takes seconds.
const POLL: Duration = Duration::from_millis(10);

/// Stores the parts that a child makes in the folder of a draft.
pub(super) struct PartStore<'a> {
    pub(super) context: &'a Context,
    pub(super) lease: &'a Lease,
    pub(super) draft: &'a Draft,
}

impl Attempt<'_> {
    /// Returns the parts that earlier attempts have kept.
    pub fn kept_parts(&self) -> &[Part] {
        &self.order.parts
    }

    /// Returns the folder in which a part is to be made.
    pub fn part_folder(&self, number: u32) -> PathBuf {
        self.folder.join(name_of(number))
    }

    /// Hands the folder of a finished part to the worker, and returns when it is stored.
    pub fn keep(&self, number: u32) -> Result<(), Error> {
        let folder = self.part_folder(number);
        let files = seal_folder(&folder)?;
        let files = files.into_iter().map(Into::into).collect();
        self.reporter.send(&Message::Part(number, files));
        while folder.exists() {
            if self.reporter.cancelled() {
                return Err(Error::Cancelled);
            }
            sleep(POLL);
        }
        Ok(())
    }
}

impl PartStore<'_> {
    /// Stores a part. If the lease is lost, removes the part and stops the computation.
    pub(super) async fn keep(
        &self,
        number: u32,
        files: Vec<File>,
        listener: &Listener,
    ) -> Result<(), Error> {
        let (store, lease) = (&self.context.store, self.lease);
        let (kind, result) = (lease.kind.result_kind().plural(), lease.result_id);
        // The fence in the name prevents two attempts from sharing a folder.
        let part = KeptPart {
            number: i64::from(number),
            folder: format!("{kind}/{result}.{}.{number}", lease.fence),
        };
        let files: Vec<BlobFile> = files.into_iter().map(Into::into).collect();
        let draft = self.draft.part(&name_of(number));
        store.blobs().adopt(draft, &part.folder).await?;
        match store.keep(lease, &part, &files).await {
            Ok(Change::Made) => listener.note_advance(),
            Ok(Change::Lost) => {
                store.blobs().discard(&part.folder).await?;
                listener.cancel();
            }
            Err(error) if store.is_linked_after(&part.folder, &error).await? => {
                listener.note_advance();
            }
            Err(error) => return Err(error.into()),
        }
        Ok(())
    }
}

/// Makes those files of the kept parts of a job local that another attempt needs.
pub(super) async fn fetch(context: &Context, lease: &Lease) -> Result<Vec<(u32, Fetched)>, Error> {
    let mut parts = Vec::new();
    if lease.kind != Kind::Dataset {
        return Ok(parts);
    }
    let store = &context.store;
    for part in store.kept_parts(lease.job_id.0).await? {
        let files = store.fetch(&part.folder, &KEPT_FILES).await?;
        parts.push((u32::try_from(part.number).unwrap_or(u32::MAX), files));
    }
    Ok(parts)
}

fn name_of(number: u32) -> String {
    format!("part{number}")
}
