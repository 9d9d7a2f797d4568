//! The table of footage: one row per video, with the background and masks given for it.

use std::io;

use sqlx::types::Uuid;

use super::jobs::Lease;
use super::jobs::finish::Outcome;
use super::owners::Owner;
use super::{BlobFile, Draft, Error, Store, Transaction, blobs, sql};

/// File name of the video in its folder.
pub const VIDEO: &str = "video";
/// File name of the picture that shows the video, in its folder. Footage of older versions has none.
pub const POSTER: &str = "poster.jpg";
/// File name of the given background in its folder.
pub const BACKGROUND: &str = "background";

/// File name of the given masks in their folder.
pub const MASKS: &str = "masks";

/// One stored footage.
#[derive(Clone, Debug, PartialEq, sqlx::FromRow)]
pub struct Footage {
    /// Id of the footage.
    pub id: Uuid,
    /// Owner of the footage.
    pub owner: Owner,
    /// Folder in the blob store.
    pub folder: String,
    /// SHA-256 of the video file.
    pub sha256: Vec<u8>,
    /// SHA-256 of the given background; empty if none was given.
    pub background_sha256: Vec<u8>,
    /// SHA-256 of the given masks; empty if none were given.
    pub masks_sha256: Vec<u8>,
    /// Label given by the user; never used as a path.
    pub name: String,
    /// Size of all files, bytes.
    pub size_bytes: i64,
    /// Width in square pixels.
    pub width: i64,
    /// Height in square pixels.
    pub height: i64,
    /// Frame rate, frames per second.
    pub fps: f64,
    /// Estimated number of frames.
    pub n_frames_hint: i64,
    /// Whether this is the sample that the program made at its first start.
    pub sample: bool,
    /// Whether it stays even if nobody uses it.
    pub pinned: bool,
    /// Time of the last use, milliseconds since 1970.
    pub used_ms: i64,
    /// Time of storage, milliseconds since 1970.
    pub created_ms: i64,
}

/// Properties of a video that a sample job made.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SampleFootage {
    /// Label of the footage.
    pub name: &'static str,
    /// Width in square pixels.
    pub width: u32,
    /// Height in square pixels.
    pub height: u32,
    /// Frame rate, frames per second.
    pub fps: f64,
    /// Number of frames.
    pub n_frames: usize,
}

/// Result of adding footage.
#[derive(Clone, Debug, PartialEq)]
pub enum Added {
    /// The files were new and are stored.
    New(Footage),
    /// The owner has already stored the same files; the new copy is discarded.
    Known(Footage),
}

impl Store {
    /// Moves the received files into place and adds the row. Sets `footage.folder`. Returns the existing
    /// footage if the owner has already stored the same files. `upload` is the resumable upload that they came by.
    pub async fn add_footage(
        &self,
        mut footage: Footage,
        draft: Draft,
        files: &[BlobFile],
        upload: Option<Uuid>,
    ) -> Result<Added, Error> {
        if let Some(known) = self.footage_of_bytes(&footage).await? {
            return Ok(Added::Known(known));
        }
        footage.folder = format!("footage/{}", footage.id);
        self.blobs.adopt(draft, &footage.folder).await?;
        match self.insert_footage(&footage, files, upload).await {
            Ok(()) => {
                tracing::info!(footage.id = %footage.id, size_bytes = footage.size_bytes, "footage stored");
                Ok(Added::New(footage))
            }
            Err(error) => self.settle(footage, error).await,
        }
    }

    /// Decides the outcome after a failed insert. The row may exist nevertheless if only the database's reply
    /// was lost.
    async fn settle(&self, footage: Footage, error: Error) -> Result<Added, Error> {
        if self.is_linked_after(&footage.folder, &error).await? {
            return Ok(Added::New(footage));
        }
        // Another upload of the same files may have been stored first.
        match self.footage_of_bytes(&footage).await? {
            Some(known) => {
                self.blobs.discard(&footage.folder).await?;
                Ok(Added::Known(known))
            }
            None => Err(error),
        }
    }

    async fn footage_of_bytes(&self, footage: &Footage) -> Result<Option<Footage>, Error> {
        let sql = "select * from footage where sha256 = $1 and background_sha256 = $2 \
                   and owner = $3 and masks_sha256 = $4";
        let row = sql::query(sql)
            .bind(&footage.sha256)
            .bind(&footage.background_sha256)
            .bind(&footage.owner)
            .bind(&footage.masks_sha256);
        Ok(row.fetch_optional(&self.reader).await?)
    }

