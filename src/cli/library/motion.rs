//! `flockreel motion`: writes place, speed and size in every frame, in centimetres if the library has a scale, or the
//! keypoints of every frame for tools of other labs.

use std::path::PathBuf;

use serde_json::json;

use super::Measured;
use crate::cli::{self, Error, Summary};
use flockreel_core::flock::composite::keypoints;
use flockreel_core::formats::csv::motion::Film;
use flockreel_core::formats::ground_truth::dlc;
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
    /// Write the keypoints of every frame in pixels instead, in the layout of DeepLabCut's predictions (.csv), which
    /// movement and sleap-io read too: head, midline, tail and centroid, with the confidence of the pose.
    #[arg(long)]
    keypoints: bool,
}

/// Writes the motion.
pub fn run(args: Args) -> Result<Option<Summary>, Error> {
    if args.keypoints {
        return write_keypoints(&args);
    }
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

fn write_keypoints(args: &Args) -> Result<Option<Summary>, Error> {
    if cli::extension(&args.output) != "csv" {
        let output = args.output.display();
        return Err(Error::Usage(format!(
            "keypoints are written as .csv: {output}"
        )));
    }
    let library = cli::read_library(&args.library, &args.output)?.library;
    let mut text = Vec::new();
    dlc::write_single(&mut text, keypoints::of_footage(&library))
        .map_err(Error::io("writing keypoints"))?;
    cli::write_file(&args.output, text)?;
    Ok(Some(Summary(json!({
        "output": args.output,
        "frames": library.poses.frames.len(),
    }))))
}
