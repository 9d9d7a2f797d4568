//! Backup while the service writes (docs/explanation/promises.md, "Restore and upgrade"). The database is
//! copied with VACUUM INTO, never as a file. Then every file that the copied rows name is copied; stored
//! files never change.
//!
//! If a file was deleted between the two steps, the rows are copied again. In the copy, running jobs are
//! queued and their attempt does not count, because the copy has no workers.

use std::fs::{self, File};
use std::io::{self, Read};
use std::path::{Path, PathBuf};

use sqlx::types::Uuid;

use crate::store::blobs::UPLOADS;
use crate::store::sql::{self, Pool};
use crate::store::{BlobFile, Error, Store};

/// Maximum number of times that the rows are copied. Free choice.
const MAX_ROUNDS: usize = 20;
const DATABASE: &str = "flockreel.db";

/// Result of a backup.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct BackupSize {
    /// Number of copied files, including unfinished uploads.
    pub n_files: usize,
    /// Total size of the copied files, bytes.
    pub n_bytes: u64,
}

impl Store {
    /// Copies the store to the folder `target`, which must not exist. The folder appears only when the copy
    /// is complete.
    ///
    /// Fails if the database is on a server, if a stored file is damaged, or if files are deleted faster than
    /// they are copied.
    pub async fn back_up(&self, target: &Path) -> Result<BackupSize, Error> {
        let partial = partial_path(target);
        fs::create_dir_all(&partial)?;
        let mut copied = BackupSize::default();
        for _ in 0..MAX_ROUNDS {
            let snapshot = self.copy_rows(&partial.join(DATABASE)).await?;
            let is_complete = self.copy_files(&snapshot, &partial, &mut copied).await?;
            if is_complete {
                requeue_running_jobs(&snapshot).await?;
                snapshot.close().await;
                return publish(&partial, target)
                    .map(|()| copied)
                    .map_err(Error::Io);
            }
            snapshot.close().await;
        }
        let sentence =
            "stored files are deleted faster than they can be copied: run the backup again later";
        Err(Error::Io(io::Error::other(sentence)))
    }

    async fn copy_rows(&self, database: &Path) -> Result<Pool, Error> {
        if database.exists() {
            fs::remove_file(database)?;
        }
        let snapshot = self.writer.copy_to(database).await?;
        // In the copy, every unfinished upload is one file.
        let parts = format!("delete from blobs where folder like '{UPLOADS}/%'");
        sql::query(parts).execute(&snapshot).await?;
        Ok(snapshot)
    }

    /// Copies the files that the rows of the snapshot name. Returns false if one of them no longer exists.
    async fn copy_files(
        &self,
        snapshot: &Pool,
        partial: &Path,
        copied: &mut BackupSize,
    ) -> Result<bool, Error> {
        let sql = "select folder, name, size_bytes, sha256 from blobs order by folder, name";
        let rows: Vec<(String, String, i64, Vec<u8>)> = sql::query(sql).fetch_all(snapshot).await?;
        for (folder, name, size_bytes, sha256) in rows {
            let place = partial.join("blobs").join(&folder);
            let file = BlobFile {
                name,
                size_bytes,
                sha256,
            };
            if place.join(&file.name).exists() {
                continue;
            }
            if !self.copy_file(&folder, &file, &place).await? {
                return Ok(false);
            }
            copied.n_files += 1;
            copied.n_bytes += size_bytes.unsigned_abs();
        }
        let sql = "select id, offset_bytes from uploads where footage_id is null order by id";
        let uploads: Vec<(Uuid, i64)> = sql::query(sql).fetch_all(snapshot).await?;
        for (id, offset_bytes) in uploads {
            let to = partial.join(UPLOADS);
            fs::create_dir_all(&to)?;
            let to = to.join(id.to_string());
            let n_bytes = if self.blobs.are_in_bucket() {
                self.join_parts(id, &to).await?
            } else {
                copy_prefix(&self.upload_path(id), &to, offset_bytes)?
            };
            if n_bytes.is_none_or(|n_bytes| n_bytes < offset_bytes) {
                return Ok(false);
            }
            File::open(to)?.sync_all()?;
            copied.n_files += 1;
            copied.n_bytes += offset_bytes.unsigned_abs();
        }
        Ok(true)
    }

