//! A library as a folder: library.json, poses.json, background.png, and sprites.zip, whose entries
//! 000000.png ... are straight-alpha RGBA of one size, stored, so that any tool opens them. A frame
//! without the animal has no entry.
//!
//! The only file of ring 2 that touches the file system.

use std::fs::{self, File};
use std::io::{self, BufReader, BufWriter, Write};
use std::os::unix::fs::FileExt;
use std::path::Path;
use std::sync::Arc;

use rayon::prelude::*;
use zip::write::SimpleFileOptions;

use super::library_json::{self, FootageSummary};
use super::{picture, poses_json};
use crate::analysis::Params;
use crate::library::{Library, Sprites};
use crate::scratch::{Full, Scratch};

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
    /// The sprites found no room beside the folder.
    #[error(transparent)]
    Full(#[from] Full),
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
/// The files that a library is read from; there may be others beside them.
pub const FILES: [&str; 4] = [LIBRARY, POSES, BACKGROUND, SPRITES];

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
    write_sprites(&dir.join(SPRITES), &library.sprites)?;
    put(LIBRARY, &library_json::write(library, params, footage))
}

/// Reads a library from a folder.
/// The sprites are put aside in `scratch`.
pub fn read(dir: &Path, scratch: Arc<dyn Scratch>) -> Result<StoredLibrary, Error> {
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
    let archive = File::open(dir.join(SPRITES)).map_err(sprites_io)?;
    let size = summary.sprite_size_px;
    let sprites = read_sprites(archive, size, poses.frames.len(), scratch)?;
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
    let scales = summary.sprite_scale.as_deref().unwrap_or_default();
    let is_sound = |&scale: &f64| (0.01..=100.0).contains(&scale);
    if summary.sprite_scale.is_some() && scales.len() != poses.frames.len()
        || !scales.iter().all(is_sound)
    {
        return Err(Error::Mismatch(
            "library.json must name a size for the sprite of every frame",
        ));
    }
    let library = Library {
        poses,
        background,
        sprites,
        sprite_scale: summary.sprite_scale,
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

/// Sprites encoded at a time, on all threads: what is held in memory.
const BATCH: usize = 256;

fn write_sprites(path: &Path, sprites: &Sprites) -> Result<(), Error> {
    let file = BufWriter::new(File::create(path).map_err(sprites_io)?);
    let mut archive = zip::ZipWriter::new(file);
    let stored = SimpleFileOptions::default().compression_method(zip::CompressionMethod::Stored);
    let present: Vec<usize> = (0..sprites.n_frames())
        .filter(|&idx| sprites.is_present(idx))
        .collect();
    let encode = |&idx: &usize| {
        let (width, height) = (sprites.width(), sprites.height());
        picture::write_rgba(width, height, &sprites.sprite(idx))
    };
    for batch in present.chunks(BATCH) {
        let pictures: Vec<Vec<u8>> = batch.par_iter().map(encode).collect();
        for (&idx, bytes) in batch.iter().zip(pictures) {
            archive.start_file(sprite_name(idx), stored)?;
            archive.write_all(&bytes).map_err(sprites_io)?;
        }
    }
    let mut file = archive.finish()?;
    file.flush().map_err(sprites_io)
}

fn sprites_io(cause: io::Error) -> Error {
    let file = SPRITES;
    Error::Io { file, cause }
}

/// Where a sprite's PNG lies in the archive.
struct Entry {
    at: u64,
    n_bytes: usize,
}

fn read_sprites(
    file: File,
    size: [u32; 2],
    n_frames: usize,
    scratch: Arc<dyn Scratch>,
) -> Result<Sprites, Error> {
    let entries = entries(&file, n_frames)?;
    Sprites::drawn(size, n_frames, scratch, |frame_idx, sprite| {
        let Some(entry) = &entries[frame_idx] else {
            return Ok(false);
        };
        let mut bytes = vec![0; entry.n_bytes];
        file.read_exact_at(&mut bytes, entry.at)
            .map_err(sprites_io)?;
        read_sprite(&bytes, size, sprite)?;
        Ok(true)
    })
}

/// The entries of the archive, by frame.
fn entries(file: &File, n_frames: usize) -> Result<Vec<Option<Entry>>, Error> {
    let n_bytes_all = file.metadata().map_err(sprites_io)?.len();
    let mut archive = zip::ZipArchive::new(BufReader::new(file))?;
    let mut entries: Vec<Option<Entry>> = std::iter::repeat_with(|| None).take(n_frames).collect();
    for idx in 0..archive.len() {
        let entry = archive.by_index(idx)?;
        let frame_idx = (entry.name()?.strip_suffix(".png")).and_then(|stem| stem.parse().ok());
        let slot = frame_idx.and_then(|idx: usize| entries.get_mut(idx));
        let slot = slot.ok_or(Error::Mismatch(
            "sprites.zip has an entry that is no frame of the footage",
        ))?;
        let stored = entry.compression() == zip::CompressionMethod::Stored;
        let at = entry.data_start().filter(|at| {
            stored
                && at
                    .checked_add(entry.size())
                    .is_some_and(|end| end <= n_bytes_all)
        });
        let at = at.ok_or(Error::Mismatch(
            "an entry of sprites.zip is compressed or cut off",
        ))?;
        *slot = Some(Entry {
            at,
            n_bytes: entry.size() as usize,
        });
    }
    Ok(entries)
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
    use crate::scratch::InMemory;

    fn small_library() -> Library {
        let draw = |frame_idx, rgba: &mut [u8]| {
            let bytes = rgba.iter_mut().enumerate();
            bytes.for_each(|(k, byte)| *byte = k as u8);
            Ok::<_, Full>(frame_idx == 1)
        };
        let scratch = Arc::new(InMemory::default());
        let sprites = Sprites::drawn([8, 8], 3, scratch, draw).expect("memory has room");
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
            sprite_scale: None,
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
        let back = read(dir.path(), Arc::new(InMemory::default())).expect("read");
        assert_eq!(back.library, library);
        assert_eq!((back.params, back.footage), (Params::default(), footage));
    }
}
