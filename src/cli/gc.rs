//! `flockreel gc`: removes data that nothing refers to (docs/explanation/promises.md, "No orphans").
//!
//! The service does this at its start and from time to time. The command does it at once, or only reports
//! what it would remove (`--dry-run`).

use std::io::Write;
use std::time::SystemTime;

use serde_json::json;
use tokio::runtime::Runtime;

use super::check::existing;
use super::serve::from_store;
use super::{Error, Summary};
use crate::config::Storage;
use crate::jobs::clock::now_ms;

/// Arguments of `gc`.
#[derive(Debug, clap::Args)]
pub struct Args {
    #[command(flatten)]
    storage: Storage,
    /// Print what would be removed, and remove nothing.
    #[arg(long)]
    dry_run: bool,
}

/// Removes unused data, unless `--dry-run` is set, and prints its counts.
pub fn run(args: Args, json: bool) -> Result<Option<Summary>, Error> {
    let runtime = Runtime::new().map_err(Error::io("starting the threads"))?;
    let waste = runtime.block_on(async {
        let store = existing(args.storage).await?;
        let waste = match args.dry_run {
            true => store.waste(SystemTime::now(), now_ms()).await,
            false => store.collect_waste(SystemTime::now(), now_ms()).await,
        };
        store.close().await;
        waste.map_err(from_store)
    })?;
    let counts = [
        ("drafts", waste.n_drafts as u64),
        ("folders", waste.n_folders as u64),
        ("uploads", waste.n_uploads as u64),
        ("rows", waste.n_rows as u64),
        ("bytes", waste.n_bytes),
    ];
    if !json {
        let lines = counts.map(|(name, count)| format!("{name}: {count}\n"));
        let written = std::io::stdout().write_all(lines.concat().as_bytes());
        written.map_err(Error::io("writing to stdout"))?;
    }
    let mut value = json!({"dry_run": args.dry_run});
    for (name, count) in counts {
        value[name] = json!(count);
    }
    Ok(Some(Summary(value)))
}
