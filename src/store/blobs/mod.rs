//! The files of the store: immutable, in folders that are made elsewhere and put into place as a whole
//! before any row names them (RELIABILITY.md, store rules: sync the file, rename it, sync the folder, *then*
//! commit the row). They lie in a folder of this machine or in a bucket; whoever works on them works on files
//! of this machine.
//!
//! A folder's name holds the fence of the job that made it, so that two attempts never meet in one folder.

mod bucket;
mod draft;
mod identity;
mod room;
mod shelf;

use std::fs::{self, File};
use std::io::{self, Read};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::SystemTime;

use bytes::Bytes;
use futures_util::stream::BoxStream;
use futures_util::{Stream, TryStreamExt};
use sha2::{Digest, Sha256};
use tokio::io::{AsyncWrite, AsyncWriteExt};

pub use draft::Draft;

use bucket::Bucket;
use draft::Workplace;
use shelf::Shelf;

use super::{Error, Store, Transaction, sql};
use crate::code::Code;
use crate::config::{Files, Storage};

/// The kinds of folders.
const KINDS: [&str; 4] = ["footage", "libraries", "flocks", "fish"];

/// The name under which files bear their mark (`identity`).
const MARK: &str = "store-id";

/// One file of a folder in the store.
#[derive(Clone, Debug, PartialEq, Eq, sqlx::FromRow)]
pub struct BlobFile {
    /// The file's name in its folder; ours, never a user's.
    pub name: String,
    /// Size, bytes.
    pub size_bytes: i64,
    /// SHA-256 of the content: the ETag.
    pub sha256: Vec<u8>,
}

/// What is in place and what is being made.
#[derive(Clone, Debug)]
pub struct Blobs {
    place: Place,
    work: Arc<Workplace>,
    uploads: PathBuf,
}

/// Where files are once they are in place.
#[derive(Clone, Debug)]
enum Place {
    Shelf(Shelf),
    Bucket(Bucket),
}

/// A folder in place.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Folder {
    /// Its kind and its own name.
    pub name: String,
    /// When the youngest of its files was put there.
    pub modified: SystemTime,
    /// Size of all its files, bytes.
    pub n_bytes: u64,
}

/// Files as files of this machine, until dropped.
#[derive(Debug)]
pub struct Fetched {
    path: PathBuf,
    /// Where they are a copy.
    _copy: Option<Draft>,
}

impl Blobs {
    pub(super) async fn open(storage: &Storage) -> Result<Blobs, Error> {
        let uploads = storage.data.join("uploads");
        fs::create_dir_all(&uploads)?;
        let (place, tmp) = match &storage.store {
            None => (storage.data.join("blobs"), storage.data.join("tmp")),
            // Beside the files, for what is made is renamed into place.
            Some(Files::Folder(folder)) => (folder.clone(), folder.join("tmp")),
            Some(Files::Bucket { name, prefix }) => {
                let place = Place::Bucket(Bucket::open(name, prefix).await?);
                let work = Arc::new(Workplace::open(&storage.data.join("tmp"))?);
                return Ok(Blobs {
                    place,
                    work,
                    uploads,
                });
            }
        };
        let place = Place::Shelf(Shelf::open(&place)?);
        let work = Arc::new(Workplace::open(&tmp)?);
        shelf::sync_folder(&storage.data)?;
        Ok(Blobs {
            place,
            work,
            uploads,
        })
    }

    /// A fresh folder of this machine. The name must not have been used before.
    pub fn draft(&self, name: &str) -> io::Result<Draft> {
        self.work.draft(name)
    }

    /// Syncs and hashes every file of a draft, in the order of their names. Blocks; subfolders are
    /// an error.
    pub fn seal(&self, draft: &Draft) -> io::Result<Vec<BlobFile>> {
        let mut names: Vec<_> = fs::read_dir(draft.path())?
            .map(|entry| Ok(entry?.file_name()))
            .collect::<io::Result<_>>()?;
        names.sort();
        names
            .iter()
            .map(|name| seal_file(&draft.path().join(name)))
            .collect()
    }

    /// Puts a draft, whose files are synced, into place as `folder`, for good.
    pub async fn adopt(&self, draft: Draft, folder: &str) -> Result<(), Error> {
        match &self.place {
            Place::Shelf(shelf) => shelf.adopt(draft, folder).await,
            Place::Bucket(bucket) => bucket.put(draft.path(), folder).await,
        }
    }

    /// Removes a folder that no row names (any more). Absence is no error.
    pub async fn discard(&self, folder: &str) -> Result<(), Error> {
        match &self.place {
            Place::Shelf(shelf) => shelf.discard(folder).await,
            Place::Bucket(bucket) => bucket.discard(folder).await,
        }
    }

