//! `flockreel attempt`: computes one attempt at a job for a worker (docs/explanation/promises.md, "Poison jobs").
//! People do not call it.

use std::path::PathBuf;

use super::{Error, Summary};
use crate::jobs::attempt;

/// Arguments of `attempt`.
#[derive(Debug, clap::Args)]
pub(super) struct Args {
    /// Empty folder for the files of the attempt.
    folder: PathBuf,
}

/// Runs the attempt. Its result is reported on stdout.
pub(super) fn run(args: Args) -> Result<Option<Summary>, Error> {
    let ran = attempt::run(&args.folder);
    ran.map_err(Error::io("cannot run the attempt"))?;
    Ok(None)
}
