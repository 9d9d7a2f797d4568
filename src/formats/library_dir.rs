//! A library as a folder: library.json, poses.json, background.png, and cutouts.zip, whose entries
//! 000000.png ... are the animal as filmed in straight-alpha RGBA, stored, so that any tool opens them. Where its
//! centroid lies in each, library.json tells. A frame without the animal has no entry.
//!
//! Sprites, all of one size with the centroid at the middle, are made of the cutouts; an archive of them is for
//! export. Libraries of before have such an archive in place of the cutouts, and are still read.
//!
//! The only file of ring 2 that touches the file system.

use std::fs::{self, File};
use std::io::{self, BufReader, BufWriter, Write};
use std::os::unix::fs::FileExt;
use std::path::Path;
use std::sync::Arc;

use rayon::prelude::*;
use zip::write::SimpleFileOptions;

use super::library_json::{self, FootageSummary, Summary};
use super::{picture, poses_json};
use crate::analysis::Params;
use crate::library::{Cutout, Library, Sprites};
use crate::raster::RgbaImage;
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
    /// An archive of pictures is damaged.
    #[error("{file}: {cause}")]
    Zip {
        /// Which file of the folder.
        file: &'static str,
        /// What was found.
        cause: zip::result::ZipError,
    },
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
const CUTOUTS: &str = "cutouts.zip";
const SPRITES: &str = "sprites.zip";
/// The files that a library is read from; there may be others beside them. Of the archives one is enough.
pub const FILES: [&str; 5] = [LIBRARY, POSES, BACKGROUND, CUTOUTS, SPRITES];

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
    write_cutouts(dir, &library.sprites)?;
    put(LIBRARY, &library_json::write(library, params, footage))
}

/// Writes the sprites into the folder, as an archive of pictures of one size.
pub fn write_sprites(dir: &Path, sprites: &Sprites) -> Result<(), Error> {
    write_archive(dir, SPRITES, sprites, |idx| {
        picture::write_rgba(sprites.width(), sprites.height(), &sprites.sprite(idx))
    })
}

