//! Errors of the store. A full disk has its own stable code (docs/explanation/promises.md, "Full disk").

use std::io::{self, ErrorKind};
use std::path::{Path, PathBuf};

use sqlx::error::DatabaseError;
use sqlx::sqlite::SqliteError;

use flockreel_core::code::Code;

/// SQLite's result code SQLITE_FULL: the low byte of its extended codes.
const SQLITE_FULL: u32 = 13;
/// SQLite's extended result code SQLITE_IOERR_SHMSIZE: the index of the write-ahead log cannot grow.
const SQLITE_IOERR_SHMSIZE: u32 = 4874;

/// Error codes of PostgreSQL while it starts or stops, or has too many connections.
const BUSY_SERVER: [&str; 4] = ["57P01", "57P02", "57P03", "53300"];

/// Reasons why an operation of the store failed.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// The database returned an error.
    #[error("the database returned an error: {0}")]
    Sql(#[from] sqlx::Error),
    /// The database could not be migrated to this version's schema.
    #[error("the database could not be migrated: {0}")]
    Migrate(#[from] sqlx::migrate::MigrateError),
    /// A file could not be read or written.
    #[error("a file of the store could not be read or written: {0}")]
    Io(#[from] std::io::Error),
    /// A folder or file that a setting names cannot be opened or created.
    #[error("the file or folder cannot be used: {cause}: {}", path.display())]
    Unusable {
        /// The folder or file.
        path: PathBuf,
        /// The reason.
        cause: io::Error,
    },
    /// The database server does not answer, or does not accept connections.
    #[error("the database at {place} cannot be reached: {cause}")]
    Unreachable {
        /// Host and port, or the path of the socket.
        place: String,
        /// The last reason.
        cause: String,
    },
    /// The bucket returned an error or was not reached.
    #[error("the bucket returned an error or cannot be reached: {0}")]
    Bucket(#[from] object_store::Error),
    /// The content of a stored file differs from its recorded size or hash.
    #[error("the size or hash of a stored file has changed: {0}")]
    CorruptFile(String),
    /// The operation needs a SQLite file, but the database is on a server.
    #[error("the database is on a server: copy it with the server's own tools")]
    DatabaseOnServer,
    /// Another process serves the same data folder.
    #[error("the data folder is in use by another flockreel: {}", .0.display())]
    InUse(PathBuf),
    /// The files are marked as belonging to another database.
    #[error(
        "the store belongs to another database: use the matching `--database` and `--store`, or an empty store"
    )]
    ForeignFiles,
    /// The upload exceeds its maximum size.
    #[error("the upload is larger than {limit_bytes} bytes")]
    TooLarge {
        /// The maximum, bytes.
        limit_bytes: u64,
    },
    /// Another request, perhaps at another instance of the service, has added bytes to the upload or ended it.
    #[error(
        "another request has changed the upload: read its offset with HEAD, and continue from there"
    )]
    UploadChanged,
    /// The video that a sample job made is already stored under another id.
    #[error("the same film was stored by an upload while this job ran")]
    AlreadyStored,
    /// A repeated request has the ids of an earlier one but different content.
    #[error("the Idempotency-Key belongs to an earlier request with another body, job {0}")]
    IdInUse(sqlx::types::Uuid),
    /// The owner has reached the maximum number of queued and running jobs.
    #[error("the quota of {quota} queued and running jobs is reached: wait until one ends")]
    QuotaExceeded {
        /// The maximum per owner.
        quota: i64,
    },
    /// The files and open uploads of an owner would exceed their maximum size.
    #[error(
        "{n_bytes} bytes do not fit: the owner uses {used_bytes} of at most {max_bytes} bytes; delete films or flocks that \
         are no longer needed (`GET /v1/usage` shows what takes the space)"
    )]
    OwnerStorageFull {
        /// Stored and announced bytes.
        used_bytes: u64,
        /// Bytes that do not fit.
        n_bytes: u64,
        /// The maximum per owner, bytes.
        max_bytes: u64,
    },
    /// The owner has begun too many resumable uploads.
    #[error(
        "{max_uploads} resumable uploads are open, the most that an owner may have: finish or cancel one"
    )]
    TooManyUploads {
        /// The maximum per owner.
        max_uploads: i64,
    },
    /// The queue has reached the maximum number of queued and running jobs of all owners.
    #[error(
        "the queue is full ({max_queued} queued and running jobs): try again when some have ended"
    )]
    QueueFull {
        /// The maximum of the queue.
        max_queued: i64,
    },
    /// A row contains a value that this version does not know.
    #[error("a row of {table} has a value that this version does not know: {value}")]
    UnknownValue {
        /// Name of the table.
        table: &'static str,
        /// The unknown value.
        value: String,
    },
}

