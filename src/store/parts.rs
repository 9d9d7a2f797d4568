//! The bytes of a resumable upload in a bucket, where every instance of the service finds them
//! (docs/decisions/0029-uploads-in-parts.md). What is confirmed to the sender at one time is one file, a part. The
//! parts of an upload are in one folder, and have rows as all stored files do.

use std::io::ErrorKind;
use std::path::Path;

use bytes::Bytes;
use sqlx::types::Uuid;

use super::blobs::UPLOADS;
use super::intake::Intake;
use super::{BlobFile, Blobs, Draft, Error, Store};

/// Size at which a part is stored although more bytes follow. Bounds the bytes that a crash loses, and the disk that a
/// slow sender takes; a film of 4 GiB still has only 64 parts.
pub(super) const PART_BYTES: i64 = 64 << 20;

/// A part that is being received, in a draft.
pub(super) struct Part {
    intake: Intake,
    draft: Draft,
}

/// Returns the folder of an upload's parts. Queries build the same text.
pub(super) fn folder_of(upload: Uuid) -> String {
    format!("{UPLOADS}/{}", upload.simple())
}

impl Part {
    /// Begins a part whose first byte has this offset in the upload. Its name is unique, because another instance may
    /// receive the same bytes, and the names of parts have the order of their offsets.
    pub(super) async fn begin(blobs: &Blobs, offset_bytes: i64) -> Result<Part, Error> {
        let unique = Uuid::now_v7().simple().to_string();
        let draft = blobs.draft(&unique)?;
        let name = format!("{offset_bytes:019}-{unique}");
        let intake = Intake::create(&draft, name, u64::MAX).await?;
        Ok(Part { intake, draft })
    }

    /// Appends bytes.
    pub(super) async fn take(&mut self, bytes: Bytes) -> Result<(), Error> {
        self.intake.take(bytes).await
    }

    /// Stores the part in the folder of its upload.
    pub(super) async fn store(self, blobs: &Blobs, upload: Uuid) -> Result<BlobFile, Error> {
        let file = self.intake.finish().await?;
        blobs.adopt(self.draft, &folder_of(upload)).await?;
        Ok(file)
    }
}

impl Store {
    /// Writes the parts of an upload to one file, and returns its size in bytes. Returns `None` if a part is gone,
    /// because the upload has ended.
    pub(super) async fn join_parts(&self, upload: Uuid, to: &Path) -> Result<Option<i64>, Error> {
        let folder = folder_of(upload);
        let mut file = tokio::fs::File::create(to).await?;
        let mut n_bytes = 0;
        for part in self.files_of(&folder).await? {
            match self.blobs.copy(&part, &folder, &mut file).await {
                Err(Error::Io(error)) if error.kind() == ErrorKind::NotFound => return Ok(None),
                Ok(false) => return Err(Error::CorruptFile(format!("{folder}/{}", part.name))),
                copied => copied?,
            };
            n_bytes += part.size_bytes;
        }
        Ok(Some(n_bytes))
    }
}

#[cfg(test)]
mod tests {
    use std::fs;

    use super::*;
    use crate::store::fresh;
    use crate::store::owners::Owner;
    use crate::store::uploads::Upload;

    /// Opens a store whose rows are in a folder and whose files are in a bucket.
    async fn open(data: &Path) -> Store {
        let mut storage = fresh::storage(data);
        storage.database = None;
        let store = Store::open(storage).await.unwrap();
        assert!(
            store.blobs.are_in_bucket(),
            "run it by scripts/with-servers.sh"
        );
        store
    }

    /// Adds an upload of 6 bytes, and confirms these.
    async fn add_upload(store: &Store, parts: &[&'static str]) -> Upload {
        let mut upload = Upload {
            id: Uuid::now_v7(),
            owner: Owner::local(),
            name: String::new(),
            size_bytes: 6,
            offset_bytes: 0,
            footage_id: None,
            expires_ms: i64::MAX,
        };
        store.create_upload(&upload).await.unwrap();
        let mut writer = store.open_upload(&upload).await.unwrap();
        for part in parts {
            let bytes = Bytes::from_static(part.as_bytes());
            writer.append(&upload, bytes).await.unwrap();
            writer.confirm(&mut upload, 0).await.unwrap();
        }
        upload
    }

    #[tokio::test]
    #[ignore = "needs a bucket: make scale-test"]
    async fn upload_of_an_older_version_begins_again() {
        let data = tempfile::tempdir().unwrap();
        let store = open(data.path()).await;
        let (old, new) = (
            add_upload(&store, &[]).await,
            add_upload(&store, &["12", "3"]).await,
        );
        let file = store.upload_path(old.id);
        fs::write(&file, b"12").unwrap();
        let sql = "update uploads set offset_bytes = 2 where id = $1";
        let update = crate::store::sql::query(sql).bind(old.id);
        update.execute(&store.writer).await.unwrap();
        let faults = store.check(0).await.unwrap();
        let fault = format!(
            "I1: the recorded offset differs from the sum of the parts: uploads/{}",
            old.id
        );
        assert_eq!(faults, [fault]);
        store.sweep_upload_files().await.unwrap();
        assert_eq!(store.check(0).await.unwrap(), Vec::<String>::new());
        assert!(!file.exists());
        for (upload, offset_bytes) in [(old, 0), (new, 3)] {
            let owners = crate::store::owners::OwnerFilter::All;
            let found = store.upload(upload.id, &owners, 0).await.unwrap().unwrap();
            assert_eq!(found.offset_bytes, offset_bytes);
        }
    }

    #[tokio::test]
    #[ignore = "needs a bucket: make scale-test"]
    async fn backup_has_the_parts_of_an_upload_in_one_file() {
        let data = tempfile::tempdir().unwrap();
        let store = open(data.path()).await;
        let upload = add_upload(&store, &["12", "34"]).await;
        let target = data.path().join("copy");
        let copied = store.back_up(&target).await.unwrap();
        assert_eq!((copied.n_files, copied.n_bytes), (1, 4));
        let copy = Store::open(target.as_path()).await.unwrap();
        assert_eq!(fs::read(copy.upload_path(upload.id)).unwrap(), b"1234");
        assert_eq!(copy.check(0).await.unwrap(), Vec::<String>::new());
        assert_eq!(copy.files_of(&folder_of(upload.id)).await.unwrap(), []);
    }
}
