//! The files of the store: immutable, in folders that are made elsewhere and moved into place
//! (RELIABILITY.md, store rules: sync the file, rename it, sync the folder, *then* commit the row).
//!
//! `tmp/` holds drafts, `blobs/` what has been moved into place. A folder's name holds the fence of
//! the job that made it, so that two attempts never meet in one folder.

use std::fs::{self, File};
use std::io::{self, Read};
use std::path::{Path, PathBuf};

use sha2::{Digest, Sha256};

use super::{Connection, Error, Store};

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

/// The two folders: what is in place and what is being made.
#[derive(Clone, Debug)]
pub struct Blobs {
    root: PathBuf,
    tmp: PathBuf,
    uploads: PathBuf,
}

/// A folder in the making; removed with all it holds unless it is moved into place.
#[derive(Debug)]
pub struct Draft {
    path: PathBuf,
    kept: bool,
}

impl Blobs {
    pub(super) fn open(data: &Path) -> io::Result<Blobs> {
        let (root, tmp) = (data.join("blobs"), data.join("tmp"));
        for folder in ["footage", "libraries", "flocks", "fish"] {
            fs::create_dir_all(root.join(folder))?;
        }
        let uploads = data.join("uploads");
        fs::create_dir_all(&tmp)?;
        fs::create_dir_all(&uploads)?;
        sync_folder(data)?;
        sync_folder(&root)?;
        Ok(Blobs { root, tmp, uploads })
    }

    /// A fresh folder under `tmp/`. The name must not have been used before.
    pub fn draft(&self, name: &str) -> io::Result<Draft> {
        let path = self.tmp.join(name);
        fs::create_dir(&path)?;
        Ok(Draft { path, kept: false })
    }

    /// Syncs and hashes every file of a draft, in the order of their names. Blocks; subfolders are
    /// an error.
    pub fn seal(&self, draft: &Draft) -> io::Result<Vec<BlobFile>> {
        let mut names: Vec<_> = fs::read_dir(&draft.path)?
            .map(|entry| Ok(entry?.file_name()))
            .collect::<io::Result<_>>()?;
        names.sort();
        names
            .iter()
            .map(|name| seal_file(&draft.path.join(name)))
            .collect()
    }

    /// Moves a draft, whose files are synced, to `folder` under `blobs/`, for good.
    pub fn adopt(&self, mut draft: Draft, folder: &str) -> io::Result<()> {
        sync_folder(&draft.path)?;
        let place = self.root.join(folder);
        fs::rename(&draft.path, &place)?;
        draft.kept = true;
        sync_folder(place.parent().unwrap_or(&self.root))
    }

    /// Removes a folder that no row names (any more). Absence is no error.
    pub fn discard(&self, folder: &str) -> io::Result<()> {
        match fs::remove_dir_all(self.root.join(folder)) {
            Err(error) if error.kind() != io::ErrorKind::NotFound => Err(error),
            _ => Ok(()),
        }
    }

    /// Where a file in place is.
    pub fn path(&self, folder: &str, name: &str) -> PathBuf {
        self.root.join(folder).join(name)
    }

    /// Where a folder in place is.
    pub fn folder(&self, folder: &str) -> PathBuf {
        self.root.join(folder)
    }

    pub(super) fn root(&self) -> &Path {
        &self.root
    }

    /// Where unfinished uploads grow.
    pub(super) fn uploads(&self) -> &Path {
        &self.uploads
    }

    pub(super) fn tmp(&self) -> &Path {
        &self.tmp
    }
}

impl Draft {
    /// Where to write.
    pub fn path(&self) -> &Path {
        &self.path
    }
}

impl Drop for Draft {
    fn drop(&mut self) {
        if !self.kept
            && let Err(error) = fs::remove_dir_all(&self.path)
        {
            tracing::warn!(%error, "a draft could not be removed; the next start sweeps it");
        }
    }
}

impl Store {
    /// One file of a folder, if it is there.
    pub async fn blob(&self, folder: &str, name: &str) -> Result<Option<BlobFile>, Error> {
        let sql = "select name, size_bytes, sha256 from blobs where folder = $1 and name = $2";
        let blob = sqlx::query_as(sql).bind(folder).bind(name);
        Ok(blob.fetch_optional(&self.reader).await?)
    }

    /// Whether a row names the folder.
    pub async fn is_folder_known(&self, folder: &str) -> Result<bool, Error> {
        let sql = "select exists (select 1 from blobs where folder = $1)";
        let known = sqlx::query_scalar(sql).bind(folder);
        Ok(known.fetch_one(&self.reader).await?)
    }
}

/// Adds the rows of a folder's files, in the transaction that makes the folder's owner.
pub(super) async fn insert(
    connection: &mut Connection,
    folder: &str,
    files: &[BlobFile],
) -> Result<(), sqlx::Error> {
    for file in files {
        sqlx::query("insert into blobs (folder, name, size_bytes, sha256) values ($1, $2, $3, $4)")
            .bind(folder)
            .bind(&file.name)
            .bind(file.size_bytes)
            .bind(&file.sha256)
            .execute(&mut *connection)
            .await?;
    }
    Ok(())
}

/// Makes the names in a folder outlive a power cut.
fn sync_folder(path: &Path) -> io::Result<()> {
    File::open(path)?.sync_all()
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

/// A hash as people and ETags write it.
pub fn hex(bytes: &[u8]) -> String {
    bytes.iter().map(|byte| format!("{byte:02x}")).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_draft_that_is_not_adopted_leaves_nothing_behind() {
        let data = tempfile::tempdir().unwrap();
        let blobs = Blobs::open(data.path()).unwrap();
        let draft = blobs.draft("x").unwrap();
        fs::write(draft.path().join("video"), b"abc").unwrap();
        drop(draft);
        assert_eq!(fs::read_dir(blobs.tmp()).unwrap().count(), 0);
    }

    #[test]
    fn a_sealed_draft_knows_its_files_and_moves_into_place() {
        let data = tempfile::tempdir().unwrap();
        let blobs = Blobs::open(data.path()).unwrap();
        let draft = blobs.draft("x").unwrap();
        fs::write(draft.path().join("b"), b"abc").unwrap();
        fs::write(draft.path().join("a"), b"").unwrap();
        let files = blobs.seal(&draft).unwrap();
        blobs.adopt(draft, "flocks/1.1").unwrap();
        assert_eq!(
            files
                .iter()
                .map(|f| (f.name.as_str(), f.size_bytes))
                .collect::<Vec<_>>(),
            [("a", 0), ("b", 3)]
        );
        assert_eq!(files[1].sha256[..4], [0xba, 0x78, 0x16, 0xbf]);
        assert_eq!(fs::read(blobs.path("flocks/1.1", "b")).unwrap(), b"abc");
    }
}