    /// The bytes of a file in place from `first` on, `n_bytes` of them, in pieces.
    pub async fn read(
        &self,
        folder: &str,
        name: &str,
        first: u64,
        n_bytes: u64,
    ) -> Result<BoxStream<'static, io::Result<Bytes>>, Error> {
        match &self.place {
            Place::Shelf(shelf) => shelf.read(folder, name, first, n_bytes).await,
            Place::Bucket(bucket) => Ok(bucket.read(folder, name, first, n_bytes)),
        }
    }

    /// Size and SHA-256 of a file in place, read to its end.
    pub async fn hash(&self, file: &BlobFile, folder: &str) -> Result<(i64, Vec<u8>), Error> {
        self.copy(file, folder, &mut tokio::io::sink()).await
    }

    /// Writes a file in place to somewhere else; size and SHA-256 of what was written.
    pub async fn copy(
        &self,
        file: &BlobFile,
        folder: &str,
        to: &mut (impl AsyncWrite + Unpin),
    ) -> Result<(i64, Vec<u8>), Error> {
        let n_bytes = file.size_bytes.unsigned_abs();
        let bytes = self.read(folder, &file.name, 0, n_bytes).await?;
        Ok(write_and_hash(bytes, to).await?)
    }

    /// Every folder in place, in no special order.
    pub async fn folders(&self) -> Result<Vec<Folder>, Error> {
        match &self.place {
            Place::Shelf(shelf) => Ok(shelf.folders()?),
            Place::Bucket(bucket) => bucket.folders().await,
        }
    }

    /// Where things are made.
    pub(super) fn tmp(&self) -> &Path {
        self.work.folder()
    }

    /// Where unfinished uploads of this machine grow.
    pub(super) fn uploads(&self) -> &Path {
        &self.uploads
    }

    /// Where this process makes what it makes, and others make theirs.
    pub(super) fn work(&self) -> &Workplace {
        &self.work
    }
}

impl Place {
    /// Whether it can be asked; a folder of this machine is there, or nothing of ours is.
    async fn is_there(&self) -> bool {
        match self {
            Place::Shelf(_) => true,
            Place::Bucket(bucket) => bucket.answers().await,
        }
    }
}

impl Fetched {
    /// The folder in which the files are.
    pub fn path(&self) -> &Path {
        &self.path
    }
}

impl Store {
    /// One file of a folder, if it is there.
    pub async fn blob(&self, folder: &str, name: &str) -> Result<Option<BlobFile>, Error> {
        let sql = "select name, size_bytes, sha256 from blobs where folder = $1 and name = $2";
        let blob = sql::query(sql).bind(folder).bind(name);
        Ok(blob.fetch_optional(&self.reader).await?)
    }

    /// Files of a folder, those of them that are there, as files of this machine: the very ones where they
    /// lie on it, else copies, whose content is compared with what was put in place.
    pub async fn fetch(&self, folder: &str, names: &[&str]) -> Result<Fetched, Error> {
        let bucket = match &self.blobs.place {
            Place::Shelf(shelf) => {
                return Ok(Fetched {
                    path: shelf.folder(folder),
                    _copy: None,
                });
            }
            Place::Bucket(bucket) => bucket,
        };
        let draft = self.blobs.draft(&sqlx::types::Uuid::now_v7().to_string())?;
        for name in names {
            let Some(blob) = self.blob(folder, name).await? else {
                continue;
            };
            let mut copy = tokio::fs::File::create_new(draft.path().join(name)).await?;
            let bytes = bucket.read(folder, name, 0, blob.size_bytes.unsigned_abs());
            if write_and_hash(bytes, &mut copy).await? != (blob.size_bytes, blob.sha256) {
                return Err(Error::Altered(format!("{folder}/{name}")));
            }
        }
        Ok(Fetched {
            path: draft.path().to_owned(),
            _copy: Some(draft),
        })
    }

    /// Whether a row names the folder.
    pub async fn is_folder_known(&self, folder: &str) -> Result<bool, Error> {
        let sql = "select exists (select 1 from blobs where folder = $1)";
        let known = sql::query_scalar(sql).bind(folder);
        Ok(known.fetch_one(&self.reader).await?)
    }

    /// Whether a folder in place was linked by a transaction that ended with `error`: of a lost connection nobody
    /// knows, so the rows are asked. Where they name it not, and it was the database itself that refused, the
    /// folder is thrown away; else it is left to the sweep, for a commit may still be under way.
    pub async fn is_linked_after(&self, folder: &str, error: &Error) -> Result<bool, Error> {
        match self.is_folder_known(folder).await {
            Ok(true) => return Ok(true),
            Ok(false)
                if matches!(
                    error,
                    Error::Sql(sqlx::Error::Database(_)) | Error::FilmIsKnown
                ) || error.code() == Code::StorageFull =>
            {
                self.blobs.discard(folder).await?;
            }
            Ok(false) => tracing::warn!(folder, "a folder without a row is left to the sweep"),
            Err(unknown) => tracing::warn!(folder, %unknown, "a folder is left to the sweep"),
        }
        Ok(false)
    }
}

/// Adds the rows of a folder's files, in the transaction that makes the folder's owner.
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

/// Size and SHA-256 of a file.
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

/// Writes what comes; its size and SHA-256.
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

/// A hash as people and ETags write it.
pub fn hex(bytes: &[u8]) -> String {
    bytes.iter().map(|byte| format!("{byte:02x}")).collect()
}
