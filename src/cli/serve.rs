//! `flockreel serve`: API, page and workers in one process (docs/explanation/promises.md, "Graceful stop").

use std::io;
use std::net::SocketAddr;

use tokio::net::{TcpListener, TcpSocket};
use tokio::signal::unix::{SignalKind, signal};

use super::{Error, Summary};
use crate::api::server::Stop;
use crate::api::{self, AppState};
use crate::config::{Auth, Config, Monitoring};
use crate::jobs::clock::now_ms;
use crate::jobs::sample;
use crate::jobs::supervisor::Supervisor;
use crate::logging::say;
use crate::store::Store;

/// Connections that may wait to be accepted. The kernel silently drops the others of a burst, and their clients wait.
/// More than `MAX_CONNECTIONS` of the server; Linux allows no more by default.
const MAX_WAITING_CONNECTIONS: u32 = 4096;

/// Arguments of `serve`.
#[derive(Debug, clap::Args)]
pub struct Args {
    #[command(flatten)]
    config: Config,
}

impl Args {
    /// Returns how the process is monitored.
    pub fn monitoring(&self) -> &Monitoring {
        &self.config.monitoring
    }
}

/// Serves until SIGTERM or SIGINT.
pub fn run(args: Args) -> Result<Option<Summary>, Error> {
    let config = args.config;
    super::check_sandbox()?;
    let runtime = super::runtime()?;
    let served = runtime.block_on(serve(config));
    // A job that does not stop must not keep the process alive. The next start rescues it.
    runtime.shutdown_background();
    served.map(|()| None)
}

async fn serve(config: Config) -> Result<(), Error> {
    let (bind, n_workers) = (config.bind, config.jobs.workers.get());
    let with_sample = !config.no_sample;
    require_token_beyond_loopback(&config).await?;
    let state = AppState::open(config).await?;
    explain_first_token(&state).await?;
    let (listener, address) = listen(bind).await?;
    let metrics = match state.config.monitoring.metrics_bind {
        Some(bind) => Some(listen(bind).await?),
        None => None,
    };
    let context = state.context.clone();
    let supervisor = Supervisor::start(context.clone(), n_workers);
    if with_sample && let Err(error) = sample::fill(&context).await {
        tracing::error!(%error, "the sample could not be queued");
    }
    let stop = Stop::default();
    if let Some((listener, address)) = metrics {
        let router = api::metrics_router(state.clone());
        tokio::spawn(api::server::serve(listener, router, stop.clone()));
        say(&format!(
            "flockreel: the metrics are at http://{address}/metrics"
        ));
    }
    let server = tokio::spawn(api::server::serve(
        listener,
        api::router(state),
        stop.clone(),
    ));
    say(&format!("flockreel: the page is at http://{address}/"));
    wait_for_signal().await?;
    tracing::info!("stopping");
    stop.begun.cancel();
    let drained = async {
        supervisor.drain().await;
        stop.over.cancel();
    };
    let (served, ()) = tokio::join!(server, drained);
    if let Err(error) = served {
        tracing::error!(%error, "the server ended unexpectedly");
    }
    context.store.close().await;
    Ok(())
}

/// Returns a listener and its address. Port 0 in `bind` selects a free port.
pub(super) async fn listen(bind: SocketAddr) -> Result<(TcpListener, SocketAddr), Error> {
    let cannot = |cause| Error::Io {
        what: format!("cannot listen on {bind}"),
        cause,
    };
    let listener = listen_on(bind).map_err(cannot)?;
    let address = listener.local_addr().map_err(cannot)?;
    Ok((listener, address))
}

fn listen_on(bind: SocketAddr) -> io::Result<TcpListener> {
    let socket = match bind {
        SocketAddr::V4(_) => TcpSocket::new_v4()?,
        SocketAddr::V6(_) => TcpSocket::new_v6()?,
    };
    // A service that starts again may listen while connections of the former one end.
    socket.set_reuseaddr(true)?;
    socket.bind(bind)?;
    socket.listen(MAX_WAITING_CONNECTIONS)
}

/// Fails if the service would listen beyond loopback without a valid token in the database, because it would
/// then refuse every request. `--auth required` disables this check.
async fn require_token_beyond_loopback(config: &Config) -> Result<(), Error> {
    if config.bind.ip().is_loopback() || config.auth == Auth::Required {
        return Ok(());
    }
    let store = Store::open(config.storage.clone()).await?;
    let has_tokens = store.has_tokens(now_ms()).await?;
    store.close().await;
    if has_tokens {
        return Ok(());
    }
    Err(Error::Usage(format!(
        "an address beyond loopback needs a token: run `flockreel token create --name NAME`, or bind to 127.0.0.1 \
         instead of: {}",
        config.bind
    )))
}

/// Says how to create a token if the service requires one and nobody has one yet.
async fn explain_first_token(state: &AppState) -> Result<(), Error> {
    if state.config.requires_tokens() && !state.context.store.has_tokens(now_ms()).await? {
        say(
            "flockreel: no token exists, so every request is refused: run `flockreel token create --name NAME`",
        );
    }
    Ok(())
}

/// Waits for SIGTERM or SIGINT.
pub(super) async fn wait_for_signal() -> Result<(), Error> {
    let listen = |kind| signal(kind).map_err(Error::io("waiting for signals"));
    let mut terminate = listen(SignalKind::terminate())?;
    let mut interrupt = listen(SignalKind::interrupt())?;
    tokio::select! {
        _ = terminate.recv() => {}
        _ = interrupt.recv() => {}
    }
    Ok(())
}
