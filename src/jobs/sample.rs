//! The first film of an empty data folder: the virtual fish, filmed, admitted as any upload is, and
//! queued for its analysis and its flock, so that a first visit shows the result. Marked as sample.

use std::path::Path;

use sha2::{Digest, Sha256};
use uuid::Uuid;

use super::admit::{Arrival, admit};
use super::{Context, Error, analysis, flock};
use crate::fish::sample::{SampleFilm, SampleParams};
use crate::footage::FrameSource;
use crate::ids::FootageId;
use crate::media::VideoWriter;
use crate::raster::Frame;
use crate::store::footage::{Added, VIDEO};
use crate::store::owners::{Account, Owner, Reach};
use crate::store::{BlobFile, Draft};

/// Long enough for transitions in every direction.
const N_FRAMES: usize = 1200;

/// Fills an empty store; a store that has any footage is left alone. A process that dies on the way
/// leaves the store empty, and the next start begins again.
pub async fn fill(context: &Context) -> Result<(), Error> {
    if !context
        .store
        .list_footage(1, None, &Reach::All)
        .await?
        .is_empty()
    {
        return Ok(());
    }
    tracing::info!("filming the sample");
    let draft = context.store.blobs().draft(&Uuid::now_v7().to_string())?;
    let stop = context.draining.clone();
    let filmed = tokio::task::spawn_blocking(move || film(draft, || stop.is_cancelled()));
    let arrival = filmed.await.unwrap_or(Err(Error::Panicked))?;
    let (Added::New(footage) | Added::Known(footage)) = admit(context, arrival).await?;
    let measure = analysis::Input {
        footage_id: FootageId(footage.id),
        params: crate::analysis::Params::default(),
    };
    let (job_id, library_id) = analysis::enqueue(context, &measure, &Account::local()).await?;
    let make = flock::Input {
        library_id,
        params: crate::flock::Params::default(),
    };
    flock::enqueue(context, &make, Some(job_id), &Account::local()).await?;
    Ok(())
}

fn film(draft: Draft, stopped: impl Fn() -> bool) -> Result<Arrival, Error> {
    let params = SampleParams {
        n_frames: N_FRAMES,
        ..SampleParams::default()
    };
    let path = draft.path().join(VIDEO);
    // The writer names its container by the file's ending.
    let written = path.with_extension("mp4");
    write(&SampleFilm::new(params)?, &written, stopped)?;
    std::fs::rename(&written, &path)?;
    Ok(Arrival {
        video: described(&path)?,
        background: None,
        name: "sample.mp4".to_owned(),
        sample: true,
        owner: Owner::local(),
        draft,
    })
}

fn write(film: &SampleFilm, path: &Path, stopped: impl Fn() -> bool) -> Result<(), Error> {
    let mut writer = VideoWriter::create(path, &film.format().into())?;
    let mut stream = film.open()?;
    let mut frame = Frame::default();
    while stream.next_frame(&mut frame)?.is_some() {
        if stopped() {
            return Err(Error::Cancelled);
        }
        writer.write(&frame)?;
    }
    Ok(writer.finish()?)
}

fn described(path: &Path) -> Result<BlobFile, Error> {
    let bytes = std::fs::read(path)?;
    std::fs::File::open(path)?.sync_all()?;
    Ok(BlobFile {
        name: VIDEO.to_owned(),
        size_bytes: bytes.len() as i64,
        sha256: Sha256::digest(&bytes).to_vec(),
    })
}
