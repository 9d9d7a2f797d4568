//! Small video files of the virtual fish, and other files that take long to make. They are kept for later tests, until
//! the program is built again.

use std::path::{Path, PathBuf};
use std::sync::LazyLock;
use std::time::UNIX_EPOCH;

use flockreel::media::VideoWriter;
use flockreel_core::fish::film::Film;
use flockreel_core::fish::mesh::Mesh;
use flockreel_core::fish::sample::{SampleFilm, SampleParams};
use flockreel_core::footage::{FootageFormat, FrameSource};
use flockreel_core::raster::{Frame, RgbImage};

/// Ten frames of 64 x 64 pixels, enough to be admitted as footage.
pub(crate) static TINY: LazyLock<Vec<u8>> =
    LazyLock::new(|| kept_bytes("tiny", || film(10, 64, 64)));

/// Number of frames of [`SWIM`].
pub(crate) const SWIM_FRAMES: usize = 120;

/// Four seconds of 320 x 240 pixels, enough for a library with transitions.
pub(crate) static SWIM: LazyLock<Vec<u8>> =
    LazyLock::new(|| kept_bytes("swim", || film(SWIM_FRAMES, 320, 240)));

/// The mask film of `SWIM`: each pixel is the alpha of the fish, 0 to 255.
pub(crate) static SWIM_MASKS: LazyLock<Vec<u8>> =
    LazyLock::new(|| kept_bytes("swim-masks", swim_masks));

fn swim_masks() -> Vec<u8> {
    let params = SampleParams {
        n_frames: SWIM_FRAMES,
        width: 320,
        height: 240,
        ..SampleParams::default()
    };
    let film = SampleFilm::new(params).unwrap();
    let motion = film.motion().clone();
    let mesh = Mesh::goldfish(motion.size, params.palette);
    let fish = Film::new(motion, mesh, film.background().clone());
    encoded(&film.format(), |k, frame| {
        let drawing = fish.draw(k);
        let mut picture = RgbImage::new(frame.width, frame.height);
        for y in 0..drawing.rect.h {
            for x in 0..drawing.rect.w {
                let level = (255.0 * drawing.alpha(x, y)) as u8;
                let at = [drawing.rect.x + x, drawing.rect.y + y];
                picture.set_pixel(at[0], at[1], [level; 3]);
            }
        }
        frame.draw_all_rgb(&picture);
    })
}

fn film(n_frames: usize, width: u32, height: u32) -> Vec<u8> {
    let params = SampleParams {
        n_frames,
        width,
        height,
        ..SampleParams::default()
    };
    let film = SampleFilm::new(params).unwrap();
    encoded(&film.format(), |k, frame| film.render(k, frame))
}

/// Returns the bytes of an MP4 file whose frames are drawn by `draw`.
fn encoded(format: &FootageFormat, draw: impl Fn(usize, &mut Frame)) -> Vec<u8> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("film.mp4");
    let mut writer = VideoWriter::create(&path, &(*format).into()).unwrap();
    let mut frame = Frame::new(format.width, format.height, format.color);
    for k in 0..format.n_frames_hint {
        draw(k, &mut frame);
        writer.write(&frame).unwrap();
    }
    writer.finish().unwrap();
    std::fs::read(path).unwrap()
}

fn kept_bytes(name: &str, make: impl FnOnce() -> Vec<u8>) -> Vec<u8> {
    let path = kept(name, |path| std::fs::write(path, make()).unwrap());
    std::fs::read(path).unwrap()
}

/// Returns the path of a file or folder that `make` writes. Tests in any process share it. It is made again after a
/// build of the program.
pub(crate) fn kept(name: &str, make: impl FnOnce(&Path)) -> PathBuf {
    let built = std::fs::metadata(env!("CARGO_BIN_EXE_flockreel")).and_then(|file| file.modified());
    let built_ns = built
        .unwrap()
        .duration_since(UNIX_EPOCH)
        .unwrap()
        .as_nanos();
    let tests = Path::new(env!("CARGO_TARGET_TMPDIR")).join("kept");
    let folder = tests.join(built_ns.to_string());
    let path = folder.join(name);
    if path.exists() {
        return path;
    }
    std::fs::create_dir_all(&folder).unwrap();
    let draft = tempfile::tempdir_in(&tests).unwrap();
    let made = draft.path().join("made");
    make(&made);
    // If another process was faster, its equal file or folder stays.
    if std::fs::rename(&made, &path).is_err() {
        assert!(path.exists(), "{}", path.display());
    }
    path
}