    /// Copies one file and compares it with the size and hash of its row. Returns false if the file no longer
    /// exists.
    ///
    /// The copy gets its final name only when it is complete, so that the next backup does not keep a partial
    /// one.
    async fn copy_file(&self, folder: &str, file: &BlobFile, to: &Path) -> Result<bool, Error> {
        fs::create_dir_all(to)?;
        let unverified = to.join(format!("{}.unverified", file.name));
        let mut target = tokio::fs::File::create(&unverified).await?;
        match self.blobs.copy(file, folder, &mut target).await {
            Err(Error::Io(error)) if error.kind() == io::ErrorKind::NotFound => {
                fs::remove_file(&unverified)?;
                return Ok(false);
            }
            Ok(true) => {}
            Ok(false) => {
                let name = &file.name;
                let sentence = format!(
                    "a stored file is damaged, `flockreel check` lists all: {folder}/{name}"
                );
                return Err(io::Error::other(sentence).into());
            }
            Err(error) => return Err(error),
        }
        target.sync_all().await?;
        fs::rename(&unverified, to.join(&file.name))?;
        Ok(true)
    }
}

/// Returns the folder of the unfinished copy.
fn partial_path(target: &Path) -> PathBuf {
    let mut name = target.file_name().unwrap_or_default().to_owned();
    name.push(".partial");
    target.with_file_name(name)
}

/// Copies the synced bytes of an unfinished upload; later bytes may still change. Returns the number of
/// bytes, or `None` if the file is missing.
fn copy_prefix(from: &Path, to: &Path, n_bytes: i64) -> io::Result<Option<i64>> {
    let source = match File::open(from) {
        Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(None),
        source => source?,
    };
    let mut source = source.take(n_bytes.unsigned_abs());
    let n_copied = io::copy(&mut source, &mut File::create(to)?)?;
    Ok(Some(n_copied.cast_signed()))
}

/// Returns running jobs to the queue, as a release does.
async fn requeue_running_jobs(snapshot: &Pool) -> Result<(), Error> {
    sql::query(
        "update jobs set state = 'queued', worker = null, lease_until_ms = null, stage = null, \
         progress = 0, attempt = attempt - 1 where state = 'running'",
    )
    .execute(snapshot)
    .await?;
    Ok(())
}

/// Syncs all folders of the copy and renames it to `target`.
fn publish(partial: &Path, target: &Path) -> io::Result<()> {
    sync_folders(partial)?;
    fs::rename(partial, target)?;
    let parent = target.parent().filter(|parent| *parent != Path::new(""));
    File::open(parent.unwrap_or(Path::new(".")))?.sync_all()
}

fn sync_folders(folder: &Path) -> io::Result<()> {
    for entry in fs::read_dir(folder)? {
        let path = entry?.path();
        if path.is_dir() {
            sync_folders(&path)?;
        }
    }
    File::open(folder)?.sync_all()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::store::blobs;

    #[tokio::test]
    async fn backup_after_an_interrupted_one_is_complete() {
        let data = tempfile::tempdir().unwrap();
        let store = Store::open(data.path()).await.unwrap();
        let bytes: Vec<u8> = (0..24_u32 << 20).map(|k| (k >> 7) as u8).collect();
        store_file(&store, data.path(), &bytes).await;
        let target = data.path().join("copy");
        let partial = partial_path(&target).join("blobs/footage/a");
        let begun = async {
            let has_bytes = |entry: fs::DirEntry| entry.metadata().is_ok_and(|file| file.len() > 0);
            while !fs::read_dir(&partial).is_ok_and(|mut all| all.any(|e| e.is_ok_and(has_bytes))) {
                tokio::task::yield_now().await;
            }
        };
        tokio::select! {
            biased;
            () = begun => {}
            _ = store.back_up(&target) => panic!("it ended before it could be cut short"),
        }
        store.back_up(&target).await.unwrap();
        let copy = target.join("blobs/footage/a");
        assert_eq!(fs::read(copy.join("video")).unwrap(), bytes);
        assert_eq!(fs::read_dir(copy).unwrap().count(), 1);
    }

    #[tokio::test]
    async fn file_with_appended_bytes_is_refused() {
        let data = tempfile::tempdir().unwrap();
        let store = Store::open(data.path()).await.unwrap();
        let path = store_file(&store, data.path(), b"12345").await;
        let target = data.path().join("copy");
        let mut file = File::options().append(true).open(path).unwrap();
        io::Write::write_all(&mut file, b"6").unwrap();
        let refused = store.back_up(&target).await.err();
        let sentence = refused.expect("the file is damaged").to_string();
        assert!(sentence.contains("footage/a/video"), "{sentence}");
    }

    /// Stores a file with its row and returns its path.
    async fn store_file(store: &Store, data: &Path, bytes: &[u8]) -> PathBuf {
        let draft = store.blobs().draft("film").unwrap();
        fs::write(draft.path().join("video"), bytes).unwrap();
        let files = store.blobs().seal(&draft).unwrap();
        store.blobs().adopt(draft, "footage/a").await.unwrap();
        let mut transaction = store.begin().await.unwrap();
        let added = blobs::insert(&mut transaction, "footage/a", &files);
        added.await.unwrap();
        transaction.commit().await.unwrap();
        data.join("blobs/footage/a/video")
    }
}
