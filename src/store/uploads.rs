//! The table of resumable uploads, and their bytes: in a file of this machine, or in parts if the store is a bucket.
//! A byte is confirmed to the sender only after it is synced to disk or stored in the bucket
//! (docs/explanation/promises.md, "No upload is lost" and "Bad networks").
//!
//! One request at a time may change an upload. A new request asks the previous one to stop: usually both come
//! from the same sender, whose connection broke without the server noticing. Of requests at several instances of the
//! service, the first that moves the offset wins.

use std::collections::HashMap;
use std::fs;
use std::io::{ErrorKind, SeekFrom};
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, PoisonError};

use bytes::Bytes;
use sqlx::types::Uuid;
use tokio::fs::{File, OpenOptions};
use tokio::io::{AsyncSeekExt, AsyncWriteExt};
use tokio::sync::OwnedMutexGuard;
use tokio_util::sync::CancellationToken;

use super::blobs::hash_file;
use super::footage::VIDEO;
use super::owners::{Owner, OwnerFilter};
use super::parts::{PART_BYTES, Part, folder_of};
use super::{BlobFile, Draft, Error, Store, Transaction, blobs, sql};

/// Lifetime of an unfinished upload after its last bytes, milliseconds. Free choice.
pub const LIFETIME_MS: i64 = 24 * 3600 * 1000;
/// Bytes between two syncs of a file, the most that a crash loses. Free choice.
const SYNC_BYTES: i64 = 8 << 20;

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
    /// Bytes that are stored and confirmed.
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

/// The receiver of an upload's next bytes.
pub struct UploadWriter {
    store: Store,
    target: Target,
    /// Number of bytes that are not confirmed.
    n_bytes: i64,
}

/// Where the next bytes go.
enum Target {
    /// The upload's file, open at the end of the confirmed bytes.
    File(File),
    /// A part in a bucket, from the first of the bytes on.
    Part(Option<Part>),
}

impl Store {
    /// Adds an upload that has no bytes yet. Fails with [`Error::OwnerStorageFull`], [`Error::TooManyUploads`] or
    /// `storage_full` if its announced size does not fit.
    pub async fn create_upload(&self, upload: &Upload) -> Result<(), Error> {
        self.reserve.require().await?;
        if self.blobs.are_in_bucket() {
            return self.insert_upload(upload).await;
        }
        File::create_new(self.upload_path(upload.id)).await?;
        // Otherwise a power loss could take the file's name, and with it bytes that were confirmed.
        File::open(self.blobs.uploads()).await?.sync_all().await?;
        let inserted = self.insert_upload(upload).await;
        if inserted.is_err() {
            self.remove_upload_bytes(upload.id).await?;
        }
        inserted
    }

