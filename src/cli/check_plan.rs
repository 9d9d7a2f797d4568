//! `flockreel check-plan LIBRARY_DIR FLOCK_JSON`: checks that a stored plan is valid and optimal
//! (docs/explanation/algorithms.md, "Planning"). Exit status 0 if it is, else 2 with the first violation.

use std::path::PathBuf;

use serde_json::json;

use super::{Error, Listener, Summary};
use flockreel_core::flock::check::check;
use flockreel_core::formats::flock_json;

/// Arguments of `check-plan`.
#[derive(Debug, clap::Args)]
pub struct Args {
    /// Folder of the library, written by `analyze`.
    #[arg(value_name = "LIBRARY_DIR")]
    library: PathBuf,
    /// Plan of the flock, written by `flock --plan`.
    #[arg(value_name = "FLOCK_JSON")]
    plan: PathBuf,
}

/// Checks the plan.
pub fn run(args: Args) -> Result<Option<Summary>, Error> {
    let library = super::read_library(&args.library, &args.plan)?.library;
    let bytes = std::fs::read(&args.plan)
        .map_err(|cause| Error::Usage(format!("cannot read {}: {cause}", args.plan.display())))?;
    let flock = flock_json::read(&bytes).map_err(|cause| {
        Error::Usage(format!(
            "not a flock.json: {}: {cause}",
            args.plan.display()
        ))
    })?;
    let n_jumps = check(&library, &flock, &Listener::new())
        .map_err(|violation| Error::Usage(violation.to_string()))?;
    let n_individuals = flock.individuals.len();
    let n_frames = n_individuals * flock.params.frames as usize;
    super::say(&format!(
        "the plan is valid: {n_individuals} individuals, {n_frames} frames, {n_jumps} jumps; no individual has a \
         cheaper plan"
    ));
    Ok(Some(Summary(json!({
        "plan": args.plan,
        "individuals": n_individuals,
        "frames": n_frames,
        "jumps": n_jumps,
    }))))
}
