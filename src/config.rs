//! All settings of the service: default, command-line flag and environment variable of each.
//! docs/reference/settings.md lists them; `tests/it/tidy` checks that.

use std::net::SocketAddr;
use std::num::NonZeroUsize;
use std::path::{Path, PathBuf};
use std::str::FromStr;

use clap::{Args, ValueEnum};
use reqwest::Url;

/// Settings of the service. Flags override environment variables, which override defaults.
#[derive(Args, Clone, Debug)]
pub struct Config {
    /// Address and port to listen on. An address other than loopback requires authentication.
    #[arg(long, env = "FLOCKREEL_BIND", default_value = "127.0.0.1:8080")]
    pub bind: SocketAddr,
    /// Requests that need a token.
    #[arg(long, env = "FLOCKREEL_AUTH", default_value = "auto")]
    pub auth: Auth,
    /// Locations of the database and the files.
    #[command(flatten)]
    pub storage: Storage,
    /// The workers that run jobs.
    #[command(flatten)]
    pub jobs: JobSettings,
    /// Do not add sample data to an empty data folder.
    #[arg(long, env = "FLOCKREEL_NO_SAMPLE")]
    pub no_sample: bool,
    /// Requests per second allowed to each token owner, with bursts of 4 times as many; 0 sets no limit.
    #[arg(long, env = "FLOCKREEL_RATE", default_value_t = 200, value_name = "N")]
    pub rate: u32,
    /// Requests of one token owner that may be open at once, including event streams; 0 sets no limit.
    #[arg(
        long,
        env = "FLOCKREEL_MAX_OPEN_REQUESTS",
        default_value_t = 256,
        value_name = "N"
    )]
    pub max_open_requests: u32,
    /// Maximum number of jobs of all users that may be queued or running at once.
    #[arg(long, env = "FLOCKREEL_MAX_QUEUED", default_value_t = 10_000, value_name = "N",
        value_parser = clap::value_parser!(i64).range(0..))]
    pub max_queued: i64,
    /// Monitoring.
    #[command(flatten)]
    pub monitoring: Monitoring,
    /// Maximum size of an upload, bytes.
    #[arg(long, env = "FLOCKREEL_MAX_UPLOAD_BYTES", default_value_t = 4 << 30, value_name = "N")]
    pub max_upload_bytes: u64,
    /// Disk space that uploads must leave free, bytes, so that results and deletions still fit.
    #[arg(
        long,
        env = "FLOCKREEL_DISK_RESERVE_BYTES",
        default_value_t = Config::DISK_RESERVE_BYTES,
        value_name = "N"
    )]
    pub disk_reserve_bytes: u64,
    /// Space of each owner.
    #[command(flatten)]
    pub owner_space: OwnerSpace,
    /// Deletion of old data.
    #[command(flatten)]
    pub retention: Retention,
}

/// Limit of the space that each owner may use.
#[derive(Args, Clone, Copy, Debug, Default)]
pub struct OwnerSpace {
    /// Maximum total size of the stored files and open uploads of one owner, bytes; 0 sets no limit.
    #[arg(
        long,
        env = "FLOCKREEL_MAX_OWNER_BYTES",
        default_value_t = OwnerSpace::MAX_OWNER_BYTES,
        value_name = "N"
    )]
    pub max_owner_bytes: u64,
}

/// Ages at which data is deleted.
#[derive(Args, Clone, Copy, Debug, Default)]
pub struct Retention {
    /// Days after which unused footage, libraries, flocks and virtual fish are deleted; 0 keeps them. Pinned
    /// ones are kept, with everything from which a kept one was made.
    #[arg(
        long,
        env = "FLOCKREEL_KEEP_DAYS",
        default_value_t = 0,
        value_name = "N"
    )]
    pub keep_days: u32,
    /// Days after which failed and cancelled jobs are deleted; 0 keeps them. Jobs that are done are deleted with their
    /// results.
    #[arg(
        long,
        env = "FLOCKREEL_KEEP_JOBS_DAYS",
        default_value_t = Retention::KEEP_JOBS_DAYS,
        value_name = "N"
    )]
    pub keep_jobs_days: u32,
}

/// Settings of the media tools, for every command that reads or writes video.
#[derive(Args, Clone, Debug)]
#[command(next_help_heading = "Media tools")]
pub struct MediaTools {
    /// Isolation of ffmpeg, the program that reads and writes videos.
    #[arg(
        long,
        global = true,
        env = "FLOCKREEL_SANDBOX",
        default_value = "auto",
        value_name = "MODE"
    )]
    pub sandbox: SandboxMode,
    /// The ffmpeg program to use instead of the first on the PATH.
    #[arg(long, global = true, env = "FLOCKREEL_FFMPEG", value_name = "FILE")]
    pub ffmpeg: Option<PathBuf>,
    /// The ffprobe program to use instead of the first on the PATH.
    #[arg(long, global = true, env = "FLOCKREEL_FFPROBE", value_name = "FILE")]
    pub ffprobe: Option<PathBuf>,
}

