//! A library as a folder: library.json, poses.json, background.png, and sprites.zip, whose entries
//! 000000.png ... are straight-alpha RGBA of one size, stored, so that any tool opens them. A frame
//! without the animal has no entry.
//!
//! The only file of ring 2 that touches the file system.

use std::fs;
use std::io::{self, Cursor, Read, Write};
use std::path::Path;

use rayon::prelude::*;
use zip::write::SimpleFileOptions;

use super::library_json::{self, FootageSummary};
use super::{picture, poses_json};
use crate::analysis::Params;
use crate::library::{Library, Sprites};

/// Why a folder is not a library.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// A file is missing or cannot be read or written.
    #[error("{file}: {cause}")]
    Io {
        /// Which file of the folder.
        file: &'static str,
        /// What the system said.
        cause: io::Error,
    },
    /// A JSON file does not hold what it should.
    #[error("{file}: {cause}")]
    Json {
        /// Which file of the folder.
        file: &'static str,
        /// Where and why.
        cause: serde_json::Error,
    },
    /// A picture is not what it should be.
    #[error("{file}: {cause}")]
    Picture {
        /// Which file of the folder.
        file: &'static str,
        /// What was found.
        cause: picture::Error,
    },
    /// sprites.zip is damaged.
    #[error("sprites.zip: {0}")]
    Zip(#[from] zip::result::ZipError),
    /// The files do not belong together.
    #[error("the files do not belong together: {0}")]
    Mismatch(&'static str),
}

/// A library as it was read, with what made it.
pub struct StoredLibrary {
    /// The library.
    pub library: Library,
    /// The parameters of its analysis.
    pub params: Params,
    /// The footage it came from.
    pub footage: FootageSummary,
}

const LIBRARY: &str = "library.json";
const POSES: &str = "poses.json";
const BACKGROUND: &str = "background.png";
const SPRITES: &str = "sprites.zip";

/// Writes a library into a folder, which is made if need be.
pub fn write(
    dir: &Path,
    library: &Library,
    params: &Params,
    footage: &FootageSummary,
) -> Result<(), Error> {
    fs::create_dir_all(dir).map_err(|cause| Error::Io { file: ".", cause })?;
    let put = |file: &'static str, bytes: &[u8]| {
        fs::write(dir.join(file), bytes).map_err(|cause| Error::Io { file, cause })
    };
    put(POSES, &poses_json::write(&library.poses, Some(params)))?;
    put(BACKGROUND, &picture::write_rgb(&library.background))?;
    put(SPRITES, &sprites_zip(&library.sprites)?)?;
    put(LIBRARY, &library_json::write(library, params, footage))
}

/// Reads a library from a folder.
pub fn read(dir: &Path) -> Result<StoredLibrary, Error> {
    let get =
        |file: &'static str| fs::read(dir.join(file)).map_err(|cause| Error::Io { file, cause });
    let json = |file| move |cause| Error::Json { file, cause };
    let summary = library_json::read(&get(LIBRARY)?).map_err(json(LIBRARY))?;
    let poses = poses_json::read(&get(POSES)?).map_err(json(POSES))?;
    let background = picture::read_rgb(&get(BACKGROUND)?).map_err(|cause| Error::Picture {
        file: BACKGROUND,
        cause,
    })?;
    if poses.image_size_px != [background.width, background.height] {
        return Err(Error::Mismatch(
            "background.png and poses.json differ in size",
        ));
    }
    let sprites = read_sprites(&get(SPRITES)?, summary.sprite_size_px, poses.frames.len())?;
    let n_frames = poses.frames.len() as u32;
    let jumps = summary.playback.jumps.iter();
    if jumps
        .flat_map(|j| [j.from, j.to])
        .chain(summary.playback.component.iter().copied())
        .any(|f| f >= n_frames)
    {
        return Err(Error::Mismatch(
            "library.json names a frame that poses.json does not have",
        ));
    }
    let library = Library {
        poses,
        background,
        sprites,
        clip_frames: summary.clip_frames,
        epsilon: summary.epsilon,
        natural_step: summary.natural_step,
        transitions: summary.transitions,
        playback: summary.playback,
        patches: summary.patches,
        stats: summary.stats,
    };
    Ok(StoredLibrary {
        library,
        params: summary.params,
        footage: summary.footage,
    })
}

/// The name of a frame's sprite, in the archive and in exported folders.
pub fn sprite_name(frame_idx: usize) -> String {
    format!("{frame_idx:06}.png")
}

