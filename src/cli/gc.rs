//! `flockreel gc`: removes data that nothing refers to, and data that is older than the settings allow
//! (docs/explanation/promises.md, "No orphans" and "Limited space").
//!
//! The service does this at its start and from time to time. The command does it at once, or only reports
//! what it would remove (`--dry-run`).

use std::time::SystemTime;

use serde_json::json;

use super::check::with_store;
use super::{Error, Summary};
use crate::config::{Retention, Storage};
use crate::jobs::clock::now_ms;

/// Arguments of `gc`.
#[derive(Debug, clap::Args)]
pub struct Args {
    #[command(flatten)]
    storage: Storage,
    #[command(flatten)]
    retention: Retention,
    /// Print what would be removed, and remove nothing.
    #[arg(long)]
    dry_run: bool,
}

/// Removes unused data, unless `--dry-run` is set, and prints its counts.
pub fn run(args: Args, json: bool) -> Result<Option<Summary>, Error> {
    let waste = with_store(args.storage, async |store| {
        if args.dry_run {
            store
                .waste(args.retention, SystemTime::now(), now_ms())
                .await
        } else {
            store
                .collect_waste(args.retention, SystemTime::now(), now_ms())
                .await
        }
    })?;
    let counts = [
        ("drafts", waste.n_drafts as u64),
        ("folders", waste.n_folders as u64),
        ("uploads", waste.n_uploads as u64),
        ("rows", waste.n_rows as u64),
        ("unused", waste.n_unused as u64),
        ("jobs", waste.n_jobs as u64),
        ("bytes", waste.n_bytes),
    ];
    if !json {
        super::print_lines(&counts.map(|(name, count)| format!("{name}: {count}")))?;
    }
    let mut value = json!({"dry_run": args.dry_run});
    for (name, count) in counts {
        value[name] = json!(count);
    }
    Ok(Some(Summary(value)))
}
