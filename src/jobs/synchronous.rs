//! Computations during a request: a planned flock without its video, a flock as a 3-D model, samples of a data set, all
//! distances of a library as numbers, and its motion in centimetres. They queue no job and store no result. The computation
//! is cancelled if the client disconnects.

use std::fs::File;
use std::io::{BufWriter, Seek, Write};
use std::slice::from_ref;
use std::sync::Arc;
use std::time::{Duration, Instant};

use tokio_util::sync::CancellationToken;
use uuid::Uuid;

use super::{Context, Error};
use crate::store::owners::Owner;
use crate::store::resources::Library;
use crate::store::{Draft, Spill};
use flockreel_core::analysis::similarity::distance::{
    ComparedSprites, DistanceMatrix, Distances, Side,
};
use flockreel_core::cpu::Level;
use flockreel_core::fish;
use flockreel_core::flock::{Flock, Params, plan_flock};
use flockreel_core::formats::library_dir::{self, StoredLibrary};
use flockreel_core::formats::{flock_json, glb, npy};
use flockreel_core::library::Poses;
use flockreel_core::progress::Progress;

/// A planned flock, and the time that each step took.
#[derive(Clone, Debug)]
pub struct Preview {
    /// File of the flock.
    pub file: Vec<u8>,
    /// Time of simulation and planning.
    pub planning: Duration,
    /// Time of writing the file.
    pub writing: Duration,
}

/// Simulates and plans a flock. Its file has the format that `write` makes.
pub async fn preview_flock(
    context: &Context,
    owner: &Owner,
    library: &Library,
    params: Params,
    write: fn(&Flock) -> Vec<u8>,
) -> Result<Preview, Error> {
    let plan = move |stored: Vec<StoredLibrary>, _: &Draft, cancellation: &Cancellation| {
        let start = Instant::now();
        let flock = plan_flock(&stored[0].library, &params, cancellation)?;
        let planning = start.elapsed();
        let file = write(&flock);
        let writing = start.elapsed() - planning;
        Ok(Preview {
            file,
            planning,
            writing,
        })
    };
    compute(context, owner, from_ref(library), plan).await
}

/// Computes the distances between all clips of a library. Returns an unnamed file with the `distance.npy`.
pub async fn distance_file(
    context: &Context,
    owner: &Owner,
    library: &Library,
) -> Result<File, Error> {
    let write = |stored: Vec<StoredLibrary>, draft: &Draft, cancellation: &Cancellation| {
        let StoredLibrary {
            library, params, ..
        } = &stored[0];
        npy::check(library.sprites.n_frames())?;
        let planes = params.planes;
        let pixels = ComparedSprites::new(&library.sprites, &library.poses, planes);
        let pixels = pixels.map_err(flockreel_core::analysis::Error::Full)?;
        let distances = Distances {
            pixels: &pixels,
            clip: params.clip(library.clip_frames),
            side: Side::Plain,
            cpu: Level::detect(),
        };
        let matrix = DistanceMatrix::compute(&distances, cancellation);
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
    compute(context, owner, from_ref(library), write).await
}

/// Makes the school of a flock: a GLB file with a virtual animal for each individual.
pub async fn school(
    context: &Context,
    owner: &Owner,
    library: &Library,
    flock_folder: &str,
    params: fish::Params,
) -> Result<Vec<u8>, Error> {
    let files = context.store.fetch(flock_folder, &[FLOCK]).await?;
    let write = move |stored: Vec<StoredLibrary>, _: &Draft, _: &Cancellation| {
        let library = &stored[0].library;
        let flock = flock_json::read(&std::fs::read(files.path().join(FLOCK))?);
        let flock = flock.map_err(std::io::Error::from)?;
        if !flock.fits(library) {
            let why = "the stored flock does not fit its library";
            return Err(std::io::Error::other(why).into());
        }
        let film = fish::Film::of(library, &params)?;
        Ok(glb::write_school(&flock, library.poses.view, &film))
    };
    compute(context, owner, from_ref(library), write).await
}

/// File with the data of a flock.
const FLOCK: &str = "flock.json";

/// Computes a text from the poses of a library.
pub async fn from_poses(
    context: &Context,
    owner: &Owner,
    library: &Library,
    write: impl FnOnce(&Poses) -> String + Send + 'static,
) -> Result<String, Error> {
    let permit = context.synchronous_work.acquire(owner).await?;
    let files = context.store.fetch(&library.folder, &[library_dir::POSES]);
    let files = files.await?;
    run_until_dropped(move |_cancellation| {
        let _permit = permit;
        Ok(write(&library_dir::read_poses(files.path())?))
    })
    .await
}

/// Runs a computation on libraries, at least one, for the owner of a request. Waits for the owner's turn; fails with
/// [`Error::Busy`] if it does not come in time.
pub(super) async fn compute<Output: Send + 'static>(
    context: &Context,
    owner: &Owner,
    libraries: &[Library],
    work: impl FnOnce(Vec<StoredLibrary>, &Draft, &Cancellation) -> Result<Output, Error>
    + Send
    + 'static,
) -> Result<Output, Error> {
    let permit = context.synchronous_work.acquire(owner).await?;
    let store = &context.store;
    let mut folders = Vec::new();
    for library in libraries {
        folders.push(store.fetch(&library.folder, &library_dir::FILES).await?);
    }
    let draft = store
        .blobs()
        .draft(&format!("synchronous.{}", Uuid::now_v7()))?;
    let threads = context.threads;
    run_until_dropped(move |cancellation| {
        let _permit = permit;
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
        pool.map_err(std::io::Error::other)?.install(|| {
            let scratch = Arc::new(Spill::into(draft.path()));
            let stored = (folders.iter())
                .map(|files| library_dir::read(files.path(), scratch.clone()))
                .collect::<Result<Vec<_>, _>>()?;
            work(stored, &draft, cancellation)
        })
    })
    .await
}

/// Runs `work` on a blocking thread. A blocking thread cannot be stopped, so dropping the future sets the
/// cancellation that `work` has to look at.
async fn run_until_dropped<Output: Send + 'static>(
    work: impl FnOnce(&Cancellation) -> Result<Output, Error> + Send + 'static,
) -> Result<Output, Error> {
    let cancellation = Cancellation(CancellationToken::new());
    let _cancel_on_drop = cancellation.0.clone().drop_guard();
    let output = tokio::task::spawn_blocking(move || work(&cancellation));
    output.await.unwrap_or(Err(Error::Panicked))
}

/// Cancellation of a computation when its request is dropped. Progress is not reported.
pub(super) struct Cancellation(CancellationToken);

impl Progress for Cancellation {
    fn report(&self, _: &'static str, _: f64) {}

    fn cancelled(&self) -> bool {
        self.0.is_cancelled()
    }
}

#[cfg(test)]
mod tests {
    use std::sync::mpsc;

    use super::*;

    #[tokio::test(flavor = "multi_thread")]
    async fn dropped_request_stops_its_computation() {
        let (sender, receiver) = mpsc::channel();
        let request = tokio::spawn(run_until_dropped(move |cancellation| {
            sender.send("begun").unwrap();
            let begun = Instant::now();
            while !cancellation.cancelled() && begun.elapsed() < Duration::from_secs(20) {
                std::thread::sleep(Duration::from_millis(1));
            }
            sender.send("ended").unwrap();
            Ok(())
        }));
        let next = || receiver.recv_timeout(Duration::from_secs(10));
        assert_eq!(next(), Ok("begun"));
        request.abort();
        assert_eq!(next(), Ok("ended"));
    }
}
