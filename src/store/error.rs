//! Why the store could not do what was asked (RELIABILITY.md, R7: a full disk is a clean no).

use std::io::ErrorKind;
use std::path::PathBuf;

use sqlx::error::DatabaseError;
use sqlx::sqlite::SqliteError;

use crate::code::Code;

/// SQLITE_FULL, the low byte of its extended codes.
const SQLITE_FULL: u32 = 13;
/// SQLITE_IOERR_SHMSIZE: the index of the write-ahead log cannot grow.
const SQLITE_IOERR_SHMSIZE: u32 = 4874;

/// The reasons, one variant each.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// The database said no.
    #[error("the database failed: {0}")]
    Sql(#[from] sqlx::Error),
    /// The database could not be brought to this version's form.
    #[error("the database could not be migrated: {0}")]
    Migrate(#[from] sqlx::migrate::MigrateError),
    /// A file could not be read or written.
    #[error("a file of the store failed: {0}")]
    Io(#[from] std::io::Error),
    /// The bucket said no, or was not reached.
    #[error("the bucket failed: {0}")]
    Bucket(#[from] object_store::Error),
    /// A file in place is not what was put there.
    #[error("a file of the store has been altered: {0}")]
    Altered(String),
    /// What is done with a file of rows was asked of a server.
    #[error("the rows are on a server: copy them with its own tools")]
    RowsElsewhere,
    /// Another process serves the same folder.
    #[error("the data folder is in use by another flockreel: {}", .0.display())]
    InUse(PathBuf),
    /// The files bear the mark of another database.
    #[error(
        "these files are another database's: name the database and the store that belong together, or an empty \
         place for the files"
    )]
    OtherFiles,
    /// More bytes than an upload may have.
    #[error("the upload is larger than {limit_bytes} bytes")]
    TooLarge {
        /// The limit.
        limit_bytes: u64,
    },
    /// The film that a job made is stored already, under another id.
    #[error("the same film was uploaded while this one was made")]
    FilmIsKnown,
    /// A request that comes again under its ids asks for something else.
    #[error("the request was another one when it came first: {0}")]
    IdInUse(sqlx::types::Uuid),
    /// The owner has as many jobs queued and running as it may.
    #[error("no more than {quota} jobs may be queued or running at once: wait for one to end")]
    QuotaExceeded {
        /// The limit.
        quota: i64,
    },
    /// Everybody together has as many jobs queued and running as there is room for.
    #[error("the queue is full, {room} jobs are under way: ask again when some have ended")]
    QueueFull {
        /// The limit.
        room: i64,
    },
    /// A row holds what this version does not know.
    #[error("a row of {table} cannot be read: {value}")]
    UnknownValue {
        /// The table.
        table: &'static str,
        /// The value.
        value: String,
    },
}

impl Error {
    /// The stable code.
    pub fn code(&self) -> Code {
        match self {
            Error::IdInUse(_) => Code::IdempotencyKeyReused,
            Error::TooLarge { .. } => Code::TooLarge,
            Error::FilmIsKnown => Code::AlreadyStored,
            Error::QuotaExceeded { .. } => Code::QuotaExceeded,
            Error::QueueFull { .. } => Code::QueueFull,
            Error::Io(error) if is_full(error) => Code::StorageFull,
            Error::Sql(sqlx::Error::Io(error)) if is_full(error) => Code::StorageFull,
            Error::Sql(sqlx::Error::Database(error)) if has_no_room(error.as_ref()) => {
                Code::StorageFull
            }
            Error::Sql(_)
            | Error::Migrate(_)
            | Error::Io(_)
            | Error::Bucket(_)
            | Error::Altered(_)
            | Error::InUse(_)
            | Error::OtherFiles
            | Error::RowsElsewhere
            | Error::UnknownValue { .. } => Code::Internal,
        }
    }
}

fn is_full(error: &std::io::Error) -> bool {
    matches!(
        error.kind(),
        ErrorKind::StorageFull | ErrorKind::QuotaExceeded
    )
}

/// Whether the database found no room on its disk; PostgreSQL says `disk_full`.
fn has_no_room(error: &dyn DatabaseError) -> bool {
    let code = error.code().unwrap_or_default();
    match error.try_downcast_ref::<SqliteError>() {
        Some(_) => (code.parse::<u32>())
            .is_ok_and(|code| code & 0xff == SQLITE_FULL || code == SQLITE_IOERR_SHMSIZE),
        None => code == "53100",
    }
}
