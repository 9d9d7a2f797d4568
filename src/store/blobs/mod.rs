//! The stored files. They never change. A folder of files is completed elsewhere and then put in its final
//! place, before any row names it (docs/explanation/promises.md, "No upload is lost"). Order: sync the files,
//! rename the folder, sync its parent, then commit the row.
//!
//! The files are in a local folder or in a bucket. Code that works on files always uses local ones. The
//! folder of a job's result contains the job's fence in its name, so that two attempts never use the same
//! folder.

mod bucket;
mod draft;
mod free_space;
mod identity;
mod local;

use std::fs::{self, File};
use std::io::{self, Read};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::SystemTime;

use bytes::Bytes;
use futures_util::stream::BoxStream;
use futures_util::{Stream, TryStreamExt};
use sha2::{Digest, Sha256};
use sqlx::types::Uuid;
use tokio::io::{AsyncWrite, AsyncWriteExt};

pub use draft::Draft;

use bucket::Bucket;
use draft::Drafts;
use local::LocalFolder;

use super::{Error, Store, Transaction, sql};
use crate::config::{FileStore, Storage};
use flockreel_core::code::Code;

/// Name of the file that holds the mark of the files (`identity`).
const MARK: &str = "store-id";
/// Name of the folder of unfinished uploads: their files on this machine, or their parts in a bucket (`parts`).
pub(super) const UPLOADS: &str = "uploads";

/// One stored file.
#[derive(Clone, Debug, PartialEq, Eq, sqlx::FromRow)]
pub struct BlobFile {
    /// Name in its folder; chosen by the program, never by a user.
    pub name: String,
    /// Size, bytes.
    pub size_bytes: i64,
    /// SHA-256 of the content; used as ETag.
    pub sha256: Vec<u8>,
}

/// The stored files, and the drafts of this process.
#[derive(Clone, Debug)]
pub struct Blobs {
    backend: Backend,
    drafts: Arc<Drafts>,
    uploads: PathBuf,
}

/// Location of the stored files.
#[derive(Clone, Debug)]
enum Backend {
    Local(LocalFolder),
    Bucket(Bucket),
}

/// A stored folder.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Folder {
    /// Kind and name, as in `flocks/<name>`.
    pub name: String,
    /// Time at which its newest file was stored.
    pub modified: SystemTime,
    /// Total size of its files, bytes.
    pub n_bytes: u64,
}

/// Local files or local copies of stored files. Copies are removed on drop.
#[derive(Debug)]
pub struct Fetched {
    path: PathBuf,
    /// The copies, if the files are in a bucket.
    _copy: Option<Draft>,
}

impl Blobs {
    pub(super) async fn open(storage: &Storage) -> Result<Blobs, Error> {
        let uploads = storage.data.join(UPLOADS);
        fs::create_dir_all(&uploads).map_err(Error::at(&uploads))?;
        let open_local = |folder: &Path| match LocalFolder::open(folder) {
            Ok(local) => Ok(Backend::Local(local)),
            Err(cause) => Err(Error::at(folder)(cause)),
        };
        let data = &storage.data;
        let (backend, drafts) = match &storage.store {
            None => (open_local(&data.join("blobs"))?, data.join("tmp")),
            // Drafts are renamed into this folder, so they must be on the same file system.
            Some(FileStore::Folder(folder)) => (open_local(folder)?, folder.join("tmp")),
            Some(FileStore::Bucket { name, prefix }) => {
                let bucket = Bucket::open(name, prefix).await?;
                (Backend::Bucket(bucket), data.join("tmp"))
            }
        };
        let drafts = Arc::new(Drafts::open(&drafts).map_err(Error::at(&drafts))?);
        local::sync_folder(data).map_err(Error::at(data))?;
        Ok(Blobs {
            backend,
            drafts,
            uploads,
        })
    }

    /// Creates a draft. The name must not have been used before.
    pub fn draft(&self, name: &str) -> io::Result<Draft> {
        self.drafts.draft(name)
    }

    /// Syncs and hashes all files of a draft, as [`seal_folder`] does.
    pub fn seal(&self, draft: &Draft) -> io::Result<Vec<BlobFile>> {
        seal_folder(draft.path())
    }

    /// Syncs and hashes one file of a draft. Blocks the thread.
    pub fn seal_one(&self, draft: &Draft, name: &str) -> io::Result<BlobFile> {
        seal_file(&draft.path().join(name))
    }

    /// Stores a draft as `folder`. Its files must be synced.
    pub async fn adopt(&self, draft: Draft, folder: &str) -> Result<(), Error> {
        match &self.backend {
            Backend::Local(local) => local.adopt(draft, folder).await,
            Backend::Bucket(bucket) => bucket.put(draft.path(), folder).await,
        }
    }

    /// Returns whether the files are in a bucket, which every instance of the service reads and writes.
    pub(super) fn are_in_bucket(&self) -> bool {
        matches!(self.backend, Backend::Bucket(_))
    }

