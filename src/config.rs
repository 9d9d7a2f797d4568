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
    /// The largest upload, bytes.
    #[arg(long, env = "FLOCKREEL_MAX_UPLOAD_BYTES", default_value_t = 4 << 30, value_name = "N")]
    pub max_upload_bytes: u64,
    /// Room on the disk that uploads leave free, bytes, so that results and deletions still fit.
    #[arg(
        long,
        env = "FLOCKREEL_DISK_RESERVE_BYTES",
        default_value_t = Config::DISK_RESERVE_BYTES,
        value_name = "N"
    )]
    pub disk_reserve_bytes: u64,
}

/// How media tools are found and enclosed: the same for every command that reads or writes films.
#[derive(Args, Clone, Debug)]
#[command(next_help_heading = "Media tools")]
pub struct Media {
    /// The walls around ffmpeg: `auto` uses all that this machine has, `strict` does nothing unless it has
    /// them all, `off` leaves plain limits alone.
    #[arg(
        long,
        global = true,
        env = "FLOCKREEL_SANDBOX",
        default_value = "auto",
        value_name = "MODE"
    )]
    pub sandbox: Sandbox,
    /// The ffmpeg to use, instead of the first on the PATH.
    #[arg(long, global = true, env = "FLOCKREEL_FFMPEG", value_name = "FILE")]
    pub ffmpeg: Option<PathBuf>,
    /// The ffprobe to use, instead of the first on the PATH.
    #[arg(long, global = true, env = "FLOCKREEL_FFPROBE", value_name = "FILE")]
    pub ffprobe: Option<PathBuf>,
}

/// How much of the sandbox must be there (RELIABILITY.md, the gate).
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Sandbox {
    /// Plain limits alone.
    Off,
    /// What this machine has; what it lacks is said.
    Auto,
    /// All of it, or nothing is started.
    Strict,
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
    /// The usual reserve on the disk.
    pub const DISK_RESERVE_BYTES: u64 = 1 << 30;

    /// Whether a request without a token is refused.
    pub fn demands_tokens(&self) -> bool {
        self.auth == Auth::Required || !self.bind.ip().is_loopback()
    }

    /// Threads that one worker may use, at least 1: the cores divided by the workers.
    pub fn threads_per_worker(&self) -> usize {
        threads_per_worker(self.workers)
    }
}

/// Threads that each of so many workers may use, at least 1.
pub fn threads_per_worker(workers: NonZeroUsize) -> usize {
    (cores() / workers).max(1)
}

/// One worker for every two cores: an analysis keeps two busy (decoder and tracking).
pub fn default_workers() -> NonZeroUsize {
    NonZeroUsize::new(cores() / 2).unwrap_or(NonZeroUsize::MIN)
}

/// Cores that this process may use, at least 1.
pub fn cores() -> usize {
    std::thread::available_parallelism().map_or(1, NonZeroUsize::get)
}
