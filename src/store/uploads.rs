//! The table of resumable uploads, and their files. A byte is confirmed to the sender only after it is synced
//! to disk (docs/explanation/promises.md, "No upload is lost" and "Bad networks").
//!
//! One request at a time may change an upload. A new request asks the previous one to stop: usually both come
//! from the same sender, whose connection broke without the server noticing.

use std::collections::HashMap;
use std::fs;
use std::io::{ErrorKind, SeekFrom};
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, PoisonError};

use sqlx::types::Uuid;
use tokio::fs::{File, OpenOptions};
use tokio::io::{AsyncSeekExt, AsyncWriteExt};
use tokio::sync::OwnedMutexGuard;
use tokio_util::sync::CancellationToken;

use super::blobs::hash_file;
use super::footage::VIDEO;
use super::owners::{Owner, OwnerFilter};
use super::{BlobFile, Draft, Error, Store, sql};

/// Lifetime of an unfinished upload after its last bytes, milliseconds. Free choice.
pub const LIFETIME_MS: i64 = 24 * 3600 * 1000;

/// One stored upload.
#[derive(Clone, Debug, PartialEq, sqlx::FromRow)]
pub struct Upload {
    /// Id of the upload.
    pub id: Uuid,
    /// Owner of the upload and of the footage that it becomes.
    pub owner: Owner,
    /// Label given by the sender.
    pub name: String,
    /// Size of the complete upload, bytes.
    pub size_bytes: i64,
    /// Bytes that are synced to disk and confirmed.
    pub offset_bytes: i64,
    /// The footage made of the upload; `None` until it is complete.
    pub footage_id: Option<Uuid>,
    /// Time at which an unfinished upload is deleted, milliseconds since 1970.
    pub expires_ms: i64,
}

/// The requests that hold or wait for an upload, by upload.
#[derive(Clone, Debug, Default)]
pub(super) struct UploadLocks(Arc<Mutex<HashMap<Uuid, LockState>>>);

#[derive(Clone, Debug, Default)]
struct LockState {
    requested: CancellationToken,
    mutex: Arc<tokio::sync::Mutex<()>>,
}

/// Exclusive right to change an upload. Dropping it releases the upload.
#[derive(Debug)]
pub struct UploadLock {
    /// Cancelled when another request wants the upload. The holder must then stop.
    pub requested: CancellationToken,
    _guard: OwnedMutexGuard<()>,
}

/// The file of an upload, open for appending.
#[derive(Debug)]
pub struct UploadFile {
    file: File,
}

impl Store {
    /// Adds an upload that has no bytes yet. Fails with [`Error::OwnerStorageFull`] or `storage_full` if its announced
    /// size does not fit.
    pub async fn create_upload(&self, upload: &Upload) -> Result<(), Error> {
        self.reserve.require().await?;
        File::create_new(self.upload_path(upload.id)).await?;
        // Otherwise a power loss could take the file's name, and with it bytes that were confirmed.
        File::open(self.blobs.uploads()).await?.sync_all().await?;
        let inserted = self.insert_upload(upload).await;
        if inserted.is_err() {
            self.remove_upload_file(upload.id)?;
        }
        inserted
    }

    async fn insert_upload(&self, upload: &Upload) -> Result<(), Error> {
        let mut transaction = self.writer.begin().await?;
        self.require_upload_space(&mut transaction, &upload.owner, upload.size_bytes)
            .await?;
        let sql = "insert into uploads (id, name, size_bytes, expires_ms, owner) \
                   values ($1, $2, $3, $4, $5)";
        let insert = sql::query(sql)
            .bind(upload.id)
            .bind(&upload.name)
            .bind(upload.size_bytes)
            .bind(upload.expires_ms)
            .bind(&upload.owner);
        insert.execute(&mut transaction).await?;
        Ok(transaction.commit().await?)
    }

    /// Returns an upload that has not expired and is visible to the caller.
    pub async fn upload(
        &self,
        id: Uuid,
        owners: &OwnerFilter,
        now_ms: i64,
    ) -> Result<Option<Upload>, Error> {
        let sql = "select * from uploads where id = $1 and expires_ms > $2 \
                   and ($3 is null or owner = $3)";
        let row = sql::query(sql).bind(id).bind(now_ms);
        let row = row.bind(owners.parameter());
        Ok(row.fetch_optional(&self.reader).await?)
    }

    /// Asks the current holder to stop, waits for it, and returns the exclusive right.
    pub async fn lock_upload(&self, id: Uuid) -> UploadLock {
        let (requested, mutex) = {
            let locks = &self.upload_locks.0;
            let mut locks = locks.lock().unwrap_or_else(PoisonError::into_inner);
            // Removes entries that no request holds or waits for.
            locks.retain(|other, lock| *other == id || Arc::strong_count(&lock.mutex) > 1);
            let lock = locks.entry(id).or_default();
            lock.requested.cancel();
            lock.requested = CancellationToken::new();
            (lock.requested.clone(), lock.mutex.clone())
        };
        let _guard = mutex.lock_owned().await;
        UploadLock { requested, _guard }
    }

