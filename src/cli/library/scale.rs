//! `flockreel scale`: sets the scale of a library, or takes it away. Nothing is measured again.

use std::path::PathBuf;

use serde_json::json;

use super::Measured;
use crate::cli::set::finite;
use crate::cli::{Error, Summary};
use flockreel_core::formats::library_dir;
use flockreel_core::library::Scale;

/// Arguments of `scale`.
#[derive(Debug, clap::Args)]
pub struct Args {
    /// Folder of the library, written by `analyze`. The scale is stored in it as scale.json.
    #[arg(value_name = "LIBRARY_DIR")]
    library: PathBuf,
    #[command(flatten)]
    given: Given,
}

/// The scale, in one of three ways.
#[derive(Debug, clap::Args)]
#[group(required = true, multiple = false)]
struct Given {
    /// Pixels per centimetre of the floor (seen from above) or of the plane in which the animal moves (seen from the
    /// side), 0.001 to 1000000.
    #[arg(long, value_name = "N", value_parser = finite)]
    px_per_cm: Option<f64>,
    /// Length of the animal from nose to tail tip, centimetres.
    #[arg(long, value_name = "CM", value_parser = finite)]
    length_cm: Option<f64>,
    /// Take the scale away.
    #[arg(long)]
    none: bool,
}

/// Writes or removes the scale.
pub fn run(args: Args) -> Result<Option<Summary>, Error> {
    let measured = Measured::read(&args.library)?;
    let length_px = measured.film().length_px;
    let scale = match (args.given.px_per_cm, args.given.length_cm) {
        (Some(px_per_cm), _) => Some(Scale::new(px_per_cm)),
        (None, Some(length_cm)) => Some(Scale::from_length(length_cm, length_px)),
        (None, None) => None,
    };
    let scale = scale.transpose();
    let scale = scale.map_err(|error| Error::Usage(error.to_string()))?;
    library_dir::write_scale(&args.library, scale).map_err(|error| {
        let folder = args.library.display();
        Error::Usage(format!("cannot write the scale: {folder}: {error}"))
    })?;
    let length_cm = scale.zip(length_px);
    Ok(Some(Summary(json!({
        "px_per_cm": scale.map(Scale::px_per_cm),
        "length_cm": length_cm.map(|(scale, length_px)| scale.cm(length_px)),
    }))))
}
