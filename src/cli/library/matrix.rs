//! `flockreel matrix`: writes the distances between the clips of a library, as numbers or as a picture
//! (docs/explanation/algorithms.md, "Distances").

use std::fs::File;
use std::io::{BufWriter, Write};
use std::path::{Path, PathBuf};

use crate::cli::{self, Error, Listener, Summary};
use flockreel_core::analysis::similarity::distance::{
    Cancelled, ComparedSprites, DistanceMatrix, Distances, Side,
};
use flockreel_core::code::Code;
use flockreel_core::cpu::Level;
use flockreel_core::formats::distance_map::DistanceMap;
use flockreel_core::formats::npy;

/// Arguments of `matrix`.
#[derive(Debug, clap::Args)]
pub struct Args {
    /// Folder of the library, written by `analyze`.
    #[arg(value_name = "LIBRARY_DIR")]
    library: PathBuf,
    /// File to write: .npy for numbers (NumPy, at most 8192 frames), .png for a picture.
    #[arg(short, long, value_name = "FILE")]
    output: PathBuf,
    /// Compare each clip with the mirror image of each clip.
    #[arg(long)]
    mirrored: bool,
    /// Draw the pairs of similar clips (distance below epsilon) and the transitions among them. Needs .png.
    #[arg(long)]
    candidates: bool,
}

/// Writes the distance matrix. Fails for numbers of more than 8192 frames.
pub fn run(args: Args) -> Result<Option<Summary>, Error> {
    let format = Format::from_extension(&args.output)?;
    if args.candidates && matches!(format, Format::Numbers) {
        return Err(Error::Usage(format!(
            "with --candidates the output must end in .png: {}",
            args.output.display()
        )));
    }
    let stored = cli::read_library(&args.library, &args.output)?;
    let library = stored.library;
    let pixels = ComparedSprites::new(&library.sprites, &library.poses, stored.params.planes)
        .map_err(|error| Error::work(error.code(), &error))?;
    let distances = Distances {
        pixels: &pixels,
        clip: stored.params.clip(library.clip_frames),
        side: if args.mirrored {
            Side::Mirrored
        } else {
            Side::Plain
        },
        cpu: Level::detect(),
    };
    match format {
        Format::Numbers => write_numbers(&distances, &args.output)?,
        Format::Picture => {
            let map =
                DistanceMap::compute(&distances, &library, &Listener::new()).map_err(cancelled)?;
            let png = if args.candidates {
                map.draw_candidates(&library)
            } else {
                map.draw_distances()
            };
            cli::write_file(&args.output, png)?;
        }
    }
    Ok(Some(Summary(serde_json::json!({
        "output": args.output,
        "clips": distances.n_clips(),
        "clip_frames": library.clip_frames,
        "mirrored": args.mirrored,
    }))))
}

enum Format {
    Numbers,
    Picture,
}

impl Format {
    fn from_extension(path: &Path) -> Result<Format, Error> {
        match path.extension().and_then(|extension| extension.to_str()) {
            Some("npy") => Ok(Format::Numbers),
            Some("png") => Ok(Format::Picture),
            _ => Err(Error::Usage(format!(
                "the output must end in .npy or .png: {}",
                path.display()
            ))),
        }
    }
}

fn write_numbers(distances: &Distances<'_>, path: &Path) -> Result<(), Error> {
    npy::check(distances.pixels.n_frames()).map_err(|error| Error::work(error.code(), &error))?;
    let matrix = DistanceMatrix::compute(distances, &Listener::new()).map_err(cancelled)?;
    let write = || {
        let mut file = BufWriter::new(File::create(path)?);
        npy::write(&matrix, &mut file)?;
        file.flush()
    };
    write().map_err(Error::io(format!("cannot write {}", path.display())))
}

fn cancelled(_: Cancelled) -> Error {
    Error::Work {
        code: Code::Cancelled,
        sentence: "the command was cancelled".into(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn extension_selects_numbers_or_picture() {
        assert!(matches!(
            Format::from_extension(Path::new("a/d.npy")),
            Ok(Format::Numbers)
        ));
        assert!(matches!(
            Format::from_extension(Path::new("d.png")),
            Ok(Format::Picture)
        ));
        let error = Format::from_extension(Path::new("d.jpg"))
            .err()
            .expect("no such kind");
        assert_eq!(error.exit_code(), 2);
    }
}
