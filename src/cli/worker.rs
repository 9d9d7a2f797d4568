//! `flockreel worker`: workers without API and page, on any number of machines
//! (docs/explanation/promises.md, "No job is lost", "Stalled workers cannot overwrite" and "Graceful stop").
//!
//! They share a PostgreSQL database and the stored files with a service, and communicate with it only through
//! the queue.

use super::serve::{listen, wait_for_signal};
use super::{Error, Summary};
use crate::api;
use crate::api::server::Stop;
use crate::config::{Config, Database, JobSettings, Monitoring, OwnerSpace, Storage};
use crate::jobs::Context;
use crate::jobs::supervisor::{Supervisor, recover};
use crate::logging::say;
use crate::media;
use crate::store::Store;
use crate::store::space::SpaceLimits;

/// Arguments of `worker`.
#[derive(Debug, clap::Args)]
pub struct Args {
    #[command(flatten)]
    storage: Storage,
    #[command(flatten)]
    jobs: JobSettings,
    #[command(flatten)]
    owner_space: OwnerSpace,
    #[command(flatten)]
    monitoring: Monitoring,
}

impl Args {
    /// Returns how the process is monitored.
    pub fn monitoring(&self) -> &Monitoring {
        &self.monitoring
    }
}

/// Runs jobs until SIGTERM or SIGINT.
pub fn run(args: Args) -> Result<Option<Summary>, Error> {
    let runtime = super::runtime()?;
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
    super::check_sandbox()?;
    media::tool_version()?;
    let n_workers = args.jobs.workers.get();
    let store = Store::open_beside(args.storage).await?;
    let store = store.with_space_limits(SpaceLimits {
        max_owner_bytes: args.owner_space.max_owner_bytes,
        ..SpaceLimits::default()
    });
    let mut context = Context::for_jobs(store, &args.jobs);
    context.min_free_bytes = Config::job_reserve_bytes(Config::DISK_RESERVE_BYTES);
    recover(&context).await?;
    let stop = Stop::default();
    if let Some(bind) = args.monitoring.metrics_bind {
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
