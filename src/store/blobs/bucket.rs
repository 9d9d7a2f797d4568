//! Files in an S3-compatible bucket. Address and keys are in the usual `AWS_*` variables; the keys may be in the file
//! of `AWS_SHARED_CREDENTIALS_FILE`, as secrets of containers are. Multipart uploads
//! use pieces of equal size and are aborted on failure. A piece left by a crash costs money until a rule of the
//! bucket removes it.

use std::collections::BTreeMap;
use std::io;
use std::path::Path as FilePath;
use std::sync::Arc;
use std::time::{Duration, SystemTime};

use bytes::Bytes;
use futures_util::stream::{BoxStream, StreamExt, TryStreamExt, try_unfold};
use object_store::aws::AmazonS3Builder;
use object_store::buffered::BufWriter;
use object_store::path::Path;
use object_store::{ClientOptions, ObjectMeta, ObjectStore, ObjectStoreExt};
use tokio::fs::File;
use tokio::io::{AsyncWriteExt, BufReader};
use tokio::time::timeout;

use super::{Folder, UPLOADS};
use crate::store::resources::ResourceKind;
use crate::store::{Error, tls};

/// Size of every piece except the last, bytes. It exceeds the minimum of every provider, and some require
/// equal sizes.
const PIECE_BYTES: usize = 16 << 20;
/// Size of one read request, bytes. Short requests do not stay open while a client downloads slowly.
const READ_BYTES: u64 = 4 << 20;

/// Maximum wait of a readiness probe. If the bucket is slow, the next probe asks again. Free choice.
const PROBE_TIMEOUT: Duration = Duration::from_secs(2);

/// A bucket and the prefix of our files in it.
#[derive(Clone, Debug)]
pub(super) struct Bucket {
    store: Arc<dyn ObjectStore>,
    prefix: String,
}

/// The key with which requests are signed.
#[derive(PartialEq, Eq)]
struct Keys {
    id: String,
    secret: String,
}

impl Keys {
    /// Reads the profile `default` of a credentials file, as other programs for S3 write it.
    fn read(file: &FilePath) -> Result<Keys, Error> {
        let text = std::fs::read_to_string(file).map_err(Error::at(file))?;
        let absent = "the section [default] lacks aws_access_key_id or aws_secret_access_key";
        Keys::parse(&text).ok_or_else(|| Error::at(file)(io::Error::other(absent)))
    }

    fn parse(text: &str) -> Option<Keys> {
        let lines = text.lines().map(str::trim);
        let profile = lines.skip_while(|line| *line != "[default]").skip(1);
        let settings = profile
            .take_while(|line| !line.starts_with('['))
            .filter_map(|line| line.split_once('='));
        let settings: BTreeMap<&str, &str> = settings
            .map(|(name, value)| (name.trim(), value.trim()))
            .collect();
        let value = |name| settings.get(name).copied().map(str::to_owned);
        Some(Keys {
            id: value("aws_access_key_id")?,
            secret: value("aws_secret_access_key")?,
        })
    }
}

impl Bucket {
    /// Opens the bucket. Fails if it cannot be listed.
    pub(super) async fn open(name: &str, prefix: &str) -> Result<Bucket, Error> {
        tls::choose_cryptography();
        let mut builder = AmazonS3Builder::from_env().with_bucket_name(name);
        let variable = |name: &str| std::env::var_os(name).filter(|value| !value.is_empty());
        // Keys in the environment come first, as in other programs.
        if variable("AWS_ACCESS_KEY_ID").is_none()
            && let Some(file) = variable("AWS_SHARED_CREDENTIALS_FILE")
        {
            let Keys { id, secret } = Keys::read(FilePath::new(&file))?;
            builder = builder
                .with_access_key_id(id)
                .with_secret_access_key(secret);
        }
        // HTTP is used only if the configured address asks for it.
        let options = ClientOptions::new().with_allow_http(true);
        let store = builder.with_client_options(options).build()?;
        let bucket = Bucket {
            store: Arc::new(store),
            prefix: prefix.trim_matches('/').to_owned(),
        };
        let mut objects = bucket.store.list(Some(&bucket.path("footage")));
        objects.try_next().await?;
        drop(objects);
        Ok(bucket)
    }

    /// Returns whether the bucket answers in time. The probe asks for an object that never exists, so "not
    /// found" is a valid answer.
    pub(super) async fn answers(&self) -> bool {
        let nothing = self.path("footage/readiness");
        let asked = self.store.head(&nothing);
        matches!(
            timeout(PROBE_TIMEOUT, asked).await,
            Ok(Ok(_) | Err(object_store::Error::NotFound { .. }))
        )
    }

    pub(super) async fn put(&self, draft: &FilePath, folder: &str) -> Result<(), Error> {
        let mut entries = tokio::fs::read_dir(draft).await?;
        while let Some(entry) = entries.next_entry().await? {
            let name = entry.file_name().to_string_lossy().into_owned();
            let path = self.path(&format!("{folder}/{name}"));
            let writer = BufWriter::with_capacity(self.store.clone(), path, PIECE_BYTES);
            let mut writer = writer.with_max_concurrency(2);
            copy(&entry.path(), &mut writer).await?;
        }
        Ok(())
    }