fn sprites_zip(sprites: &Sprites) -> Result<Vec<u8>, Error> {
    let pictures: Vec<(usize, Vec<u8>)> = (0..sprites.n_frames())
        .into_par_iter()
        .filter(|&idx| sprites.is_present(idx))
        .map(|idx| {
            (
                idx,
                picture::write_rgba(sprites.width(), sprites.height(), sprites.sprite(idx)),
            )
        })
        .collect();
    let mut archive = zip::ZipWriter::new(Cursor::new(Vec::new()));
    let stored = SimpleFileOptions::default().compression_method(zip::CompressionMethod::Stored);
    for (idx, bytes) in &pictures {
        archive.start_file(sprite_name(*idx), stored)?;
        archive.write_all(bytes).map_err(|cause| Error::Io {
            file: SPRITES,
            cause,
        })?;
    }
    Ok(archive.finish()?.into_inner())
}

fn read_sprites(
    bytes: &[u8],
    [width, height]: [u32; 2],
    n_frames: usize,
) -> Result<Sprites, Error> {
    let mut archive = zip::ZipArchive::new(Cursor::new(bytes))?;
    let mut pictures: Vec<Option<Vec<u8>>> = vec![None; n_frames];
    for entry in 0..archive.len() {
        let mut file = archive.by_index(entry)?;
        let frame_idx = file
            .name()?
            .strip_suffix(".png")
            .and_then(|stem| stem.parse::<usize>().ok());
        let slot = frame_idx
            .and_then(|idx| pictures.get_mut(idx))
            .ok_or(Error::Mismatch(
                "sprites.zip has an entry that is no frame of the footage",
            ))?;
        let mut picture = Vec::new();
        file.read_to_end(&mut picture).map_err(|cause| Error::Io {
            file: SPRITES,
            cause,
        })?;
        *slot = Some(picture);
    }
    let mut sprites = Sprites::missing(width, height, n_frames);
    let present = pictures.iter().map(Option::is_some).collect();
    sprites
        .fill_all(present)
        .zip(pictures)
        .par_bridge()
        .try_for_each(|(sprite, bytes)| match bytes {
            None => Ok(()),
            Some(bytes) => read_sprite(&bytes, [width, height], sprite),
        })?;
    Ok(sprites)
}

fn read_sprite(bytes: &[u8], size: [u32; 2], sprite: &mut [u8]) -> Result<(), Error> {
    let image = picture::read_rgba(bytes).map_err(|cause| Error::Picture {
        file: SPRITES,
        cause,
    })?;
    if [image.width, image.height] != size {
        return Err(Error::Mismatch(
            "a sprite is not of the size that library.json says",
        ));
    }
    sprite.copy_from_slice(&image.pixels);
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::library::{Jump, Transition};
    use crate::library::{LibraryStats, Patch, Playback, Pose, Poses, View};
    use crate::raster::RgbImage;

    fn small_library() -> Library {
        let mut sprites = Sprites::missing(8, 8, 3);
        sprites
            .fill(1)
            .iter_mut()
            .enumerate()
            .for_each(|(k, byte)| *byte = k as u8);
        Library {
            poses: Poses {
                tail_beat: None,
                fps: 25.0,
                image_size_px: [16, 12],
                view: View::Side,
                camera: None,
                animal: None,
                frames: vec![Pose::default(); 3],
            },
            background: RgbImage::new(16, 12),
            sprites,
            clip_frames: 2,
            epsilon: 77,
            natural_step: 38,
            transitions: vec![Transition {
                from: 0,
                to: 1,
                mirrored: true,
                distance: 5,
                heading_gap_rad: 0.25,
            }],
            playback: Playback {
                jumps: vec![
                    Jump {
                        from: 0,
                        to: 2,
                        cost: 5,
                        mirrored: true,
                    },
                    Jump {
                        from: 2,
                        to: 0,
                        cost: 5,
                        mirrored: false,
                    },
                ],
                component: vec![0, 1, 2],
            },
            patches: vec![Patch {
                frames: 0..3,
                next: vec![0],
            }],
            stats: LibraryStats {
                n_frames: 3,
                component_share: 1.0,
                ..LibraryStats::default()
            },
        }
    }

    #[test]
    fn a_library_comes_back_from_its_folder_as_it_was() {
        let library = small_library();
        let footage = FootageSummary {
            sha256: "ab".into(),
            n_bytes: 9,
        };
        let dir = tempfile::tempdir().expect("a temporary folder");
        write(dir.path(), &library, &Params::default(), &footage).expect("written");
        let back = read(dir.path()).expect("read");
        assert_eq!(back.library, library);
        assert_eq!((back.params, back.footage), (Params::default(), footage));
    }
}