/// How much of the sandbox is required (docs/explanation/promises.md, "Sandbox").
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum SandboxMode {
    /// Only resource limits.
    Off,
    /// All protections that this machine has; missing ones are reported.
    Auto,
    /// All protections; without them no media tool is started.
    Strict,
}

/// Locations of the database and the files.
#[derive(Args, Clone, Debug)]
pub struct Storage {
    /// Local folder for work in progress. It also holds the database and all files, unless --database or
    /// --store names another place.
    #[arg(
        long,
        global = true,
        env = "FLOCKREEL_DATA",
        default_value = "data",
        value_name = "DIR"
    )]
    pub data: PathBuf,
    /// Database, created if absent: sqlite:PATH or postgres://USER:PASSWORD@HOST/NAME. Default: a file in the
    /// data folder.
    #[arg(
        long,
        global = true,
        env = "FLOCKREEL_DATABASE",
        hide_env_values = true,
        value_name = "URL"
    )]
    pub database: Option<Database>,
    /// Stored files: a folder, or s3://BUCKET/PREFIX with the usual AWS_* variables. Default: the data
    /// folder.
    #[arg(long, global = true, env = "FLOCKREEL_STORE", value_name = "DIR|URL")]
    pub store: Option<FileStore>,
}

/// The workers of a process.
#[derive(Args, Clone, Debug)]
pub struct JobSettings {
    /// Number of jobs that run at once. They share the processor cores. With 2 or more, one worker takes only
    /// small jobs, which take less than a minute.
    #[arg(long, env = "FLOCKREEL_WORKERS", default_value_t = default_workers(), value_name = "N")]
    pub workers: NonZeroUsize,
    /// Memory limit of one job, bytes. It does not include ffmpeg, which has a limit of its own. A job that
    /// exceeds it fails with `memory_limit`.
    #[arg(
        long,
        env = "FLOCKREEL_JOB_MEMORY_BYTES",
        default_value_t = JobSettings::JOB_MEMORY_BYTES,
        value_name = "N"
    )]
    pub job_memory_bytes: u64,
    /// Time limit of one job, seconds. A job that exceeds it fails with `time_limit`.
    #[arg(
        long,
        env = "FLOCKREEL_JOB_TIME_S",
        default_value_t = JobSettings::JOB_TIME_S,
        value_name = "N"
    )]
    pub job_time_s: u64,
}

/// Monitoring of a process.
#[derive(Args, Clone, Debug)]
pub struct Monitoring {
    /// Second address, which serves only /metrics and needs no token.
    #[arg(long, env = "FLOCKREEL_METRICS_BIND", value_name = "ADDRESS")]
    pub metrics_bind: Option<SocketAddr>,
    /// Address of a collector of OpenTelemetry, which receives the spans of requests and jobs by OTLP over HTTP, such
    /// as `http://collector:4318`.
    #[arg(long, env = "FLOCKREEL_OTLP_ENDPOINT", value_name = "URL", value_parser = http_address)]
    pub otlp_endpoint: Option<Url>,
}

/// Returns an address if it is one of HTTP.
fn http_address(text: &str) -> Result<Url, String> {
    let url = Url::parse(text).map_err(|error| error.to_string())?;
    let is_http = matches!(url.scheme(), "http" | "https");
    let wrong = || "expected an address such as http://collector:4318".to_owned();
    is_http.then_some(url).ok_or_else(wrong)
}

/// Location of the database.
#[derive(Clone, PartialEq, Eq)]
pub enum Database {
    /// A file, shared by the processes of one machine.
    Sqlite(PathBuf),
    /// A PostgreSQL server, given by its URL, shared by any number of machines.
    Postgres(String),
}

/// Location of the stored files.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum FileStore {
    /// A local folder.
    Folder(PathBuf),
    /// A bucket of an S3-compatible object store.
    Bucket {
        /// Name of the bucket.
        name: String,
        /// Prefix of the names of all our objects in it; may be empty.
        prefix: String,
    },
}

/// Which requests need a token (docs/explanation/promises.md, "Owners are isolated").
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Auth {
    /// All, if the server listens on an address other than loopback; otherwise none.
    Auto,
    /// All.
    Required,
}

impl Config {
    /// Default disk reserve, bytes. Free choice.
    pub const DISK_RESERVE_BYTES: u64 = 1 << 30;

    /// Returns the part of the reserve that jobs leave free, bytes. Uploads leave all of the reserve; results
    /// of jobs may use the rest.
    pub fn job_reserve_bytes(reserve_bytes: u64) -> u64 {
        reserve_bytes / 8
    }

    /// Returns whether requests without a token are refused.
    pub fn requires_tokens(&self) -> bool {
        self.auth == Auth::Required || !self.bind.ip().is_loopback()
    }
}

