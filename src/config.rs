//! Every setting of the service: its default, its flag, its environment variable
//! (STYLE.md, "a setting"). The README's table follows from this file.

use std::net::SocketAddr;
use std::num::NonZeroUsize;
use std::path::PathBuf;

use clap::{Args, ValueEnum};

/// How the service runs. Flags win over environment variables, those over defaults.
#[derive(Args, Clone, Debug)]
pub struct Config {
    /// Where to listen. Off loopback the service needs authentication.
    #[arg(long, env = "FLOCKREEL_BIND", default_value = "127.0.0.1:8080")]
    pub bind: SocketAddr,
    /// Who needs a token: `auto` demands one off loopback, `required` from everybody.
    #[arg(long, env = "FLOCKREEL_AUTH", default_value = "auto")]
    pub auth: Auth,
    /// The folder that holds the database and all files.
    #[arg(
        long,
        env = "FLOCKREEL_DATA",
        default_value = "data",
        value_name = "DIR"
    )]
    pub data: PathBuf,
    /// How many jobs run at once; the cores are shared among them.
    #[arg(long, env = "FLOCKREEL_WORKERS", default_value_t = default_workers(), value_name = "N")]
    pub workers: NonZeroUsize,
    /// Do not fill an empty data folder with a sample.
    #[arg(long, env = "FLOCKREEL_NO_SAMPLE")]
    pub no_sample: bool,
    /// Requests a second that each owner of a token may make, four seconds' at once; 0 for any number.
    #[arg(long, env = "FLOCKREEL_RATE", default_value_t = 200, value_name = "N")]
    pub rate: u32,
    /// How many jobs of everybody may be queued or running at once.
    #[arg(long, env = "FLOCKREEL_MAX_QUEUED", default_value_t = 10_000, value_name = "N",
        value_parser = clap::value_parser!(i64).range(0..))]
    pub max_queued: i64,
    /// Another address, where /metrics alone is answered, to whoever reaches it.
    #[arg(long, env = "FLOCKREEL_METRICS_BIND", value_name = "ADDRESS")]
    pub metrics_bind: Option<SocketAddr>,
    /// The largest upload, bytes.
    #[arg(long, env = "FLOCKREEL_MAX_UPLOAD_BYTES", default_value_t = 4 << 30, value_name = "N")]
    pub max_upload_bytes: u64,
}

/// Who needs a token (RELIABILITY.md, S6).
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Auth {
    /// Whoever comes from beyond this machine.
    Auto,
    /// Everybody.
    Required,
}

impl Config {
    /// Whether a request without a token is refused.
    pub fn demands_tokens(&self) -> bool {
        self.auth == Auth::Required || !self.bind.ip().is_loopback()
    }

    /// Threads that one worker may use, at least 1: the cores divided by the workers.
    pub fn threads_per_worker(&self) -> usize {
        (cores() / self.workers).max(1)
    }
}

/// One worker for every two cores: an analysis keeps two busy (decoder and tracking).
fn default_workers() -> NonZeroUsize {
    NonZeroUsize::new(cores() / 2).unwrap_or(NonZeroUsize::MIN)
}

fn cores() -> usize {
    std::thread::available_parallelism().map_or(1, NonZeroUsize::get)
}