    /// Removes a part of an upload, which no row names. Only buckets have parts.
    pub(super) async fn discard_part(&self, folder: &str, name: &str) -> Result<(), Error> {
        match &self.backend {
            Backend::Local(_) => Ok(()),
            Backend::Bucket(bucket) => bucket.discard_file(folder, name).await,
        }
    }

    /// Removes a folder that no row names. Succeeds also if it does not exist.
    pub async fn discard(&self, folder: &str) -> Result<(), Error> {
        match &self.backend {
            Backend::Local(local) => local.discard(folder).await,
            Backend::Bucket(bucket) => bucket.discard(folder).await,
        }
    }

    /// Returns `n_bytes` of a stored file from offset `first`, in pieces.
    pub async fn read(
        &self,
        folder: &str,
        name: &str,
        first: u64,
        n_bytes: u64,
    ) -> Result<BoxStream<'static, io::Result<Bytes>>, Error> {
        match &self.backend {
            Backend::Local(local) => local.read(folder, name, first, n_bytes).await,
            Backend::Bucket(bucket) => Ok(bucket.read(folder, name, first, n_bytes)),
        }
    }

    /// Returns whether a stored file has the size and SHA-256 of its row. Reads the whole file.
    pub async fn is_intact(&self, file: &BlobFile, folder: &str) -> Result<bool, Error> {
        self.copy(file, folder, &mut tokio::io::sink()).await
    }

    /// Writes a stored file to `to`. Returns whether it has the size and SHA-256 of its row; a file of another
    /// size is not copied.
    pub async fn copy(
        &self,
        file: &BlobFile,
        folder: &str,
        to: &mut (impl AsyncWrite + Unpin),
    ) -> Result<bool, Error> {
        let size_bytes = match &self.backend {
            Backend::Local(local) => local.size_bytes(folder, &file.name).await?,
            Backend::Bucket(bucket) => bucket.size_bytes(folder, &file.name).await?,
        };
        if size_bytes != file.size_bytes.unsigned_abs() {
            return Ok(false);
        }
        let bytes = self.read(folder, &file.name, 0, size_bytes).await?;
        let (n_bytes, sha256) = write_and_hash(bytes, to).await?;
        Ok((n_bytes, &sha256) == (file.size_bytes, &file.sha256))
    }

    /// Returns all stored folders, in no particular order.
    pub async fn folders(&self) -> Result<Vec<Folder>, Error> {
        match &self.backend {
            Backend::Local(local) => Ok(local.folders()?),
            Backend::Bucket(bucket) => bucket.folders().await,
        }
    }

    /// Returns the folder of the drafts of all processes.
    pub(super) fn tmp(&self) -> &Path {
        self.drafts.folder()
    }

    /// Returns the folder of this machine's unfinished uploads.
    pub(super) fn uploads(&self) -> &Path {
        &self.uploads
    }

    /// Returns the drafts.
    pub(super) fn drafts(&self) -> &Drafts {
        &self.drafts
    }
}

impl Fetched {
    /// Returns the folder of the files.
    pub fn path(&self) -> &Path {
        &self.path
    }
}

impl Store {
    /// Returns one file of a folder, if it exists.
    pub async fn blob(&self, folder: &str, name: &str) -> Result<Option<BlobFile>, Error> {
        let sql = "select name, size_bytes, sha256 from blobs where folder = $1 and name = $2";
        let blob = sql::query(sql).bind(folder).bind(name);
        Ok(blob.fetch_optional(&self.reader).await?)
    }

    /// Returns the files of a folder in the order of their names.
    pub async fn files_of(&self, folder: &str) -> Result<Vec<BlobFile>, Error> {
        let sql = "select name, size_bytes, sha256 from blobs where folder = $1 order by name";
        let files = sql::query(sql).bind(folder);
        Ok(files.fetch_all(&self.reader).await?)
    }

    /// Returns local copies of those files of a folder that exist. If the store is local, returns the stored
    /// files themselves. Fails with [`Error::CorruptFile`] if a copy does not match its recorded size and hash.
    pub async fn fetch(&self, folder: &str, names: &[&str]) -> Result<Fetched, Error> {
        let bucket = match &self.blobs.backend {
            Backend::Local(local) => {
                return Ok(Fetched {
                    path: local.folder(folder),
                    _copy: None,
                });
            }
            Backend::Bucket(bucket) => bucket,
        };
        let draft = self.blobs.draft(&Uuid::now_v7().to_string())?;
        for name in names {
            let Some(blob) = self.blob(folder, name).await? else {
                continue;
            };
            let mut copy = tokio::fs::File::create_new(draft.path().join(name)).await?;
            let bytes = bucket.read(folder, name, 0, blob.size_bytes.unsigned_abs());
            if write_and_hash(bytes, &mut copy).await? != (blob.size_bytes, blob.sha256) {
                return Err(Error::CorruptFile(format!("{folder}/{name}")));
            }
        }
        Ok(Fetched {
            path: draft.path().to_owned(),
            _copy: Some(draft),
        })
    }

