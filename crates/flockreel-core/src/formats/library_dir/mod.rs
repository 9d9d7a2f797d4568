//! A library as a folder: library.json, poses.json, background.png, mattes.zip, and occluders.png if there
//! are known objects in front of the animal (docs/reference/formats.md, "library.json" and "mattes.zip").
//!
//! The entries 000000.png ... of mattes.zip show the animal as filmed in straight-alpha RGBA. They are
//! uncompressed zip entries. library.json holds the centroid in each. A frame without the animal has no
//! entry.
//!
//! Sprites are computed from the mattes; an archive of them is for export only. Older libraries have such an
//! archive instead of the mattes and can still be read. This is the only module of ring 2 that accesses the
//! file system.

mod archive;
mod limits;
mod scale;

use std::fs;
use std::io;
use std::path::Path;
use std::sync::Arc;

pub use self::scale::{read_scale, write_scale};

use self::archive::Archive;
use super::library_json::{self, FootageSummary};
use super::{picture, poses_json};
use crate::analysis::Params;
use crate::library::{Library, Poses, Sprites};
use crate::raster::RgbaImage;
use crate::scratch::{Full, Scratch};

/// Reasons why a library folder cannot be read or written.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// A file is missing or cannot be read or written.
    #[error("{file}: {cause}")]
    Io {
        /// Name of the file in the folder.
        file: &'static str,
        /// The system's error.
        cause: io::Error,
    },
    /// A JSON file has unexpected contents.
    #[error("{file}: {cause}")]
    Json {
        /// Name of the file in the folder.
        file: &'static str,
        /// Position and reason.
        cause: serde_json::Error,
    },
    /// A picture has an unexpected format.
    #[error("{file}: {cause}")]
    Picture {
        /// Name of the file in the folder.
        file: &'static str,
        /// The reason.
        cause: picture::Error,
    },
    /// An archive of pictures is damaged.
    #[error("{file}: {cause}")]
    Zip {
        /// Name of the file in the folder.
        file: &'static str,
        /// The reason.
        cause: zip::result::ZipError,
    },
    /// The scratch for the mattes is full.
    #[error(transparent)]
    Full(#[from] Full),
    /// A value is out of its range.
    #[error("out of range: {0}")]
    OutOfRange(&'static str),
    /// The files contradict each other.
    #[error("the files do not belong together: {0}")]
    Mismatch(&'static str),
}

/// A stored library with its origin.
pub struct StoredLibrary {
    /// The library.
    pub library: Library,
    /// Parameters of its analysis.
    pub params: Params,
    /// The footage from which it was made.
    pub footage: FootageSummary,
}

const LIBRARY: &str = "library.json";
/// Name of the file of the poses.
pub const POSES: &str = "poses.json";
const BACKGROUND: &str = "background.png";
const OCCLUDERS: &str = "occluders.png";
const MATTES: &str = "mattes.zip";
const SPRITES: &str = "sprites.zip";
const SCALE: &str = "scale.json";
/// Maximum width and height of the pictures in a library, pixels. Free choice.
const MAX_SIDE_PX: u32 = 16384;
/// Maximum size of a picture in a library, pixels. A few bytes can claim more than the memory holds. Free choice: sixteen
/// times the size of the largest footage.
const MAX_PIXELS: u64 = 1 << 27;
/// Files from which a library is read; the folder may hold others. One of the archives is sufficient, and
/// only some libraries have occluders.
pub const FILES: [&str; 6] = [LIBRARY, POSES, BACKGROUND, OCCLUDERS, MATTES, SPRITES];
/// Files from which poses and parameters are read.
pub const MEASUREMENT: [&str; 2] = [LIBRARY, POSES];

/// Writes a library into a folder, which is created if needed.
pub fn write(
    dir: &Path,
    library: &Library,
    params: &Params,
    footage: &FootageSummary,
) -> Result<(), Error> {
    fs::create_dir_all(dir).map_err(|cause| Error::Io { file: ".", cause })?;
    let write_file = |file: &'static str, bytes: &[u8]| {
        fs::write(dir.join(file), bytes).map_err(|cause| Error::Io { file, cause })
    };
    write_file(POSES, &poses_json::write(&library.poses, Some(params)))?;
    write_file(BACKGROUND, &picture::write_rgb(&library.background))?;
    write_mattes(dir, &library.sprites)?;
    // Remove the sprites and the scale of an earlier analysis.
    fs::remove_file(dir.join(SPRITES)).ok();
    write_scale(dir, None)?;
    match &library.occluders {
        Some(image) => {
            let png = picture::write_rgba(image.width, image.height, &image.pixels);
            write_file(OCCLUDERS, &png)?;
        }
        None => {
            fs::remove_file(dir.join(OCCLUDERS)).ok();
        }
    }
    write_file(LIBRARY, &library_json::write(library, params, footage))
}

/// Writes the sprites into the folder, as an archive of pictures of one size.
pub fn write_sprites(dir: &Path, sprites: &Sprites) -> Result<(), Error> {
    archive::write(dir, SPRITES, sprites, |idx| {
        picture::write_rgba(sprites.width(), sprites.height(), &sprites.sprite(idx))
    })
}

fn write_mattes(dir: &Path, sprites: &Sprites) -> Result<(), Error> {
    archive::write(dir, MATTES, sprites, |idx| {
        let (matte, mut rgba) = (sprites.matte(idx).expect("present"), Vec::new());
        sprites.read_matte(&matte, &mut rgba);
        picture::write_rgba(matte.size[0], matte.size[1], &rgba)
    })
}

/// Reads the poses of a library folder.
pub fn read_poses(dir: &Path) -> Result<Poses, Error> {
    let poses = poses_json::read(&read_file(dir, POSES)?);
    let poses = poses.map_err(|cause| Error::Json { file: POSES, cause })?;
    limits::check_poses(&poses)?;
    Ok(poses)
}

/// Reads only the parameters of the analysis from a library folder.
pub fn read_params(dir: &Path) -> Result<Params, Error> {
    Ok(read_summary(dir)?.params)
}

fn read_summary(dir: &Path) -> Result<library_json::Summary, Error> {
    let summary = library_json::read(&read_file(dir, LIBRARY)?);
    summary.map_err(|cause| Error::Json {
        file: LIBRARY,
        cause,
    })
}

/// Reads a library from a folder and stores its mattes in `scratch`.
pub fn read(dir: &Path, scratch: Arc<dyn Scratch>) -> Result<StoredLibrary, Error> {
    let read_file = |file| read_file(dir, file);
    let summary = read_summary(dir)?;
    let poses = read_poses(dir)?;
    limits::check(&summary, poses.frames.len())?;
    let background = picture::read_rgb(&read_file(BACKGROUND)?, poses.image_size_px);
    let background = background.map_err(|cause| Error::Picture {
        file: BACKGROUND,
        cause,
    })?;
    if poses.image_size_px != background.size() {
        return Err(Error::Mismatch(
            "background.png and poses.json differ in size",
        ));
    }
    let occluders = (summary.occluders)
        .then(|| read_occluders(dir, poses.image_size_px))
        .transpose()?;
    let archive = Archive::open(dir, &summary)?;
    let max_size_px = match archive.centers_px {
        Some(_) => poses.image_size_px,
        None => summary.sprite_size_px,
    };
    let mattes = archive.mattes(poses.frames.len(), max_size_px, &*scratch)?;
    let library = Library {
        poses,
        background,
        occluders,
        sprites: Sprites::new(
            summary.sprite_size_px,
            mattes,
            summary.sprite_scale,
            scratch,
        ),
        shadow: summary.shadow,
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

fn read_file(dir: &Path, file: &'static str) -> Result<Vec<u8>, Error> {
    fs::read(dir.join(file)).map_err(|cause| Error::Io { file, cause })
}

/// Reads the objects in front of the animal.
fn read_occluders(dir: &Path, size_px: [u32; 2]) -> Result<RgbaImage, Error> {
    let file = OCCLUDERS;
    let bytes = fs::read(dir.join(file)).map_err(|cause| Error::Io { file, cause })?;
    let image = picture::read_rgba(&bytes, size_px);
    let image = image.map_err(|cause| Error::Picture { file, cause })?;
    if [image.width, image.height] == size_px {
        Ok(image)
    } else {
        Err(Error::Mismatch(
            "occluders.png and poses.json differ in size",
        ))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::library::{Jump, LibraryStats, Playback, Pose, Poses, Shadow, Transition, View};
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
                view_confidence: None,
                other_movers: Vec::new(),
                camera: None,
                animal: None,
                frames: vec![Pose::default(); 3],
            },
            background: RgbImage::new(16, 12),
            occluders: Some(wire()),
            sprites,
            shadow: Some(Shadow {
                darkness: 0.25,
                offset_bl: [0.125, -0.0625],
                blur_bl: 0.0625,
            }),
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
                jumps: vec![Jump {
                    from: 0,
                    to: 2,
                    cost: 5,
                    mirrored: true,
                }],
                component: vec![0, 1, 2],
            },
            patches: Vec::new(),
            stats: LibraryStats::default(),
        }
    }

    fn wire() -> RgbaImage {
        let mut wire = RgbaImage::new(16, 12);
        wire.set_pixel(3, 2, [10, 20, 30, 40]);
        wire.set_pixel(4, 2, [50, 60, 70, 255]);
        wire
    }

    fn footage() -> FootageSummary {
        FootageSummary {
            sha256: "ab".into(),
            n_bytes: 9,
        }
    }

    #[test]
    fn library_is_read_back_as_written() {
        let library = small_library();
        let footage = footage();
        let dir = tempfile::tempdir().expect("a temporary folder");
        write(dir.path(), &library, &Params::default(), &footage).expect("written");
        let back = read(dir.path(), Arc::new(InMemory::default())).expect("read");
        assert_eq!(back.library, library);
        assert_eq!(
            (back.params, back.footage),
            (Params::default(), footage.clone())
        );
        // Occluders of an earlier analysis are removed if the new library has none.
        let open = Library {
            occluders: None,
            ..library
        };
        write(dir.path(), &open, &Params::default(), &footage).expect("written");
        let back = read(dir.path(), Arc::new(InMemory::default())).expect("read");
        assert!(back.library == open && !dir.path().join(OCCLUDERS).exists());
    }

    #[test]
    fn older_folder_is_read_and_mismatched_files_are_refused() {
        let library = small_library();
        let dir = tempfile::tempdir().expect("a temporary folder");
        write(dir.path(), &library, &Params::default(), &footage()).expect("written");
        let json = fs::read_to_string(dir.path().join(LIBRARY)).expect("a file");
        let centers = r#""matte_center_px":[null,[4.0,4.0],null]"#;
        let of = |from: &str, to: &str| {
            assert!(json.contains(from), "{json}");
            fs::write(dir.path().join(LIBRARY), json.replace(from, to)).expect("written");
            read(dir.path(), Arc::new(InMemory::default()))
        };
        for others in ["[null,null,null]", "[null,[4.0,4.0]]"] {
            let others = format!(r#""matte_center_px":{others}"#);
            assert!(matches!(of(centers, &others), Err(Error::Mismatch(_))));
        }
        for size in ["[0,8]", "[8,70000]"] {
            let size = format!(r#""sprite_size_px":{size}"#);
            let read = of(r#""sprite_size_px":[8,8]"#, &size);
            assert!(matches!(read, Err(Error::OutOfRange(_))));
        }
        let small = picture::write_rgba(8, 8, &[0; 256]);
        fs::write(dir.path().join(OCCLUDERS), small).expect("written");
        let read = of(centers, centers);
        assert!(matches!(read, Err(Error::Mismatch(_))));
        fs::remove_file(dir.path().join(OCCLUDERS)).expect("it was there");
        assert!(matches!(of(centers, centers), Err(Error::Io { .. })));
        fs::remove_file(dir.path().join(MATTES)).expect("it was there");
        write_sprites(dir.path(), &library.sprites).expect("written");
        let before = format!(r#"{centers},"occluders":true"#);
        let found = of(&before, r#""matte_center_px":[]"#).expect("a library of before");
        assert_eq!(found.library.occluders, None);
        let sprites = &found.library.sprites;
        assert_eq!(sprites.sprite(1), library.sprites.sprite(1));
        let scaled = of(
            &format!(r#""sprite_scale":null,{before}"#),
            r#""sprite_scale":[1.0,1.0,1.0]"#,
        );
        assert!(matches!(scaled, Err(Error::Mismatch(_))));
    }
}