    pub(super) async fn discard(&self, folder: &str) -> Result<(), Error> {
        let objects = self.store.list(Some(&self.path(folder)));
        let paths = objects.map_ok(|object| object.location).boxed();
        let deleted = self.store.delete_stream(paths);
        Ok(deleted.try_for_each(async |_| Ok(())).await?)
    }

    pub(super) async fn discard_file(&self, folder: &str, name: &str) -> Result<(), Error> {
        let path = self.path(&format!("{folder}/{name}"));
        Ok(self.store.delete(&path).await?)
    }

    pub(super) async fn size_bytes(&self, folder: &str, name: &str) -> Result<u64, Error> {
        let path = self.path(&format!("{folder}/{name}"));
        // As in reading, an absent file is `io::ErrorKind::NotFound`.
        let head = self.store.head(&path).await.map_err(io::Error::from)?;
        Ok(head.size)
    }

    pub(super) fn read(
        &self,
        folder: &str,
        name: &str,
        first: u64,
        n_bytes: u64,
    ) -> BoxStream<'static, io::Result<Bytes>> {
        let (store, path) = (self.store.clone(), self.path(&format!("{folder}/{name}")));
        let end = first + n_bytes;
        try_unfold(first, move |at| {
            let (store, path) = (store.clone(), path.clone());
            async move {
                let until = end.min(at + READ_BYTES);
                if at == until {
                    return Ok(None);
                }
                let piece = store.get_range(&path, at..until).await;
                Ok(Some((piece.map_err(io::Error::from)?, until)))
            }
        })
        .boxed()
    }

    /// Returns the mark of these files, if any (`identity`).
    pub(super) async fn mark(&self) -> Result<Option<String>, Error> {
        let found = match self.store.get(&self.path(super::MARK)).await {
            Err(object_store::Error::NotFound { .. }) => return Ok(None),
            found => found?.bytes().await?,
        };
        Ok(Some(String::from_utf8_lossy(&found).trim().to_owned()))
    }

    /// Marks these files permanently (`identity`).
    pub(super) async fn set_mark(&self, mark: &str) -> Result<(), Error> {
        let bytes = Bytes::copy_from_slice(mark.as_bytes());
        self.store
            .put(&self.path(super::MARK), bytes.into())
            .await?;
        Ok(())
    }

    pub(super) async fn folders(&self) -> Result<Vec<Folder>, Error> {
        let prefix = (!self.prefix.is_empty()).then(|| Path::from(self.prefix.as_str()));
        let mut objects = self.store.list(prefix.as_ref());
        let mut folders: BTreeMap<String, Folder> = BTreeMap::new();
        while let Some(object) = objects.try_next().await? {
            let Some(name) = self.folder_of(&object) else {
                continue;
            };
            let modified = SystemTime::from(object.last_modified);
            let folder = folders.entry(name.clone()).or_insert(Folder {
                name,
                modified,
                n_bytes: 0,
            });
            folder.modified = modified.max(folder.modified);
            folder.n_bytes += object.size;
        }
        Ok(folders.into_values().collect())
    }

    /// Returns the folder of an object, `kind/name`. `None` if the object is not one of our files.
    fn folder_of(&self, object: &ObjectMeta) -> Option<String> {
        let path = object.location.as_ref().strip_prefix(&self.prefix)?;
        let (folder, _name) = path.trim_start_matches('/').rsplit_once('/')?;
        let (kind, _) = folder.split_once('/')?;
        let mut kinds = ResourceKind::ALL.iter();
        let is_ours = kind == UPLOADS || kinds.any(|known| known.plural() == kind);
        is_ours.then(|| folder.to_owned())
    }

    fn path(&self, within: &str) -> Path {
        Path::from(format!("{}/{within}", self.prefix))
    }
}

async fn copy(file: &FilePath, writer: &mut BufWriter) -> io::Result<()> {
    let mut reader = BufReader::with_capacity(1 << 20, File::open(file).await?);
    if let Err(error) = tokio::io::copy_buf(&mut reader, writer).await {
        // If `shutdown` fails, it aborts the upload itself.
        writer.abort().await?;
        return Err(error);
    }
    writer.shutdown().await
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn keys_are_read_from_the_default_profile() {
        let keys = Keys::parse(
            "[other]\naws_access_key_id = no\n\n[default]\n# comment\n aws_access_key_id=me \n\
             aws_secret_access_key = a=b/c\n[last]\naws_access_key_id = no\n",
        );
        let (id, secret) = ("me".to_owned(), "a=b/c".to_owned());
        assert!(keys == Some(Keys { id, secret }));
        for lacking in [
            "",
            "aws_access_key_id = a\naws_secret_access_key = b",
            "[default]\naws_access_key_id = a\n[x]\naws_secret_access_key = b",
        ] {
            assert!(Keys::parse(lacking).is_none(), "{lacking}");
        }
        let error = Keys::read(FilePath::new("/dev/null/keys")).err();
        assert!(error.is_some_and(|error| error.to_string().ends_with(": /dev/null/keys")));
    }
}
