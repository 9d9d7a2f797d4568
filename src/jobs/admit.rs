//! Admission: received files become a footage, or are refused with a stable code and leave nothing behind
//! (docs/explanation/promises.md, "Bad input" and "No upload is lost"). Every upload takes this path.

use uuid::Uuid;

use super::clock::now_ms;
use super::masks::Masks;
use super::{Context, Error};
use crate::footage::{FootageFormat, FrameSource};
use crate::media::{Limits, ReadOptions, Video, read_image};
use crate::store::footage::{Added, BACKGROUND, Footage, MASKS, VIDEO};
use crate::store::owners::Owner;
use crate::store::{BlobFile, Draft};

/// Files received into a draft, synced and hashed, with their label and owner.
pub struct Arrival {
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
}

/// Checks the files and stores them. Returns the existing footage if the owner has already stored the same
/// files. Waits for a permit of `places`; fails with [`Error::Busy`] if none becomes free.
pub async fn admit(context: &Context, arrival: Arrival) -> Result<Added, Error> {
    let place = context.places.take().await?;
    let (arrival, format) = tokio::task::spawn_blocking(move || {
        let _place = place;
        let format = inspect(&arrival)?;
        Ok::<_, Error>((arrival, format))
    })
    .await
    .unwrap_or(Err(Error::Panicked))?;
    let footage = row(&arrival, &format);
    let mut files = vec![arrival.video];
    files.extend(arrival.background);
    files.extend(arrival.masks);
    let store = &context.store;
    Ok(store.add_footage(footage, arrival.draft, &files).await?)
}

/// Checks the files without decoding the video. Returns the properties of the video.
fn inspect(arrival: &Arrival) -> Result<FootageFormat, Error> {
    let limits = Limits::default();
    let path = arrival.draft.path().join(VIDEO);
    let video = Video::open(&path, &limits)?;
    let format = video.format();
    if arrival.masks.is_some() {
        let given = arrival.draft.path().join(MASKS);
        let given = (&*path, Some(&*given));
        if let Some(masks) = Masks::open(&video, given, &limits, &ReadOptions::default())? {
            masks.over(&video)?;
        }
    }
    if arrival.background.is_some() {
        let image = read_image(&arrival.draft.path().join(BACKGROUND), &limits)?;
        let (found, wanted) = ([image.width, image.height], [format.width, format.height]);
        if found != wanted {
            return Err(crate::analysis::Error::BackgroundSizeDiffers { found, wanted }.into());
        }
    }
    Ok(format)
}

fn row(arrival: &Arrival, format: &FootageFormat) -> Footage {
    let background = arrival.background.as_ref();
    let size_bytes = |file: Option<&BlobFile>| file.map_or(0, |file| file.size_bytes);
    let sha256 = |file: Option<&BlobFile>| file.map_or(Vec::new(), |file| file.sha256.clone());
    let masks = arrival.masks.as_ref();
    Footage {
        id: Uuid::now_v7(),
        owner: arrival.owner.clone(),
        folder: String::new(),
        sha256: arrival.video.sha256.clone(),
        background_sha256: sha256(background),
        masks_sha256: sha256(masks),
        name: arrival.name.clone(),
        size_bytes: arrival.video.size_bytes + size_bytes(background) + size_bytes(masks),
        width: i64::from(format.width),
        height: i64::from(format.height),
        fps: format.fps,
        n_frames_hint: i64::try_from(format.n_frames_hint).unwrap_or(i64::MAX),
        sample: false,
        created_ms: now_ms(),
    }
}

#[cfg(test)]
mod tests {
    use std::time::Duration;

    use super::*;
    use crate::jobs::places::Places;

    #[tokio::test]
    async fn a_film_waits_for_a_place_before_anybody_looks_at_it() {
        let data = tempfile::tempdir().unwrap();
        let store = crate::store::Store::open(data.path()).await.unwrap();
        let draft = store.blobs().draft("film").unwrap();
        let video = BlobFile {
            name: VIDEO.to_owned(),
            size_bytes: 0,
            sha256: Vec::new(),
        };
        let mut context = Context::new(store, 1);
        context.places = Places::new(0, Duration::from_millis(20));
        let arrival = Arrival {
            draft,
            video,
            background: None,
            masks: None,
            name: String::new(),
            owner: Owner::local(),
        };
        let refused = admit(&context, arrival).await.unwrap_err();
        assert_eq!(refused.code(), crate::code::Code::Busy);
    }
}
