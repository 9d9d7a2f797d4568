//! Admission: received files become a footage, or are refused with a stable code and leave nothing behind
//! (docs/explanation/promises.md, "Bad input" and "No upload is lost"). Every upload takes this path.

use std::fs;
use std::io::ErrorKind;
use std::path::Path;

use uuid::Uuid;

use super::attempt::Film;
use super::clock::now_ms;
use super::masks::Masks;
use super::views::poster;
use super::{Context, Error, attempt};
use crate::media::{Limits, ReadOptions, Video, read_image};
use crate::store::footage::{Added, BACKGROUND, Footage, MASKS, POSTER, VIDEO};
use crate::store::owners::Owner;
use crate::store::space::Counted;
use crate::store::{BlobFile, Draft, Store};
use flockreel_core::analysis;
use flockreel_core::footage::FrameSource;

/// Files received into a draft, synced and hashed, with their label and owner.
pub struct ReceivedFiles {
    /// The draft that holds the files.
    pub draft: Draft,
    /// The video.
    pub video: BlobFile,
    /// The given background, if any.
    pub background: Option<BlobFile>,
    /// The given masks, if any.
    pub masks: Option<BlobFile>,
    /// Label given by the sender.
    pub name: String,
    /// Owner of the footage.
    pub owner: Owner,
    /// How the files count against the space of their owner until they are stored.
    pub counted: Counted,
}

/// Checks the files and stores them. Returns the existing footage if the owner has already stored the same
/// files. Waits for a permit of `upload_checks`; fails with [`Error::Busy`] if none becomes free.
pub async fn admit(context: &Context, received: ReceivedFiles) -> Result<Added, Error> {
    let permit = context.upload_checks.acquire(&received.owner).await?;
    let format = attempt::inspect(context, &received.draft).await?;
    drop(permit);
    let store = context.store.clone();
    let (received, sealed) = tokio::task::spawn_blocking(move || {
        let sealed = sealed_poster(&store, &received.draft)?;
        Ok::<_, Error>((received, sealed))
    })
    .await
    .unwrap_or(Err(Error::Panicked))?;
    let mut footage = footage_row(&received, &format);
    let mut files = vec![received.video];
    files.extend(received.background);
    files.extend(received.masks);
    files.extend(sealed);
    footage.size_bytes = files.iter().map(|file| file.size_bytes).sum();
    let store = &context.store;
    let upload = received.counted.upload();
    let added = store.add_footage(footage, received.draft, &files, upload);
    Ok(added.await?)
}

/// Checks the files in a folder without decoding the whole video, and writes its poster. Returns the format of the
/// video. It parses foreign files, so it runs in a child process.
pub(super) fn inspect(folder: &Path) -> Result<Film, Error> {
    // A sender does not wait long for the poster.
    let limits = Limits {
        stall_time: poster::MAX_POSTER_TIME,
        ..Limits::default()
    };
    let path = folder.join(VIDEO);
    let video = Video::open(&path, &limits)?;
    let format = video.format();
    let masks = folder.join(MASKS);
    if masks.exists() {
        let options = ReadOptions::default();
        if let Some(masks) = Masks::open(&video, &path, Some(&masks), &limits, &options)? {
            masks.over(&video)?;
        }
    }
    let background = folder.join(BACKGROUND);
    if background.exists() {
        let image = read_image(&background, &limits)?;
        let (found, wanted) = ([image.width, image.height], [format.width, format.height]);
        if found != wanted {
            return Err(analysis::Error::BackgroundSizeDiffers { found, wanted }.into());
        }
    }
    // Footage that cannot be decoded has no poster: the analysis tells the reason.
    if let Err(error) = poster::write_poster(&video, folder) {
        tracing::info!(%error, "a footage has no poster");
        fs::remove_file(folder.join(POSTER)).ok();
    }
    Ok(Film {
        width: format.width,
        height: format.height,
        fps: format.fps,
        n_frames: format.n_frames_hint,
    })
}

/// Syncs the poster in the draft, if there is one.
fn sealed_poster(store: &Store, draft: &Draft) -> Result<Option<BlobFile>, Error> {
    match store.blobs().seal_one(draft, POSTER) {
        Err(error) if error.kind() == ErrorKind::NotFound => Ok(None),
        sealed => Ok(Some(sealed?)),
    }
}

/// Returns the row of the footage, without the size of its files.
fn footage_row(received: &ReceivedFiles, format: &Film) -> Footage {
    let background = received.background.as_ref();
    let sha256 = |file: Option<&BlobFile>| file.map_or(Vec::new(), |file| file.sha256.clone());
    let masks = received.masks.as_ref();
    let now_ms = now_ms();
    Footage {
        id: Uuid::now_v7(),
        owner: received.owner.clone(),
        folder: String::new(),
        sha256: received.video.sha256.clone(),
        background_sha256: sha256(background),
        masks_sha256: sha256(masks),
        name: received.name.clone(),
        size_bytes: 0,
        width: i64::from(format.width),
        height: i64::from(format.height),
        fps: format.fps,
        n_frames_hint: i64::try_from(format.n_frames).unwrap_or(i64::MAX),
        sample: false,
        pinned: false,
        used_ms: now_ms,
        created_ms: now_ms,
    }
}

#[cfg(test)]
mod tests {
    use std::time::Duration;

    use super::*;
    use crate::jobs::ConcurrencyLimit;

    #[tokio::test]
    async fn an_upload_is_refused_as_busy_if_no_check_can_start() {
        let data = tempfile::tempdir().unwrap();
        let store = crate::store::Store::open(data.path()).await.unwrap();
        let draft = store.blobs().draft("film").unwrap();
        let video = BlobFile {
            name: VIDEO.to_owned(),
            size_bytes: 0,
            sha256: Vec::new(),
        };
        let mut context = Context::new(store, 1);
        context.upload_checks = ConcurrencyLimit::new(0, 1, Duration::from_millis(20));
        let received = ReceivedFiles {
            draft,
            video,
            background: None,
            masks: None,
            name: String::new(),
            owner: Owner::local(),
            counted: Counted::Upload(Uuid::nil()),
        };
        let refused = admit(&context, received).await.unwrap_err();
        assert_eq!(refused.code(), flockreel_core::code::Code::Busy);
    }
}
