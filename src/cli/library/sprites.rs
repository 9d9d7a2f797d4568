//! `flockreel sprites LIBRARY_DIR -o DIR`: writes the sprite of every frame as a PNG with straight alpha.

use std::path::PathBuf;

use rayon::prelude::*;
use serde_json::json;

use crate::cli::{self, Error, Summary};
use flockreel_core::formats::{picture, picture_archive};

/// Arguments of `sprites`.
#[derive(Debug, clap::Args)]
pub struct Args {
    /// Folder of the library, written by `analyze`.
    library: PathBuf,
    /// Folder for the pictures 000000.png and so on, named by frame. Frames without the animal have none.
    #[arg(short, long, value_name = "DIR")]
    output: PathBuf,
}

/// Writes the sprites.
pub fn run(args: Args) -> Result<Option<Summary>, Error> {
    let stored = cli::read_library(&args.library, &args.output)?;
    let sprites = &stored.library.sprites;
    let folder = &args.output;
    std::fs::create_dir_all(folder)
        .map_err(Error::io(format!("cannot make {}", folder.display())))?;
    let present: Vec<usize> = (0..sprites.n_frames())
        .filter(|&idx| sprites.is_present(idx))
        .collect();
    present.par_iter().try_for_each(|&idx| {
        let path = folder.join(picture_archive::frame_name(idx));
        let bytes = picture::write_rgba(sprites.width(), sprites.height(), &sprites.sprite(idx));
        cli::write_file(&path, bytes)
    })?;
    Ok(Some(Summary(json!({
        "sprites": present.len(),
        "size_px": [sprites.width(), sprites.height()],
    }))))
}
