//! Marks that show which database and which files belong together. Both store the same random mark, created
//! at their first use together. Without this check, a sweep with another database would find no rows for the
//! files and delete them all.

use super::{Backend, hex};
use crate::store::tokens::random_key;
use crate::store::{Error, Store, sql};

/// Length of a mark, bytes.
const MARK_BYTES: usize = 32;

impl Store {
    /// Verifies that database and files have the same mark. Fails with [`Error::ForeignFiles`] if they differ.
    ///
    /// A missing mark is added if the database knows at least one of the files, or if there are no files.
    pub(in crate::store) async fn check_identity(&self) -> Result<(), Error> {
        let of_rows = self.mark_of_rows().await?;
        let of_files = self.mark_of_files().await?;
        if let (Some(of_rows), Some(of_files)) = (&of_rows, &of_files) {
            return if hex(of_rows) == *of_files {
                Ok(())
            } else {
                Err(Error::ForeignFiles)
            };
        }
        if !self.knows_files().await? {
            return Err(Error::ForeignFiles);
        }
        let mark = match (of_rows, &of_files) {
            (Some(mark), _) => mark,
            (None, Some(of_files)) => {
                let mark = parse_mark(of_files).ok_or(Error::ForeignFiles)?;
                self.mark_rows(&mark).await?
            }
            (None, None) => self.mark_rows(&random_key()?).await?,
        };
        // Processes that start at the same time have all read the same mark of the database here.
        match of_files {
            None => self.mark_files(&hex(&mark)).await,
            Some(of_files) if of_files == hex(&mark) => Ok(()),
            Some(_) => Err(Error::ForeignFiles),
        }
    }

    /// Returns whether the database knows any of the files, or there are none.
    async fn knows_files(&self) -> Result<bool, Error> {
        let folders = self.blobs.folders().await?;
        for folder in &folders {
            if self.is_folder_known(&folder.name).await? {
                return Ok(true);
            }
        }
        Ok(folders.is_empty())
    }

    async fn mark_of_rows(&self) -> Result<Option<Vec<u8>>, Error> {
        let sql = "select secret from keys where name = 'store'";
        Ok(sql::query_scalar(sql).fetch_optional(&self.reader).await?)
    }

    /// Stores a mark in the database unless another process has stored one. Returns the stored mark.
    async fn mark_rows(&self, mark: &[u8]) -> Result<Vec<u8>, Error> {
        sql::query("insert into keys (name, secret) values ('store', $1) on conflict do nothing")
            .bind(mark)
            .execute(&self.writer)
            .await?;
        let sql = "select secret from keys where name = 'store'";
        Ok(sql::query_scalar(sql).fetch_one(&self.writer).await?)
    }

    async fn mark_of_files(&self) -> Result<Option<String>, Error> {
        match &self.blobs.backend {
            Backend::Local(local) => Ok(local.mark()?),
            Backend::Bucket(bucket) => bucket.mark().await,
        }
    }

    async fn mark_files(&self, mark: &str) -> Result<(), Error> {
        match &self.blobs.backend {
            Backend::Local(local) => Ok(local.set_mark(mark)?),
            Backend::Bucket(bucket) => bucket.set_mark(mark).await,
        }
    }
}

/// Returns the bytes of a mark: 64 hexadecimal digits. Returns `None` for any other text.
fn parse_mark(text: &str) -> Option<Vec<u8>> {
    let pairs = text.as_bytes().chunks(2);
    let bytes = pairs.map(|pair| u8::from_str_radix(std::str::from_utf8(pair).ok()?, 16).ok());
    let bytes: Vec<u8> = bytes.collect::<Option<_>>()?;
    (bytes.len() == MARK_BYTES && hex(&bytes) == text).then_some(bytes)
}

#[cfg(test)]
mod tests {
    use std::fs;
    use std::path::Path;

    use super::*;
    use crate::config::{FileStore, Storage};

    /// Returns a storage with its own database and a folder of files that others may use too.
    fn storage(rows: &Path, files: &Path) -> Storage {
        Storage {
            store: Some(FileStore::Folder(files.to_owned())),
            ..Storage::from(rows)
        }
    }

    async fn open(rows: &Path, files: &Path) -> Result<(), Error> {
        let store = Store::open(storage(rows, files)).await?;
        store.close().await;
        Ok(())
    }

    #[tokio::test]
    async fn foreign_database_is_refused_and_nothing_is_swept() {
        let [own, other, files] = [(); 3].map(|()| tempfile::tempdir().unwrap());
        open(own.path(), files.path()).await.unwrap();
        let film = files.path().join("footage/a");
        fs::create_dir(&film).unwrap();
        let refused = open(other.path(), files.path()).await.unwrap_err();
        assert!(matches!(refused, Error::ForeignFiles), "{refused}");
        assert!(film.is_dir());
        open(own.path(), files.path()).await.unwrap();
    }

    #[tokio::test]
    async fn unmarked_files_are_adopted_only_by_a_database_that_knows_them() {
        let [own, other, files] = [(); 3].map(|()| tempfile::tempdir().unwrap());
        let store = Store::open(storage(own.path(), files.path()))
            .await
            .unwrap();
        sql::query("insert into blobs (folder, name, size_bytes, sha256) values ($1, $2, $3, $4)")
            .bind("footage/a")
            .bind("video")
            .bind(0_i64)
            .bind([0_u8; 32].as_slice())
            .execute(&store.writer)
            .await
            .unwrap();
        store.close().await;
        drop(store);
        fs::create_dir(files.path().join("footage/a")).unwrap();
        fs::remove_file(files.path().join("store-id")).unwrap();
        assert!(open(other.path(), files.path()).await.is_err());
        open(own.path(), files.path()).await.unwrap();
        assert!(files.path().join("store-id").is_file());
    }

    #[tokio::test]
    async fn broken_mark_of_files_is_refused_and_not_taken_over() {
        let [rows, files] = [(); 2].map(|()| tempfile::tempdir().unwrap());
        let mark = files.path().join("store-id");
        for broken in ["", "12", "not a mark"] {
            fs::write(&mark, broken).unwrap();
            let refused = open(rows.path(), files.path()).await;
            assert!(matches!(refused, Err(Error::ForeignFiles)), "{broken:?}");
        }
        fs::remove_file(&mark).unwrap();
        open(rows.path(), files.path()).await.unwrap();
        assert_eq!(fs::read_to_string(&mark).unwrap().len(), 64);
        let names = fs::read_dir(files.path()).unwrap();
        let mut names: Vec<_> = names.map(|entry| entry.unwrap().file_name()).collect();
        names.sort();
        let wanted = [
            "datasets",
            "fish",
            "flocks",
            "footage",
            "libraries",
            "store-id",
            "tmp",
            "views",
        ];
        assert_eq!(names, wanted, "a temporary file is left");
    }

    #[tokio::test]
    async fn empty_store_is_adopted_by_any_database() {
        let [own, other, files] = [(); 3].map(|()| tempfile::tempdir().unwrap());
        open(own.path(), files.path()).await.unwrap();
        open(other.path(), files.path()).await.unwrap();
    }
}
