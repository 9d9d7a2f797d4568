//! `flockreel summary`: prints distance, speeds, rest, turns and the use of zones of films, one row of CSV each.

use std::path::PathBuf;

use serde_json::{Value, json};

use super::Measured;
use crate::cli::{self, Error, Summary};
use flockreel_core::formats::csv::motion;
use flockreel_core::library::Zones;
use flockreel_core::library::zones::ZonesError;

/// Arguments of `summary`.
#[derive(Debug, clap::Args)]
pub struct Args {
    /// Folders of libraries, written by `analyze`.
    #[arg(value_name = "LIBRARY_DIR", required = true)]
    libraries: Vec<PathBuf>,
    /// Part of the picture, `NAME:rect:X,Y,W,H` or `NAME:ellipse:X,Y,W,H` in pixels, such as `center:ellipse:80,60,160,120`. Adds
    /// the time in it, its share, visits, the first visit and the distance. May be repeated.
    #[arg(long = "zone", value_name = "ZONE")]
    zones: Vec<String>,
}

/// Prints the summaries: CSV, or one line of JSON.
pub fn run(args: Args, json: bool) -> Result<Option<Summary>, Error> {
    let read = args.libraries.iter().map(|folder| {
        let measured = Measured::read(folder)?;
        Ok((folder.display().to_string(), measured))
    });
    let zones: Zones = (args.zones.join(";").parse())
        .map_err(|error: ZonesError| Error::Usage(error.to_string()))?;
    let films: Vec<(String, Measured)> = read.collect::<Result<_, Error>>()?;
    if json {
        let films = films.iter().map(|(name, measured)| {
            let summary = measured.film().summary_json(&zones);
            let summary: Value = serde_json::from_str(&summary).unwrap_or_default();
            json!({"library": name, "summary": summary})
        });
        return Ok(Some(Summary(films.collect())));
    }
    let films: Vec<_> = (films.iter())
        .map(|(name, measured)| (name.as_str(), measured.film()))
        .collect();
    let text = motion::write_summaries(&films, &zones);
    cli::print_lines(&text.lines().map(str::to_owned).collect::<Vec<_>>())?;
    Ok(None)
}