fn write_cutouts(dir: &Path, sprites: &Sprites) -> Result<(), Error> {
    write_archive(dir, CUTOUTS, sprites, |idx| {
        let (cutout, mut rgba) = (sprites.cutout(idx).expect("present"), Vec::new());
        sprites.read_cutout(&cutout, &mut rgba);
        picture::write_rgba(cutout.size[0], cutout.size[1], &rgba)
    })
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
    let archive = Archive::open(dir, &summary)?;
    let cutouts = archive.cutouts(poses.frames.len(), poses.image_size_px, &*scratch)?;
    let library = Library {
        poses,
        background,
        sprites: Sprites::of(
            summary.sprite_size_px,
            cutouts,
            summary.sprite_scale,
            scratch,
        ),
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

fn write_archive(
    dir: &Path,
    file: &'static str,
    sprites: &Sprites,
    encode: impl Fn(usize) -> Vec<u8> + Sync,
) -> Result<(), Error> {
    let io = |cause| Error::Io { file, cause };
    let zip = |cause| Error::Zip { file, cause };
    let out = BufWriter::new(File::create(dir.join(file)).map_err(io)?);
    let mut archive = zip::ZipWriter::new(out);
    let stored = SimpleFileOptions::default().compression_method(zip::CompressionMethod::Stored);
    let present: Vec<usize> = (0..sprites.n_frames())
        .filter(|&idx| sprites.is_present(idx))
        .collect();
    for batch in present.chunks(BATCH) {
        let pictures: Vec<Vec<u8>> = batch.par_iter().map(|&idx| encode(idx)).collect();
        for (&idx, bytes) in batch.iter().zip(pictures) {
            archive.start_file(sprite_name(idx), stored).map_err(zip)?;
            archive.write_all(&bytes).map_err(io)?;
        }
    }
    archive.finish().map_err(zip)?.flush().map_err(io)
}

/// An archive of cutouts.
struct Archive<'a> {
    name: &'static str,
    file: File,
    /// The centroid in each; `None` when they are sprites, and it lies at the middle.
    centers_px: Option<&'a [Option<[f64; 2]>]>,
}

/// Where a PNG lies in an archive.
struct Entry {
    at: u64,
    n_bytes: usize,
}

impl Archive<'_> {
    fn open<'a>(dir: &Path, summary: &'a Summary) -> Result<Archive<'a>, Error> {
        let centers_px = &summary.cutout_center_px;
        let name = if centers_px.is_empty() {
            SPRITES
        } else {
            CUTOUTS
        };
        let file = File::open(dir.join(name)).map_err(|cause| Error::Io { file: name, cause })?;
        Ok(Archive {
            name,
            file,
            centers_px: (!centers_px.is_empty()).then_some(centers_px),
        })
    }

    /// Puts aside what the archive holds for every frame, none larger than the footage.
    fn cutouts(
        &self,
        n_frames: usize,
        most_px: [u32; 2],
        scratch: &dyn Scratch,
    ) -> Result<Vec<Option<Cutout>>, Error> {
        if self.centers_px.is_some_and(|all| all.len() != n_frames) {
            return Err(Error::Mismatch(
                "library.json must tell the centroid of every frame's cutout",
            ));
        }
        let entries = self.entries(n_frames)?;
        let cutout = |(frame_idx, entry): (usize, &Option<Entry>)| {
            let Some(entry) = entry else { return Ok(None) };
            let image = self.picture(entry)?;
            let size = [image.width, image.height];
            let center_px = match self.centers_px {
                Some(centers_px) => centers_px[frame_idx],
                None => Some(size.map(|side| f64::from(side) / 2.0)),
            };
            let center_px = center_px.filter(|center| center.iter().all(|px| px.abs() < 1e5));
            let fits = self.centers_px.is_none() || (0..2).all(|k| size[k] <= most_px[k]);
            let Some(center_px) = center_px.filter(|_| fits) else {
                return Err(Error::Mismatch(
                    "a cutout is larger than the footage, or library.json does not tell its centroid",
                ));
            };
            let at = scratch.put(&image.pixels)?;
            Ok(Some(Cutout {
                size,
                center_px,
                at,
            }))
        };
        entries.par_iter().enumerate().map(cutout).collect()
    }

    fn picture(&self, entry: &Entry) -> Result<RgbaImage, Error> {
        let file = self.name;
        let mut bytes = vec![0; entry.n_bytes];
        let read = self.file.read_exact_at(&mut bytes, entry.at);
        read.map_err(|cause| Error::Io { file, cause })?;
        picture::read_rgba(&bytes).map_err(|cause| Error::Picture { file, cause })
    }

    /// The entries, by frame.
    fn entries(&self, n_frames: usize) -> Result<Vec<Option<Entry>>, Error> {
        let file = self.name;
        let metadata = self.file.metadata();
        let n_bytes_all = metadata.map_err(|cause| Error::Io { file, cause })?.len();
        let zip = |cause| Error::Zip { file, cause };
        let mut archive = zip::ZipArchive::new(BufReader::new(&self.file)).map_err(zip)?;
        let mut entries: Vec<Option<Entry>> =
            std::iter::repeat_with(|| None).take(n_frames).collect();
        for idx in 0..archive.len() {
            let entry = archive.by_index(idx).map_err(zip)?;
            let name = entry.name().map_err(zip)?;
            let frame_idx = (name.strip_suffix(".png")).and_then(|stem| stem.parse().ok());
            let slot = frame_idx.and_then(|idx: usize| entries.get_mut(idx));
            let slot = slot.ok_or(Error::Mismatch(
                "an archive has an entry that is no frame of the footage",
            ))?;
            let stored = entry.compression() == zip::CompressionMethod::Stored;
            let ends = |at: &u64| at.checked_add(entry.size());
            let at = (entry.data_start())
                .filter(|at| stored && ends(at).is_some_and(|end| end <= n_bytes_all));
            let at = at.ok_or(Error::Mismatch(
                "an entry of an archive is compressed or cut off",
            ))?;
            *slot = Some(Entry {
                at,
                n_bytes: entry.size() as usize,
            });
        }
        Ok(entries)
    }
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