impl OwnerSpace {
    /// Default limit of an owner, bytes: half of a disk of 64 GiB, so that one owner alone does not fill it.
    pub const MAX_OWNER_BYTES: u64 = 32 << 30;
}

impl Retention {
    /// Default age at which failed and cancelled jobs are deleted, days. Free choice.
    pub const KEEP_JOBS_DAYS: u32 = 90;

    /// Returns the time before which unused resources are deleted, milliseconds since 1970; `None` if they are kept.
    pub fn unused_before_ms(&self, now_ms: i64) -> Option<i64> {
        days_before(self.keep_days, now_ms)
    }

    /// Returns the time before which failed and cancelled jobs are deleted, milliseconds since 1970; `None` if they
    /// are kept.
    pub fn jobs_before_ms(&self, now_ms: i64) -> Option<i64> {
        days_before(self.keep_jobs_days, now_ms)
    }
}

fn days_before(n_days: u32, now_ms: i64) -> Option<i64> {
    (n_days > 0).then(|| now_ms - i64::from(n_days) * 24 * 3600 * 1000)
}

impl JobSettings {
    /// Default time limit of a job, seconds. An hour of footage takes a few hours on a small machine.
    pub const JOB_TIME_S: u64 = 6 * 3600;
    /// Default memory limit of a job, bytes: as much as a media tool may use. The largest flock takes less than half.
    pub const JOB_MEMORY_BYTES: u64 = 4 << 30;
}

/// Returns the number of threads that each of `workers` workers may use, at least 1. The worker for small jobs is
/// mostly idle, so the others share the cores.
pub fn threads_per_worker(workers: NonZeroUsize) -> usize {
    let n_large = (workers.get() - 1).max(1);
    (cores() / n_large).max(1)
}

impl Storage {
    /// Returns the location of the database.
    pub fn database(&self) -> Database {
        let in_folder = || Database::Sqlite(self.data.join("flockreel.db"));
        self.database.clone().unwrap_or_else(in_folder)
    }
}

/// Keeps the database and all files in one folder.
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
        let wrong = || "the database must be sqlite:PATH or postgres://USER:PASSWORD@HOST/NAME";
        match url.split_once(':') {
            Some(("sqlite", path)) => {
                let file = PathBuf::from(path.strip_prefix("//").unwrap_or(path));
                // SQLite would take an empty path for a database that is deleted at the end.
                let is_file = file.file_name().is_some();
                is_file
                    .then_some(Database::Sqlite(file))
                    .ok_or(wrong().into())
            }
            Some(("postgres" | "postgresql", _)) => Ok(Database::Postgres(url.to_owned())),
            _ => Err(wrong().to_owned()),
        }
    }
}

impl FromStr for FileStore {
    type Err = String;

    fn from_str(place: &str) -> Result<FileStore, String> {
        let Some(bucket) = place.strip_prefix("s3://") else {
            let is_url = place.contains("://");
            let wrong = || "the store must be a folder or s3://BUCKET/PREFIX".to_owned();
            return (!is_url)
                .then(|| FileStore::Folder(place.into()))
                .ok_or_else(wrong);
        };
        let (name, prefix) = bucket.split_once('/').unwrap_or((bucket, ""));
        if name.is_empty() {
            Err("the bucket name is missing: use s3://BUCKET/PREFIX".to_owned())
        } else {
            Ok(FileStore::Bucket {
                name: name.to_owned(),
                prefix: prefix.trim_matches('/').to_owned(),
            })
        }
    }
}

/// Hides the URL of a server, which may hold a password.
impl std::fmt::Debug for Database {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Database::Sqlite(path) => write!(f, "sqlite:{}", path.display()),
            Database::Postgres(_) => write!(f, "postgres://..."),
        }
    }
}

/// Returns the default number of workers: one for every two cores, at least 1, and one for small jobs. An analysis
/// keeps two cores busy (decoder and tracking).
pub fn default_workers() -> NonZeroUsize {
    NonZeroUsize::MIN.saturating_add((cores() / 2).max(1))
}

/// Returns the number of cores that this process may use, at least 1.
pub fn cores() -> usize {
    std::thread::available_parallelism().map_or(1, NonZeroUsize::get)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn database_must_name_a_file_or_a_server() {
        let sqlite = |path: &str| Ok(Database::Sqlite(PathBuf::from(path)));
        assert_eq!("sqlite:a/b.db".parse(), sqlite("a/b.db"));
        assert_eq!("sqlite:///a/b.db".parse(), sqlite("/a/b.db"));
        let server = "postgres://h/name".to_owned();
        assert_eq!(server.parse(), Ok(Database::Postgres(server)));
        for wrong in "sqlite: sqlite:// sqlite:/// sqlite:.. mysql://h ".split(' ') {
            let sentence = wrong.parse::<Database>().unwrap_err();
            assert!(sentence.starts_with("the database must be"), "{wrong}");
        }
    }
}
