//! `flockreel backup DIR`: copies the data folder, even while a service uses it
//! (docs/explanation/promises.md, "Restore and upgrade"). To restore, run `flockreel serve --data DIR`.

use std::path::PathBuf;

use serde_json::json;

use super::check::with_store;
use super::{Error, Summary, say};
use crate::config::{Database, Storage};

/// Arguments of `backup`.
#[derive(Debug, clap::Args)]
pub struct Args {
    /// Folder for the copy. It must not exist yet.
    #[arg(value_name = "DIR")]
    target: PathBuf,
    #[command(flatten)]
    storage: Storage,
}

/// Copies the data folder. An interrupted copy remains as `DIR.partial`. Fails for a PostgreSQL
/// database, which is copied with its own tools.
pub fn run(args: Args) -> Result<Option<Summary>, Error> {
    if args.target.file_name().is_none() || args.target.exists() {
        let sentence = format!(
            "the backup folder must not exist: {}",
            args.target.display()
        );
        return Err(Error::Usage(sentence));
    }
    if let Database::Postgres(_) = args.storage.database() {
        let sentence = "backup needs a SQLite database: copy a database on a server with its own tools (pg_dump), \
                        then the stored files";
        return Err(Error::Usage(sentence.to_owned()));
    }
    let copied = with_store(args.storage, async |store| {
        store.back_up(&args.target).await
    })?;
    say(&format!("flockreel: files copied: {}", copied.n_files));
    let (n_files, n_bytes) = (copied.n_files, copied.n_bytes);
    Ok(Some(Summary(json!({"files": n_files, "bytes": n_bytes}))))
}
