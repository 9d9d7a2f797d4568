//! `flockreel summary`: prints distance, speeds, rest and turns of films, one row of CSV each.

use std::path::PathBuf;

use serde_json::{Value, json};

use crate::cli::{self, Error, Summary};
use flockreel_core::formats::motion;

/// Arguments of `summary`.
#[derive(Debug, clap::Args)]
pub struct Args {
    /// Folders of libraries, written by `analyze`.
    #[arg(value_name = "LIBRARY_DIR", required = true)]
    libraries: Vec<PathBuf>,
}

/// Prints the summaries: CSV, or one line of JSON.
pub fn run(args: Args, json: bool) -> Result<Option<Summary>, Error> {
    let mut films = Vec::new();
    for folder in &args.libraries {
        let poses = super::read_poses(folder)?;
        films.push((
            folder.display().to_string(),
            poses,
            super::read_scale(folder)?,
        ));
    }
    if json {
        let films = films.iter().map(|(name, poses, scale)| {
            let summary = motion::write_summary_json(poses, *scale);
            let summary: Value = serde_json::from_str(&summary).unwrap_or_default();
            json!({"library": name, "summary": summary})
        });
        return Ok(Some(Summary(films.collect())));
    }
    let films: Vec<_> = (films.iter())
        .map(|(name, poses, scale)| (name.as_str(), poses, *scale))
        .collect();
    let text = motion::write_summary_csv(&films);
    cli::print_lines(&text.lines().map(str::to_owned).collect::<Vec<_>>())?;
    Ok(None)
}
