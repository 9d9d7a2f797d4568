//! `flockreel check`: verifies the invariants I1 to I6 of the data folder (docs/explanation/promises.md),
//! even while a service uses it.
//!
//! Every file is read and hashed. Exit status 0 if all invariants hold, else 1 with one line per fault.

use std::time::Duration;

use serde_json::json;

use super::{Error, Summary, runtime, say_error};
use crate::config::{Database, Storage};
use crate::jobs::clock::now_ms;
use crate::store::check::Fault;
use crate::store::{self, Store};
use flockreel_core::code::Code;

/// Delay before a second check. A fault that is gone by then was an operation in progress. Free choice.
const RECHECK_DELAY: Duration = Duration::from_secs(2);

/// Arguments of `check`.
#[derive(Debug, clap::Args)]
pub struct Args {
    #[command(flatten)]
    storage: Storage,
}

/// Checks the data folder and prints every fault to stderr.
pub fn run(args: Args) -> Result<Option<Summary>, Error> {
    let faults = with_store(args.storage, faults)?;
    for fault in &faults {
        say_error(&format!("flockreel: {fault}"));
    }
    match faults.len() {
        0 => Ok(Some(Summary(json!({"faults": []})))),
        n_faults => Err(Error::Work {
            code: Code::Internal,
            sentence: format!("faults in the data folder: {n_faults}"),
        }),
    }
}

/// Runs `work` on an existing store. Fails if there is none, so a mistyped name does not create one.
pub(super) fn with_store<T>(
    storage: Storage,
    work: impl AsyncFnOnce(&Store) -> Result<T, store::Error>,
) -> Result<T, Error> {
    if let Database::Sqlite(file) = storage.database()
        && !file.is_file()
    {
        let data = storage.data.display();
        return Err(Error::Usage(format!("no data folder: {data}")));
    }
    runtime()?.block_on(async {
        let store = Store::open_beside(storage).await?;
        let result = work(&store).await;
        store.close().await;
        Ok(result?)
    })
}

/// Returns all faults. If other processes may use the store, only faults that persist are returned.
async fn faults(store: &Store) -> Result<Vec<Fault>, store::Error> {
    let mut faults = store.check_after_crash(now_ms()).await?;
    if !faults.is_empty() && !store.is_alone() {
        tokio::time::sleep(RECHECK_DELAY).await;
        let later_faults = store.check_after_crash(now_ms()).await?;
        faults.retain(|fault| later_faults.contains(fault));
    }
    Ok(faults)
}