impl Error {
    /// Returns a function for `map_err` that names the folder or file of an I/O error.
    pub(super) fn at(path: &Path) -> impl Fn(io::Error) -> Error {
        move |cause| Error::Unusable {
            path: path.to_owned(),
            cause,
        }
    }

    /// Returns whether the database server does not answer or accepts no connections at the moment.
    pub fn is_unreachable(&self) -> bool {
        matches!(self, Error::Sql(error) if is_cured_by_waiting(error))
    }

    /// Returns the stable code.
    pub fn code(&self) -> Code {
        match self {
            Error::IdInUse(_) => Code::IdempotencyKeyReused,
            Error::TooLarge { .. } => Code::TooLarge,
            Error::UploadChanged => Code::OffsetDiffers,
            Error::AlreadyStored => Code::AlreadyStored,
            Error::QuotaExceeded { .. } => Code::QuotaExceeded,
            Error::QueueFull { .. } => Code::QueueFull,
            Error::OwnerStorageFull { .. } | Error::TooManyUploads { .. } => Code::OwnerStorageFull,
            Error::Io(error) | Error::Unusable { cause: error, .. } if is_disk_full(error) => {
                Code::StorageFull
            }
            Error::Sql(sqlx::Error::Io(error)) if is_disk_full(error) => Code::StorageFull,
            Error::Sql(sqlx::Error::Database(error)) if is_database_full(error.as_ref()) => {
                Code::StorageFull
            }
            Error::Sql(_)
            | Error::Migrate(_)
            | Error::Io(_)
            | Error::Unusable { .. }
            | Error::Unreachable { .. }
            | Error::Bucket(_)
            | Error::CorruptFile(_)
            | Error::InUse(_)
            | Error::ForeignFiles
            | Error::DatabaseOnServer
            | Error::UnknownValue { .. } => Code::Internal,
        }
    }
}

/// Returns whether a database server that starts, stops or has too many connections may cause the error.
pub(in crate::store) fn is_cured_by_waiting(error: &sqlx::Error) -> bool {
    match error {
        sqlx::Error::Io(error) => !is_disk_full(error),
        sqlx::Error::PoolTimedOut => true,
        sqlx::Error::Database(error) => {
            BUSY_SERVER.contains(&error.code().as_deref().unwrap_or_default())
        }
        _ => false,
    }
}

fn is_disk_full(error: &std::io::Error) -> bool {
    matches!(
        error.kind(),
        ErrorKind::StorageFull | ErrorKind::QuotaExceeded
    )
}

/// Returns whether the database's disk is full. PostgreSQL reports this as `disk_full` (53100).
fn is_database_full(error: &dyn DatabaseError) -> bool {
    let code = error.code().unwrap_or_default();
    match error.try_downcast_ref::<SqliteError>() {
        Some(_) => (code.parse::<u32>())
            .is_ok_and(|code| code & 0xff == SQLITE_FULL || code == SQLITE_IOERR_SHMSIZE),
        None => code == "53100",
    }
}