    async fn insert_upload(&self, upload: &Upload) -> Result<(), Error> {
        let mut transaction = self.writer.begin().await?;
        let (owner, n_bytes) = (&upload.owner, upload.size_bytes.unsigned_abs());
        self.require_upload_space(&mut transaction, owner, n_bytes)
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

    /// Opens an upload for appending after its confirmed bytes. Unconfirmed bytes are cut off.
    pub async fn open_upload(&self, upload: &Upload) -> Result<UploadWriter, Error> {
        let target = if self.blobs.are_in_bucket() {
            Target::Part(None)
        } else {
            let path = self.upload_path(upload.id);
            let mut file = OpenOptions::new().write(true).open(path).await?;
            file.set_len(upload.offset_bytes.unsigned_abs()).await?;
            file.seek(SeekFrom::End(0)).await?;
            Target::File(file)
        };
        Ok(UploadWriter {
            store: self.clone(),
            target,
            n_bytes: 0,
        })
    }

    /// Records the offset and the expiry time of an upload, and its new part, if the stored offset still is
    /// `from_bytes`. Returns whether it was.
    async fn move_offset(
        &self,
        upload: &Upload,
        from_bytes: i64,
        part: Option<&BlobFile>,
    ) -> Result<bool, Error> {
        let mut transaction = self.writer.begin().await?;
        let sql = "update uploads set offset_bytes = $3, expires_ms = $4 \
                   where id = $1 and offset_bytes = $2";
        let update = sql::query(sql).bind(upload.id).bind(from_bytes);
        let update = update.bind(upload.offset_bytes).bind(upload.expires_ms);
        if update.execute(&mut transaction).await? == 0 {
            transaction.rollback().await?;
            return Ok(false);
        }
        let parts = part.map(std::slice::from_ref).unwrap_or_default();
        blobs::insert(&mut transaction, &folder_of(upload.id), parts).await?;
        transaction.commit().await?;
        Ok(true)
    }

    /// Returns a draft that contains the complete upload as its video, with its hash. The upload keeps its
    /// own bytes. Fails with [`Error::CorruptFile`] if they are not complete.
    pub async fn draft_of_upload(&self, upload: &Upload) -> Result<(Draft, BlobFile), Error> {
        let (id, path) = (upload.id, self.upload_path(upload.id));
        let draft = self.blobs.draft(&Uuid::now_v7().to_string())?;
        let video = draft.path().join(VIDEO);
        let in_parts = self.blobs.are_in_bucket();
        if in_parts {
            self.check_disk(upload.size_bytes.unsigned_abs())?;
            self.join_parts(id, &video).await?;
        }
        let (size_bytes, sha256) = tokio::task::spawn_blocking(move || {
            if !in_parts {
                link(&path, &video)?;
            }
            hash_file(&video)
        })
        .await
        .map_err(std::io::Error::other)??;
        if size_bytes != upload.size_bytes {
            return Err(Error::CorruptFile(format!("uploads/{id}")));
        }
        let file = BlobFile {
            name: VIDEO.to_owned(),
            size_bytes,
            sha256,
        };
        Ok((draft, file))
    }

    /// Records the footage made of the upload, and removes the upload's bytes.
    pub async fn finish_upload(&self, upload: &Upload, footage: Uuid) -> Result<(), Error> {
        let mut transaction = self.writer.begin().await?;
        let update = sql::query("update uploads set footage_id = $2 where id = $1");
        let update = update.bind(upload.id).bind(footage);
        update.execute(&mut transaction).await?;
        delete_parts(&mut transaction, upload.id).await?;
        transaction.commit().await?;
        self.remove_upload_bytes(upload.id).await
    }

    /// Deletes an upload and its bytes.
    pub async fn delete_upload(&self, id: Uuid) -> Result<(), Error> {
        let delete = sql::query_scalar("delete from uploads where id = $1 returning id").bind(id);
        self.delete_uploads(delete).await?;
        Ok(())
    }

    /// Deletes expired uploads and their bytes. Returns their number.
    pub async fn sweep_uploads(&self, now_ms: i64) -> Result<usize, Error> {
        let sql = "delete from uploads where expires_ms <= $1 returning id";
        self.delete_uploads(sql::query_scalar(sql).bind(now_ms))
            .await
    }

    /// Runs a statement that deletes rows and returns their ids, and deletes what else these uploads have. Returns their
    /// number.
    async fn delete_uploads(&self, rows: sql::ScalarQuery) -> Result<usize, Error> {
        let delete = || async {
            let mut transaction = self.writer.begin().await?;
            let ids: Vec<Uuid> = rows.clone().fetch_all(&mut transaction).await?;
            for id in &ids {
                delete_parts(&mut transaction, *id).await?;
            }
            transaction.commit().await?;
            Ok(ids)
        };
        let ids = self.reserve.lend(delete).await?;
        for id in &ids {
            self.remove_upload_bytes(*id).await?;
        }
        Ok(ids.len())
    }

    /// Removes files that belong to no unfinished upload; with a bucket, all. An upload to a bucket that an older version
    /// began has its bytes in such a file of one instance, so it begins again. Call it only while no requests are served:
    /// [`Store::create_upload`] creates the file before the row.
    pub async fn sweep_upload_files(&self) -> Result<(), Error> {
        let in_bucket = self.blobs.are_in_bucket();
        if in_bucket {
            let sql = "update uploads set offset_bytes = 0 where footage_id is null and offset_bytes > 0 \
                       and not exists (select 1 from blobs where folder = 'uploads/' || lower(hex(uploads.id)))";
            sql::query(sql).execute(&self.writer).await?;
        }
        let sql = "select id from uploads where footage_id is null";
        let known: Vec<Uuid> = sql::query_scalar(sql).fetch_all(&self.reader).await?;
        for entry in fs::read_dir(self.blobs.uploads())? {
            let entry = entry?;
            let id = entry.file_name().to_string_lossy().parse::<Uuid>().ok();
            if in_bucket || id.is_none_or(|id| !known.contains(&id)) {
                fs::remove_file(entry.path())?;
            }
        }
        Ok(())
    }

    pub(super) fn upload_path(&self, id: Uuid) -> PathBuf {
        self.blobs.uploads().join(id.to_string())
    }

    async fn remove_upload_bytes(&self, id: Uuid) -> Result<(), Error> {
        if self.blobs.are_in_bucket() {
            return self.blobs.discard(&folder_of(id)).await;
        }
        match fs::remove_file(self.upload_path(id)) {
            Err(error) if error.kind() != std::io::ErrorKind::NotFound => Err(error.into()),
            _ => Ok(()),
        }
    }
}

/// Deletes the rows of an upload's parts. Call it after the row of the upload was changed, which waits for a part that
/// another instance is adding.
async fn delete_parts(transaction: &mut Transaction, upload: Uuid) -> Result<(), sqlx::Error> {
    let delete = sql::query("delete from blobs where folder = $1").bind(folder_of(upload));
    delete.execute(transaction).await?;
    Ok(())
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

impl UploadWriter {
    /// Returns the number of bytes that were appended and not confirmed.
    pub fn n_bytes(&self) -> i64 {
        self.n_bytes
    }

    /// Returns whether the unconfirmed bytes have reached their limit. The caller must then confirm them.
    pub fn is_due(&self) -> bool {
        let most = match self.target {
            Target::File(_) => SYNC_BYTES,
            Target::Part(_) => PART_BYTES,
        };
        self.n_bytes >= most
    }

    /// Appends bytes to the upload.
    pub async fn append(&mut self, upload: &Upload, bytes: Bytes) -> Result<(), Error> {
        self.n_bytes += bytes.len() as i64;
        match &mut self.target {
            Target::File(file) => Ok(file.write_all(&bytes).await?),
            Target::Part(Some(part)) => part.take(bytes).await,
            Target::Part(none) => {
                let part = Part::begin(&self.store.blobs, upload.offset_bytes).await?;
                none.insert(part).take(bytes).await
            }
        }
    }

    /// Stores the appended bytes, moves the offset of the upload, and begins its lifetime again. Fails with
    /// [`Error::UploadChanged`] if another request was faster; the bytes are then discarded.
    pub async fn confirm(&mut self, upload: &mut Upload, now_ms: i64) -> Result<(), Error> {
        let part = match &mut self.target {
            Target::File(file) => {
                sync(file).await?;
                None
            }
            Target::Part(part) => part.take(),
        };
        let blobs = &self.store.blobs;
        let part = match part {
            Some(part) => Some(part.store(blobs, upload.id).await?),
            None => None,
        };
        let from_bytes = upload.offset_bytes;
        upload.offset_bytes += std::mem::take(&mut self.n_bytes);
        upload.expires_ms = now_ms + LIFETIME_MS;
        let moved = self.store.move_offset(upload, from_bytes, part.as_ref());
        if moved.await? {
            return Ok(());
        }
        if let Some(part) = part {
            blobs
                .discard_part(&folder_of(upload.id), &part.name)
                .await?;
        }
        Err(Error::UploadChanged)
    }
}

async fn sync(file: &mut File) -> Result<(), Error> {
    file.flush().await?;
    Ok(file.sync_all().await?)
}
