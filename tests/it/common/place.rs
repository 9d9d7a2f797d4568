//! Where a service under test keeps its things. By itself a test program keeps them in folders; beside the
//! servers of scripts/with-servers.sh the same tests run on PostgreSQL and a bucket.

use std::path::Path;

use clap::Parser;
use flockreel::config::Storage;
use tempfile::TempDir;
use uuid::Uuid;

/// A folder of its own, and perhaps a database and a prefix in a bucket.
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
    /// All in the folder.
    pub(crate) fn local() -> Place {
        Place::on(None, None)
    }

    /// On what the tests are to run on.
    pub(crate) fn of_tests() -> Place {
        let of = |name: &str| std::env::var(name).ok();
        Place::on(of("FLOCKREEL_TEST_POSTGRES"), of("FLOCKREEL_TEST_BUCKET"))
    }

    /// On the servers, which must be there.
    pub(crate) fn shared() -> Place {
        let place = Place::of_tests();
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

    /// The flags that say so to a process.
    pub(crate) fn flags(&self) -> Vec<String> {
        let data = self.folder.path().to_str().unwrap().to_owned();
        [vec!["--data".to_owned(), data], self.flags.clone()].concat()
    }

    /// The data folder.
    pub(crate) fn data(&self) -> &Path {
        self.folder.path()
    }

    /// The flags that say what is not in the folder.
    pub(crate) fn elsewhere_flags(&self) -> Vec<String> {
        self.flags.clone()
    }

    /// The same for a process on another machine: a folder of its own, with the same rows and files.
    pub(crate) fn elsewhere(&self) -> Place {
        Place {
            folder: tempfile::tempdir().unwrap(),
            flags: self.flags.clone(),
        }
    }

    /// The same for this process.
    pub(crate) fn storage(&self) -> Storage {
        Place::storage_of(self.flags().iter().map(String::as_str))
    }

    /// What such flags say.
    pub(crate) fn storage_of<'a>(flags: impl Iterator<Item = &'a str>) -> Storage {
        Arguments::parse_from(["test"].into_iter().chain(flags)).storage
    }

    /// What processes are making, or left half made.
    pub(crate) fn n_drafts(&self) -> usize {
        let of_processes = std::fs::read_dir(self.folder.path().join("tmp")).unwrap();
        of_processes
            .map(|process| entries(&process.unwrap().path()))
            .sum()
    }

    /// Files of unfinished uploads.
    pub(crate) fn n_uploads(&self) -> usize {
        entries(&self.folder.path().join("uploads"))
    }
}

fn entries(folder: &Path) -> usize {
    std::fs::read_dir(folder).unwrap().count()
}
