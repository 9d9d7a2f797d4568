//! Computations during a request: a planned flock without its video, and all distances of a library as
//! numbers. They queue no job and store no result. The computation is cancelled if the client disconnects.

use std::fs::File;
use std::io::{BufWriter, Seek, Write};
use std::sync::Arc;

use tokio_util::sync::CancellationToken;
use uuid::Uuid;

use super::{Context, Error};
use crate::analysis::similarity::distance::{ComparedSprites, DistanceMatrix, Distances, Side};
use crate::cpu::Level;
use crate::flock::{Params, plan_flock};
use crate::formats::library_dir::{self, StoredLibrary};
use crate::formats::{flock_json, npy};
use crate::progress::Progress;
use crate::store::{Draft, Spill, libraries::Library};

/// Simulates and plans a flock. Returns its `flock.json`.
pub async fn flock(context: &Context, library: &Library, params: Params) -> Result<Vec<u8>, Error> {
    let plan = move |stored: StoredLibrary, _: &Draft, waiting: &Waiting| {
        let flock = plan_flock(&stored.library, &params, waiting)?;
        Ok(flock_json::write(&flock))
    };
    compute(context, library, plan).await
}

/// Computes the distances between all clips of a library. Returns an unnamed file with the `distance.npy`.
pub async fn distances(context: &Context, library: &Library) -> Result<File, Error> {
    let write = |stored: StoredLibrary, draft: &Draft, waiting: &Waiting| {
        let library = stored.library;
        npy::check(library.sprites.n_frames())?;
        let planes = stored.params.planes;
        let pixels = ComparedSprites::new(&library.sprites, &library.poses, planes);
        let pixels = pixels.map_err(crate::analysis::Error::Full)?;
        let distances = Distances {
            pixels: &pixels,
            clip: stored.params.clip(library.clip_frames),
            side: Side::Plain,
            cpu: Level::detect(),
        };
        let matrix = DistanceMatrix::compute(&distances, waiting);
        let Ok(matrix) = matrix else {
            return Err(Error::Cancelled);
        };
        let mut file = BufWriter::new(tempfile::tempfile_in(draft.path())?);
        npy::write(&matrix, &mut file)?;
        file.flush()?;
        file.rewind()?;
        Ok(file
            .into_inner()
            .map_err(std::io::IntoInnerError::into_error)?)
    };
    compute(context, library, write).await
}

/// Runs a computation on a library. Waits for a permit; fails with [`Error::Busy`] if none becomes free.
async fn compute<Made: Send + 'static>(
    context: &Context,
    library: &Library,
    work: impl FnOnce(StoredLibrary, &Draft, &Waiting) -> Result<Made, Error> + Send + 'static,
) -> Result<Made, Error> {
    let place = context.at_once.take().await?;
    let store = &context.store;
    let files = store.fetch(&library.folder, &library_dir::FILES).await?;
    let draft = store
        .blobs()
        .draft(&format!("at-once.{}", Uuid::now_v7()))?;
    let waiting = Waiting(CancellationToken::new());
    let _gone = waiting.0.clone().drop_guard();
    let threads = context.threads;
    let made = tokio::task::spawn_blocking(move || {
        let _place = place;
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
        pool.map_err(std::io::Error::other)?.install(|| {
            let stored = library_dir::read(files.path(), Arc::new(Spill::into(draft.path())))?;
            work(stored, &draft, &waiting)
        })
    });
    made.await.unwrap_or(Err(Error::Panicked))
}

/// Progress of a computation during a request. It is cancelled when the request is dropped.
struct Waiting(CancellationToken);

impl Progress for Waiting {
    fn report(&self, _: &'static str, _: f64) {}

    fn cancelled(&self) -> bool {
        self.0.is_cancelled()
    }
}