    /// Returns whether a row names the folder. The row of an open upload names the folder of its parts, also of
    /// those to come.
    pub async fn is_folder_known(&self, folder: &str) -> Result<bool, Error> {
        let sql = "select exists (select 1 from blobs where folder = $1 union all \
                   select 1 from uploads where id = $2 and footage_id is null)";
        let upload = folder
            .strip_prefix(UPLOADS)
            .and_then(|id| id.strip_prefix('/'));
        let upload: Option<Uuid> = upload.and_then(|id| id.parse().ok());
        let known = sql::query_scalar(sql).bind(folder).bind(upload);
        Ok(known.fetch_one(&self.reader).await?)
    }

    /// Returns whether a transaction that failed with `error` has linked a stored folder nevertheless. The
    /// reply to a commit can be lost, so this asks the database.
    ///
    /// If no row names the folder and the database rejected the transaction, the folder is removed. Otherwise
    /// the commit may still be in progress, and the folder is left to the sweep.
    pub async fn is_linked_after(&self, folder: &str, error: &Error) -> Result<bool, Error> {
        match self.is_folder_known(folder).await {
            Ok(true) => return Ok(true),
            Ok(false) if is_rejection(error) => {
                self.blobs.discard(folder).await?;
            }
            Ok(false) => tracing::warn!(
                folder,
                "a folder without a row was not removed; the sweep removes it if no row names it then"
            ),
            Err(unknown) => tracing::warn!(
                folder,
                %unknown,
                "the outcome of a transaction is unknown; the sweep removes the folder if no row names it"
            ),
        }
        Ok(false)
    }
}

/// Returns whether the database rejected a transaction, so that its commit cannot be in progress.
fn is_rejection(error: &Error) -> bool {
    matches!(
        error,
        Error::Sql(sqlx::Error::Database(_))
            | Error::AlreadyStored
            | Error::OwnerStorageFull { .. }
    ) || error.code() == Code::StorageFull
}

/// Adds the rows of a folder's files. Must run in the transaction that adds the row of the footage or result.
pub(super) async fn insert(
    transaction: &mut Transaction,
    folder: &str,
    files: &[BlobFile],
) -> Result<(), sqlx::Error> {
    for file in files {
        sql::query("insert into blobs (folder, name, size_bytes, sha256) values ($1, $2, $3, $4)")
            .bind(folder)
            .bind(&file.name)
            .bind(file.size_bytes)
            .bind(&file.sha256)
            .execute(&mut *transaction)
            .await?;
    }
    Ok(())
}

/// Syncs and hashes all files of a folder that is to be stored. Returns them in the order of their names. Blocks the
/// thread. Fails if the folder has subfolders.
pub fn seal_folder(folder: &Path) -> io::Result<Vec<BlobFile>> {
    let mut names: Vec<_> = fs::read_dir(folder)?
        .map(|entry| Ok(entry?.file_name()))
        .collect::<io::Result<_>>()?;
    names.sort();
    names
        .iter()
        .map(|name| seal_file(&folder.join(name)))
        .collect()
}

fn seal_file(path: &Path) -> io::Result<BlobFile> {
    let (size_bytes, sha256) = hash_file(path)?;
    File::open(path)?.sync_all()?;
    let name = path.file_name().unwrap_or_default();
    Ok(BlobFile {
        name: name.to_string_lossy().into_owned(),
        size_bytes,
        sha256,
    })
}

/// Returns size and SHA-256 of a file.
pub(super) fn hash_file(path: &Path) -> io::Result<(i64, Vec<u8>)> {
    let mut file = File::open(path)?;
    let mut hasher = Sha256::new();
    let mut buffer = vec![0; 1 << 20];
    let mut size_bytes = 0;
    loop {
        let n = file.read(&mut buffer)?;
        if n == 0 {
            return Ok((size_bytes, hasher.finalize().to_vec()));
        }
        hasher.update(&buffer[..n]);
        size_bytes += n as i64;
    }
}

/// Writes the stream to `to`. Returns its size and SHA-256.
async fn write_and_hash(
    mut bytes: impl Stream<Item = io::Result<Bytes>> + Unpin,
    to: &mut (impl AsyncWrite + Unpin),
) -> io::Result<(i64, Vec<u8>)> {
    let (mut hasher, mut size_bytes) = (Sha256::new(), 0);
    while let Some(piece) = bytes.try_next().await? {
        hasher.update(&piece);
        to.write_all(&piece).await?;
        size_bytes += piece.len() as i64;
    }
    to.flush().await?;
    Ok((size_bytes, hasher.finalize().to_vec()))
}

/// Returns the bytes as lower-case hexadecimal digits.
pub fn hex(bytes: &[u8]) -> String {
    bytes.iter().map(|byte| format!("{byte:02x}")).collect()
}
