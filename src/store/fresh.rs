//! Empty stores for tests. By default a test uses its own temporary folder. If `FLOCKREEL_TEST_POSTGRES` or
//! `FLOCKREEL_TEST_BUCKET` names a server or a bucket, the test uses its own database or prefix there
//! (scripts/with-servers.sh).

use std::path::Path;

use sqlx::types::Uuid;

use super::Store;
use crate::config::{Database, Storage};

/// Opens an empty store for a test.
pub(super) async fn open(data: &Path) -> Store {
    Store::open(storage(data)).await.unwrap()
}

/// Returns the location of an empty store for a test.
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
