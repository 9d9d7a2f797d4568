//! Every setting of the service: its default, its flag, its environment variable
//! (STYLE.md, "a setting"). The README's table follows from this file.

use std::net::SocketAddr;
use std::num::NonZeroUsize;
use std::path::{Path, PathBuf};
use std::str::FromStr;

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
    /// Where rows and files are kept.
    #[command(flatten)]
    pub storage: Storage,
    /// Who runs the jobs.
    #[command(flatten)]
    pub crew: Crew,
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
    /// Who watches.
    #[command(flatten)]
    pub watch: Watch,
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

/// Where rows and files are kept.
#[derive(Args, Clone, Debug)]
pub struct Storage {
    /// The folder of this machine for what is under way; for the database and all files too, unless they are elsewhere.
    #[arg(
        long,
        global = true,
        env = "FLOCKREEL_DATA",
        default_value = "data",
        value_name = "DIR"
    )]
    pub data: PathBuf,
    /// The database, made if absent: sqlite:PATH or postgres://USER:PASSWORD@HOST/NAME; a file in the data folder unless given.
    #[arg(
        long,
        global = true,
        env = "FLOCKREEL_DATABASE",
        hide_env_values = true,
        value_name = "URL"
    )]
    pub database: Option<Database>,
    /// The files: a folder, or s3://BUCKET/PREFIX with the usual AWS_* variables; in the data folder unless given.
    #[arg(long, global = true, env = "FLOCKREEL_STORE", value_name = "DIR|URL")]
    pub store: Option<Files>,
}

/// Who runs the jobs of a process.
#[derive(Args, Clone, Debug)]
pub struct Crew {
    /// How many jobs run at once; the cores are shared among them.
    #[arg(long, env = "FLOCKREEL_WORKERS", default_value_t = default_workers(), value_name = "N")]
    pub workers: NonZeroUsize,
    /// How long one job may take, seconds; then it fails with `time_limit`.
    #[arg(
        long,
        env = "FLOCKREEL_JOB_TIME_S",
        default_value_t = Crew::JOB_TIME_S,
        value_name = "N"
    )]
    pub job_time_s: u64,
}

/// How a process is watched from outside.
#[derive(Args, Clone, Debug)]
pub struct Watch {
    /// Another address, where /metrics alone is answered, to whoever reaches it.
    #[arg(long, env = "FLOCKREEL_METRICS_BIND", value_name = "ADDRESS")]
    pub metrics_bind: Option<SocketAddr>,
}

/// Where the rows are.
#[derive(Clone, PartialEq, Eq)]
pub enum Database {
    /// In a file that the processes of one machine share.
    Sqlite(PathBuf),
    /// On a server that any number of machines share, by its address.
    Postgres(String),
}

/// Where the files are.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Files {
    /// In a folder of this machine.
    Folder(PathBuf),
    /// In a bucket of an S3-compatible store.
    Bucket {
        /// The bucket.
        name: String,
        /// What the names of all our files in it begin with; may be empty.
        prefix: String,
    },
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

    /// What of a reserve jobs leave free, bytes: uploads leave all of it, results may use the rest.
    pub fn least_room_bytes(reserve_bytes: u64) -> u64 {
        reserve_bytes / 8
    }

    /// Whether a request without a token is refused.
    pub fn demands_tokens(&self) -> bool {
        self.auth == Auth::Required || !self.bind.ip().is_loopback()
    }
}

impl Crew {
    /// The usual budget of a job: an hour of footage takes a few hours on a small machine.
    pub const JOB_TIME_S: u64 = 6 * 3600;

    /// Threads that one worker may use, at least 1: the cores divided by the workers.
    pub fn threads_per_worker(&self) -> usize {
        threads_per_worker(self.workers)
    }
}

/// Threads that each of so many workers may use, at least 1.
pub fn threads_per_worker(workers: NonZeroUsize) -> usize {
    (cores() / workers).max(1)
}

impl Storage {
    /// Where the rows are.
    pub fn database(&self) -> Database {
        let in_folder = || Database::Sqlite(self.data.join("flockreel.db"));
        self.database.clone().unwrap_or_else(in_folder)
    }
}

/// All in one folder.
impl<P: AsRef<Path> + ?Sized> From<&P> for Storage {
    fn from(data: &P) -> Storage {
        Storage {
            data: data.as_ref().to_owned(),
            database: None,
            store: None,
        }
    }
}

impl FromStr for Database {
    type Err = String;

    fn from_str(url: &str) -> Result<Database, String> {
        match url.split_once(':') {
            Some(("sqlite", path)) if !path.is_empty() => {
                let path = path.strip_prefix("//").unwrap_or(path);
                Ok(Database::Sqlite(PathBuf::from(path)))
            }
            Some(("postgres" | "postgresql", _)) => Ok(Database::Postgres(url.to_owned())),
            _ => Err("a database is sqlite:PATH or postgres://USER:PASSWORD@HOST/NAME".to_owned()),
        }
    }
}

impl FromStr for Files {
    type Err = String;

    fn from_str(place: &str) -> Result<Files, String> {
        let Some(bucket) = place.strip_prefix("s3://") else {
            let is_url = place.contains("://");
            let wrong = || "a store is a folder or s3://BUCKET/PREFIX".to_owned();
            return (!is_url)
                .then(|| Files::Folder(place.into()))
                .ok_or_else(wrong);
        };
        let (name, prefix) = bucket.split_once('/').unwrap_or((bucket, ""));
        match name.is_empty() {
            true => Err("the bucket has no name: s3://BUCKET/PREFIX".to_owned()),
            false => Ok(Files::Bucket {
                name: name.to_owned(),
                prefix: prefix.trim_matches('/').to_owned(),
            }),
        }
    }
}

/// Without what may be a password.
impl std::fmt::Debug for Database {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Database::Sqlite(path) => write!(f, "sqlite:{}", path.display()),
            Database::Postgres(_) => write!(f, "postgres://..."),
        }
    }
}

/// One worker for every two cores: an analysis keeps two busy (decoder and tracking).
pub fn default_workers() -> NonZeroUsize {
    NonZeroUsize::new(cores() / 2).unwrap_or(NonZeroUsize::MIN)
}

/// Cores that this process may use, at least 1.
pub fn cores() -> usize {
    std::thread::available_parallelism().map_or(1, NonZeroUsize::get)
}
