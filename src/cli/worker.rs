//! `flockreel worker`: workers without API and page, on any number of machines
//! (docs/explanation/promises.md, "No job is lost", "Stalled workers cannot overwrite" and "Graceful stop").
//!
//! They share a PostgreSQL database and the stored files with a service, and communicate with it only through
//! the queue.

use std::time::Duration;

use tokio::runtime::Runtime;

use super::serve::{from_store, listen, wait_for_signal};
use super::{Error, Summary};
use crate::api;
use crate::api::server::Stop;
use crate::config::{Config, Crew, Database, Storage, Watch};
use crate::jobs::Context;
use crate::jobs::supervisor::{Supervisor, recover};
use crate::logging::say;
use crate::media;
use crate::store::Store;

/// Arguments of `worker`.
#[derive(Debug, clap::Args)]
pub struct Args {
    #[command(flatten)]
    storage: Storage,
    #[command(flatten)]
    crew: Crew,
    #[command(flatten)]
    watch: Watch,
}

/// Runs jobs until SIGTERM or SIGINT.
pub fn run(args: Args) -> Result<Option<Summary>, Error> {
    let runtime = Runtime::new().map_err(Error::io("starting the threads"))?;
    let worked = runtime.block_on(work(args));
    // A job that does not stop must not keep the process alive. Another worker rescues it.
    runtime.shutdown_background();
    worked.map(|()| None)
}

async fn work(args: Args) -> Result<(), Error> {
    if let Database::Sqlite(file) = args.storage.database() {
        return Err(Error::Usage(format!(
            "a worker needs a shared database: use --database postgres://... instead of: {}",
            file.display()
        )));
    }
    super::check_walls()?;
    media::tool_version().map_err(|error| Error::work(error.code(), &error))?;
    let (n_workers, threads) = (args.crew.workers.get(), args.crew.threads_per_worker());
    let store = Store::open_beside(args.storage).await.map_err(from_store)?;
    let mut context = Context::new(store, threads);
    context.budget = Duration::from_secs(args.crew.job_time_s);
    context.min_free_bytes = Config::least_room_bytes(Config::DISK_RESERVE_BYTES);
    recover(&context).await.map_err(from_store)?;
    let stop = Stop::default();
    if let Some(bind) = args.watch.metrics_bind {
        let (listener, address) = listen(bind).await?;
        let router = api::worker_metrics_router(&context.meters);
        tokio::spawn(api::server::serve(listener, router, stop.clone()));
        say(&format!(
            "flockreel: the metrics are at http://{address}/metrics"
        ));
    }
    let supervisor = Supervisor::start(context.clone(), n_workers);
    say(&format!(
        "flockreel: waiting for jobs, workers: {n_workers}"
    ));
    wait_for_signal().await?;
    tracing::info!("stopping");
    stop.begun.cancel();
    supervisor.drain().await;
    stop.over.cancel();
    context.store.close().await;
    Ok(())
}
