//! The storage of a service under test. It is a temporary folder by default. With the servers of
//! scripts/with-servers.sh, the same tests use PostgreSQL and a bucket.

use std::path::Path;

use clap::Parser;
use flockreel::config::Storage;
use tempfile::TempDir;
use uuid::Uuid;

/// A data folder, and optionally a database and a prefix in a bucket.
pub(crate) struct Place {
    folder: TempDir,
    flags: Vec<String>,
}

#[derive(Parser)]
struct Arguments {
    #[command(flatten)]
    storage: Storage,
}

impl Place {
    /// Returns a place that stores everything in its folder.
    pub(crate) fn local() -> Place {
        Place::on(None, None)
    }

    /// Returns a place on the servers that the environment names; without any, everything is in its folder.
    pub(crate) fn from_environment() -> Place {
        let of = |name: &str| std::env::var(name).ok();
        Place::on(of("FLOCKREEL_TEST_POSTGRES"), of("FLOCKREEL_TEST_BUCKET"))
    }

    /// Returns a place with the database of [`Place::from_environment`], and all files in its folder.
    pub(crate) fn with_files_in_folder() -> Place {
        Place::on(std::env::var("FLOCKREEL_TEST_POSTGRES").ok(), None)
    }

    /// Returns the URL of the database on a server, if it is on one.
    pub(crate) fn database(&self) -> Option<&str> {
        let at = self.flags.iter().position(|flag| flag == "--database")?;
        self.flags.get(at + 1).map(String::as_str)
    }

    /// Returns whether the files are in a bucket.
    pub(crate) fn has_bucket(&self) -> bool {
        self.flags.iter().any(|flag| flag == "--store")
    }

    /// Returns a place on the servers. Panics if the environment does not name both.
    pub(crate) fn shared() -> Place {
        let place = Place::from_environment();
        assert_eq!(place.flags.len(), 4, "run it by scripts/with-servers.sh");
        place
    }

    fn on(postgres: Option<String>, bucket: Option<String>) -> Place {
        let name = format!("test-{}", Uuid::now_v7());
        let flags = [("--database", postgres), ("--store", bucket)];
        let flags = flags.into_iter().filter_map(|(flag, url)| {
            let url = url?;
            Some([flag.to_owned(), format!("{url}/{name}")])
        });
        Place {
            folder: tempfile::tempdir().unwrap(),
            flags: flags.flatten().collect(),
        }
    }

    /// Returns the command-line flags that select this place.
    pub(crate) fn flags(&self) -> Vec<String> {
        let data = self.folder.path().to_str().unwrap().to_owned();
        [vec!["--data".to_owned(), data], self.flags.clone()].concat()
    }

    /// Returns the data folder.
    pub(crate) fn data(&self) -> &Path {
        self.folder.path()
    }

    /// Returns the flags for database and bucket only; empty if all is in the folder.
    pub(crate) fn server_flags(&self) -> Vec<String> {
        self.flags.clone()
    }

    /// Returns the place of a second machine: another data folder, but the same database and bucket.
    pub(crate) fn second_machine(&self) -> Place {
        Place {
            folder: tempfile::tempdir().unwrap(),
            flags: self.flags.clone(),
        }
    }

    /// Returns the storage settings, for use within this process.
    pub(crate) fn storage(&self) -> Storage {
        Place::storage_of(self.flags().iter().map(String::as_str))
    }

    /// Parses command-line flags into storage settings.
    pub(crate) fn storage_of<'a>(flags: impl Iterator<Item = &'a str>) -> Storage {
        Arguments::parse_from(["test"].into_iter().chain(flags)).storage
    }

    /// Returns the number of drafts of all processes, those in use and those left by a crash.
    pub(crate) fn n_drafts(&self) -> usize {
        let of_processes = std::fs::read_dir(self.folder.path().join("tmp")).unwrap();
        of_processes
            .map(|process| entries(&process.unwrap().path()))
            .sum()
    }

    /// Returns the number of files of unfinished uploads.
    pub(crate) fn n_uploads(&self) -> usize {
        entries(&self.folder.path().join("uploads"))
    }
}

fn entries(folder: &Path) -> usize {
    std::fs::read_dir(folder).unwrap().count()
}
