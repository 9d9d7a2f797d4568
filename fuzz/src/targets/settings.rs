//! Settings: the file of `--config`, `--set`, the hints of `analyze`, and the places of database and files.

use std::str::FromStr;

use flockreel::cli::{config_file, set};
use flockreel::config::{Database, FileStore};
use flockreel::store::tokens::secret::Presented;
use flockreel_core::formats::params;
use flockreel_core::{analysis, fish, flock};
use serde_json::Map;
use sqlx::postgres::PgConnectOptions;

/// A settings file, or lines of one flag each: `database URL`, `store URL`, `set NAME=JSON`, `animal-at TEXT`,
/// `ignore TEXT`, `token TEXT`.
pub(super) fn settings(bytes: &[u8]) {
    let Ok(text) = std::str::from_utf8(bytes) else {
        return;
    };
    config_file::settings_of_text(text).ok();
    let mut overrides = Map::new();
    for line in text.lines() {
        let (flag, value) = line.split_once(' ').unwrap_or((line, ""));
        match flag {
            "database" => database(value),
            "store" => store(value),
            "set" => drop(set::apply(&[value.to_owned()], &mut overrides)),
            "animal-at" => drop(flockreel::cli::analyze::read_animal_at(value)),
            "ignore" => drop(flockreel::cli::analyze::read_ignore(value)),
            "token" => drop(Presented::parse(value)),
            _ => {}
        }
    }
    params::read::<analysis::Params>(overrides.clone()).ok();
    params::read::<flock::Params>(overrides.clone()).ok();
    params::read::<fish::Params>(overrides).ok();
}

fn database(url: &str) {
    match Database::from_str(url) {
        Ok(Database::Postgres(url)) => drop(PgConnectOptions::from_str(&url)),
        Ok(Database::Sqlite(file)) => assert!(file.file_name().is_some(), "no file name: {url:?}"),
        Err(_) => {}
    }
}

fn store(place: &str) {
    if let Ok(FileStore::Bucket { name, .. }) = FileStore::from_str(place) {
        assert!(!name.is_empty(), "no bucket: {place:?}");
    }
}