    async fn insert_footage(
        &self,
        footage: &Footage,
        files: &[BlobFile],
        upload: Option<Uuid>,
    ) -> Result<(), Error> {
        let mut transaction = self.begin().await?;
        let (owner, n_bytes) = (&footage.owner, footage.size_bytes);
        self.require_owner_space(&mut transaction, owner, n_bytes, upload)
            .await?;
        sql::query(
            "insert into footage (id, folder, sha256, background_sha256, name, size_bytes, width, \
             height, fps, n_frames_hint, sample, created_ms, owner, masks_sha256, pinned, used_ms) \
             values ($1, $2, $3, $4, $5, $6, $7, $8, $9, $10, $11, $12, $13, $14, $15, $16)",
        )
        .bind(footage.id)
        .bind(&footage.folder)
        .bind(&footage.sha256)
        .bind(&footage.background_sha256)
        .bind(&footage.name)
        .bind(footage.size_bytes)
        .bind(footage.width)
        .bind(footage.height)
        .bind(footage.fps)
        .bind(footage.n_frames_hint)
        .bind(footage.sample)
        .bind(footage.created_ms)
        .bind(&footage.owner)
        .bind(&footage.masks_sha256)
        .bind(footage.pinned)
        .bind(footage.used_ms)
        .execute(&mut transaction)
        .await?;
        blobs::insert(&mut transaction, &footage.folder, files).await?;
        Ok(transaction.commit().await?)
    }
}

/// Adds the row of the sample that a finished job made. Fails with [`Error::AlreadyStored`] if the owner has
/// uploaded the same file in the meantime.
pub(super) async fn insert_sample(
    transaction: &mut Transaction,
    lease: &Lease,
    outcome: &Outcome,
    sample: &SampleFootage,
    now_ms: i64,
) -> Result<(), Error> {
    let video = outcome.files.iter().find(|file| file.name == VIDEO);
    let video = video.ok_or_else(|| io::Error::other("the sample job produced no video"))?;
    let added = sql::query(
        "insert into footage (id, job_id, fence, folder, sha256, background_sha256, name, size_bytes, width, \
         height, fps, n_frames_hint, sample, created_ms, used_ms, owner) \
         values ($1, $2, $3, $4, $5, $6, $7, $8, $9, $10, $11, $12, true, $13, $13, \
         (select owner from jobs where id = $2))",
    )
    .bind(lease.result_id)
    .bind(lease.job_id.0)
    .bind(lease.fence)
    .bind(&outcome.folder)
    .bind(&video.sha256)
    .bind(&b""[..])
    .bind(sample.name)
    .bind(outcome.size_bytes())
    .bind(i64::from(sample.width))
    .bind(i64::from(sample.height))
    .bind(sample.fps)
    .bind(i64::try_from(sample.n_frames).unwrap_or(i64::MAX))
    .bind(now_ms)
    .execute(transaction)
    .await;
    match added {
        Err(sqlx::Error::Database(error)) if error.is_unique_violation() => {
            Err(Error::AlreadyStored)
        }
        added => Ok(added.map(drop)?),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::store::fresh;

    fn footage(sha256: u8) -> Footage {
        let id = Uuid::now_v7();
        Footage {
            id,
            owner: Owner::local(),
            folder: format!("footage/{id}"),
            sha256: vec![sha256; 32],
            background_sha256: Vec::new(),
            masks_sha256: Vec::new(),
            name: String::new(),
            size_bytes: 0,
            width: 64,
            height: 48,
            fps: 25.0,
            n_frames_hint: 40,
            sample: false,
            pinned: false,
            used_ms: 0,
            created_ms: 0,
        }
    }

    /// The error of a commit whose reply was lost.
    fn lost() -> Error {
        Error::Sql(sqlx::Error::Io(std::io::ErrorKind::ConnectionReset.into()))
    }

    /// Returns the number of stored folders.
    async fn n_folders(store: &Store) -> usize {
        store.blobs.folders().await.unwrap().len()
    }

    /// Stores the folder of an upload without adding its row.
    async fn put_in_place(store: &Store, footage: &Footage) -> Vec<BlobFile> {
        let draft = store.blobs.draft(&footage.id.to_string()).unwrap();
        std::fs::write(draft.path().join(VIDEO), b"film").unwrap();
        let files = store.blobs.seal(&draft).unwrap();
        store.blobs.adopt(draft, &footage.folder).await.unwrap();
        files
    }

    #[tokio::test]
    async fn committed_footage_keeps_its_folder_after_a_lost_reply() {
        let data = tempfile::tempdir().unwrap();
        let store = fresh::open(data.path()).await;
        let film = footage(1);
        let files = put_in_place(&store, &film).await;
        store.insert_footage(&film, &files, None).await.unwrap();
        let added = store.settle(film.clone(), lost()).await.unwrap();
        assert_eq!((added, n_folders(&store).await), (Added::New(film), 1));
    }

    #[tokio::test]
    async fn folder_with_unknown_outcome_is_left_to_the_sweep() {
        let data = tempfile::tempdir().unwrap();
        let store = fresh::open(data.path()).await;
        let film = footage(1);
        put_in_place(&store, &film).await;
        store.settle(film, lost()).await.unwrap_err();
        assert_eq!(n_folders(&store).await, 1, "its commit may be under way");
    }

    #[tokio::test]
    async fn concurrent_uploads_of_the_same_bytes_leave_one_folder() {
        let data = tempfile::tempdir().unwrap();
        let store = fresh::open(data.path()).await;
        let (first, second) = (footage(1), footage(1));
        for film in [&first, &second] {
            put_in_place(&store, film).await;
        }
        store.insert_footage(&first, &[], None).await.unwrap();
        let added = store.settle(second, lost()).await.unwrap();
        assert_eq!((added, n_folders(&store).await), (Added::Known(first), 1));
    }
}