    /// Opens the file of an upload for appending after its confirmed bytes. Unconfirmed bytes are cut off.
    pub async fn open_upload_file(&self, upload: &Upload) -> Result<UploadFile, Error> {
        let path = self.upload_path(upload.id);
        let mut file = OpenOptions::new().write(true).open(path).await?;
        file.set_len(upload.offset_bytes.unsigned_abs()).await?;
        file.seek(SeekFrom::End(0)).await?;
        Ok(UploadFile { file })
    }

    /// Records the number of synced bytes and the new expiry time.
    pub async fn record_upload_offset(&self, upload: &Upload) -> Result<(), Error> {
        let sql = "update uploads set offset_bytes = $2, expires_ms = $3 where id = $1";
        let update = sql::query(sql).bind(upload.id).bind(upload.offset_bytes);
        update.bind(upload.expires_ms).execute(&self.writer).await?;
        Ok(())
    }

    /// Returns a draft that contains the complete upload as its video, with its hash. The upload keeps its
    /// own file.
    pub async fn draft_of_upload(&self, upload: &Upload) -> Result<(Draft, BlobFile), Error> {
        let (blobs, path) = (self.blobs.clone(), self.upload_path(upload.id));
        let draft = tokio::task::spawn_blocking(move || {
            let draft = blobs.draft(&Uuid::now_v7().to_string())?;
            let video = draft.path().join(VIDEO);
            link(&path, &video)?;
            let (size_bytes, sha256) = hash_file(&video)?;
            let file = BlobFile {
                name: VIDEO.to_owned(),
                size_bytes,
                sha256,
            };
            Ok((draft, file))
        });
        draft.await.map_err(std::io::Error::other)?
    }

    /// Records the footage made of the upload, and removes the upload's file.
    pub async fn finish_upload(&self, upload: &Upload, footage: Uuid) -> Result<(), Error> {
        let update = sql::query("update uploads set footage_id = $2 where id = $1");
        let update = update.bind(upload.id).bind(footage);
        update.execute(&self.writer).await?;
        self.remove_upload_file(upload.id)
    }

    /// Deletes an upload and its file.
    pub async fn delete_upload(&self, id: Uuid) -> Result<(), Error> {
        let delete = || async {
            let delete = sql::query("delete from uploads where id = $1").bind(id);
            Ok(delete.execute(&self.writer).await?)
        };
        self.reserve.lend(delete).await?;
        self.remove_upload_file(id)
    }

    /// Deletes expired uploads and their files. Returns their number.
    pub async fn sweep_uploads(&self, now_ms: i64) -> Result<usize, Error> {
        let sql = "delete from uploads where expires_ms <= $1 returning id";
        let delete = || async {
            let delete = sql::query_scalar(sql).bind(now_ms);
            Ok(delete.fetch_all(&self.writer).await?)
        };
        let expired: Vec<Uuid> = self.reserve.lend(delete).await?;
        for id in &expired {
            self.remove_upload_file(*id)?;
        }
        Ok(expired.len())
    }

    /// Removes files that belong to no unfinished upload. Call it only while no requests are served:
    /// [`Store::create_upload`] creates the file before the row.
    pub async fn sweep_upload_files(&self) -> Result<(), Error> {
        let sql = "select id from uploads where footage_id is null";
        let known: Vec<Uuid> = sql::query_scalar(sql).fetch_all(&self.reader).await?;
        for entry in fs::read_dir(self.blobs.uploads())? {
            let entry = entry?;
            let id = entry.file_name().to_string_lossy().parse::<Uuid>().ok();
            if id.is_none_or(|id| !known.contains(&id)) {
                fs::remove_file(entry.path())?;
            }
        }
        Ok(())
    }

    pub(super) fn upload_path(&self, id: Uuid) -> PathBuf {
        self.blobs.uploads().join(id.to_string())
    }

    fn remove_upload_file(&self, id: Uuid) -> Result<(), Error> {
        match fs::remove_file(self.upload_path(id)) {
            Err(error) if error.kind() != std::io::ErrorKind::NotFound => Err(error.into()),
            _ => Ok(()),
        }
    }
}

/// Links the file under another name. Copies it if the name is on another file system.
fn link(file: &Path, name: &Path) -> std::io::Result<()> {
    match fs::hard_link(file, name) {
        Err(error) if error.kind() == ErrorKind::CrossesDevices => {
            fs::copy(file, name)?;
            fs::File::open(name)?.sync_all()
        }
        linked => linked,
    }
}

impl UploadFile {
    /// Appends bytes.
    pub async fn append(&mut self, bytes: &[u8]) -> Result<(), Error> {
        Ok(self.file.write_all(bytes).await?)
    }

    /// Syncs all appended bytes to disk.
    pub async fn sync(&mut self) -> Result<(), Error> {
        self.file.flush().await?;
        Ok(self.file.sync_all().await?)
    }
}
