//! `flockreel motion`: writes place, speed and size in every frame, in centimetres if the library has a scale.

use std::path::PathBuf;

use serde_json::json;

use super::Measured;
use crate::cli::{self, Error, Summary};
use flockreel_core::formats::csv::motion::Film;
use flockreel_core::library::Scale;

/// Arguments of `motion`.
#[derive(Debug, clap::Args)]
pub struct Args {
    /// Folder of the library, written by `analyze`.
    #[arg(value_name = "LIBRARY_DIR")]
    library: PathBuf,
    /// File to write: .csv or .json.
    #[arg(short, long, value_name = "FILE")]
    output: PathBuf,
}

/// Writes the motion.
pub fn run(args: Args) -> Result<Option<Summary>, Error> {
    let write = match cli::extension(&args.output).as_str() {
        "csv" => Film::motion_csv,
        "json" => Film::motion_json,
        _ => {
            let output = args.output.display();
            let sentence = format!("the output must end in .csv or .json: {output}");
            return Err(Error::Usage(sentence));
        }
    };
    let measured = Measured::read(&args.library)?;
    cli::write_file(&args.output, write(measured.film()))?;
    Ok(Some(Summary(json!({
        "output": args.output,
        "frames": measured.poses.frames.len(),
        "px_per_cm": measured.scale.map(Scale::px_per_cm),
    }))))
}
