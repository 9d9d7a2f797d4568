//! An empty store for a test, on what the tests run on: a folder of its own, or a database and a prefix of its
//! own, on the server and in the bucket that `FLOCKREEL_TEST_POSTGRES` and `FLOCKREEL_TEST_BUCKET` name
//! (scripts/with-servers.sh).

use std::path::Path;

use sqlx::types::Uuid;

use super::Store;
use crate::config::{Database, Storage};

/// Opens it.
pub(super) async fn open(data: &Path) -> Store {
    Store::open(storage(data)).await.unwrap()
}

/// Where it is.
pub(super) fn storage(data: &Path) -> Storage {
    let name = format!("test-{}", Uuid::now_v7());
    let of = |server: &str| std::env::var(server).ok();
    Storage {
        database: of("FLOCKREEL_TEST_POSTGRES")
            .map(|url| Database::Postgres(format!("{url}/{name}"))),
        store: of("FLOCKREEL_TEST_BUCKET").map(|url| format!("{url}/{name}").parse().unwrap()),
        ..Storage::from(data)
    }
}
