//! `flockreel check`: verifies the invariants I1 to I6 of the data folder (docs/explanation/promises.md),
//! even while a service uses it.
//!
//! Every file is read and hashed. Exit status 0 if all invariants hold, else 1 with one line per fault.

use std::time::Duration;

use serde_json::json;
use tokio::runtime::Runtime;

use super::serve::from_store;
use super::{Error, Summary, say};
use crate::code::Code;
use crate::config::{Database, Storage};
use crate::jobs::clock::now_ms;
use crate::store::check::Fault;
use crate::store::{self, Store};

/// Delay before a second check. A fault that is gone by then was an operation in progress. Free choice.
const MOMENT: Duration = Duration::from_secs(2);

/// Arguments of `check`.
#[derive(Debug, clap::Args)]
pub struct Args {
    #[command(flatten)]
    storage: Storage,
}

/// Checks the data folder and prints every fault to stderr.
pub fn run(args: Args) -> Result<Option<Summary>, Error> {
    let runtime = Runtime::new().map_err(Error::io("starting the threads"))?;
    let faults = runtime.block_on(async {
        let store = existing(args.storage).await?;
        let faults = faults(&store).await.map_err(from_store);
        store.close().await;
        faults
    })?;
    for fault in &faults {
        say(&format!("flockreel: {fault}"));
    }
    match faults.len() {
        0 => Ok(Some(Summary(json!({"faults": []})))),
        n_faults => Err(Error::Work {
            code: Code::Internal,
            sentence: format!("faults in the data folder: {n_faults}"),
        }),
    }
}

/// Opens an existing store. Fails if there is none, so a mistyped name does not create one.
pub(super) async fn existing(storage: Storage) -> Result<Store, Error> {
    if let Database::Sqlite(file) = storage.database()
        && !file.is_file()
    {
        let data = storage.data.display();
        return Err(Error::Usage(format!("no data folder: {data}")));
    }
    Store::open_beside(storage).await.map_err(from_store)
}

/// Returns all faults. If other processes may use the store, only faults that persist are returned.
async fn faults(store: &Store) -> Result<Vec<Fault>, store::Error> {
    let mut faults = store.check_after_crash(now_ms()).await?;
    if !faults.is_empty() && !store.is_alone() {
        tokio::time::sleep(MOMENT).await;
        let still = store.check_after_crash(now_ms()).await?;
        faults.retain(|fault| still.contains(fault));
    }
    Ok(faults)
}
