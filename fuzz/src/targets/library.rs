//! Folders of libraries, and flocks: what `flock`, `fish`, `matrix`, `sprites` and `check-plan` read from files that may
//! come from another person.

use std::fs;
use std::io::Cursor;
use std::path::Path;
use std::sync::{Arc, LazyLock};

use flockreel_core::analysis::similarity::distance::{
    ComparedSprites, DistanceMatrix, Distances, Side,
};
use flockreel_core::cpu::Level;
use flockreel_core::fish;
use flockreel_core::flock::advice::Advice;
use flockreel_core::flock::check::check;
use flockreel_core::flock::{Compositor, Flock, Params, Shot, plan_flock};
use flockreel_core::formats::atlas::Atlas;
use flockreel_core::formats::csv::motion::Film;
use flockreel_core::formats::distance_map::DistanceMap;
use flockreel_core::formats::flock_overlay::FlockOverlay;
use flockreel_core::formats::library_dir::{self, StoredLibrary};
use flockreel_core::formats::overlay::Overlay;
use flockreel_core::formats::{csv, flock_json, flock_plan, glb, picture, picture_archive, svg};
use flockreel_core::library::{Library, Scale, Zones};
use flockreel_core::parameters::Parameters;
use flockreel_core::progress::Silent;
use flockreel_core::raster::{ColorSpec, Frame, RgbImage};
use flockreel_core::scratch::InMemory;
use tempfile::TempDir;

/// The small library of all targets: the first inputs of `library` and `poses`.
const LIBRARY_JSON: &[u8] = include_bytes!("../../corpus/library/side.json");
const POSES_JSON: &[u8] = include_bytes!("../../corpus/poses/side.json");
/// Size of its pictures, pixels.
const SIZE_PX: [u32; 2] = [48, 32];
const MATTE_PX: [u32; 2] = [12, 6];
const N_FRAMES: usize = 16;

/// Number of individuals and frames of the flocks that are made of a library.
const COUNT: u32 = 3;
const FRAMES: u32 = 24;

/// A folder with the small library, in which a target replaces one file.
struct Folder(TempDir);

impl Folder {
    fn new() -> Folder {
        let folder = Folder(tempfile::tempdir().expect("a temporary folder"));
        folder.restore();
        folder
    }

    fn restore(&self) {
        write_small(self.path());
    }

    fn path(&self) -> &Path {
        self.0.path()
    }

    fn write(&self, name: &str, bytes: &[u8]) {
        fs::write(self.path().join(name), bytes).expect("a temporary folder has room");
    }

    fn read(&self) -> Option<StoredLibrary> {
        library_dir::read(self.path(), Arc::new(InMemory::default())).ok()
    }
}

/// Writes the small library into a folder.
pub(super) fn write_small(folder: &Path) {
    let files = [
        ("library.json", LIBRARY_JSON),
        ("poses.json", POSES_JSON),
        ("background.png", &background()),
        ("mattes.zip", &mattes()),
    ];
    for (name, bytes) in files {
        fs::write(folder.join(name), bytes).expect("a temporary folder has room");
    }
}

fn background() -> Vec<u8> {
    let [width, height] = SIZE_PX;
    let mut image = RgbImage::new(width, height);
    for (k, level) in image.pixels.iter_mut().enumerate() {
        *level = 100 + (k % 17) as u8;
    }
    picture::write_rgb(&image)
}

fn mattes() -> Vec<u8> {
    let [width, height] = MATTE_PX;
    let matte = |frame_idx: usize| {
        let pixels = (0..width * height).flat_map(|k| [200, 90, (k + frame_idx as u32) as u8, 255]);
        picture::write_rgba(width, height, &pixels.collect::<Vec<u8>>())
    };
    let archive = picture_archive::write(Cursor::new(Vec::new()), 0..N_FRAMES, matte);
    archive.expect("memory has room").into_inner()
}

/// Returns the small library.
pub(super) fn small() -> &'static Library {
    static SMALL: LazyLock<Library> = LazyLock::new(|| {
        let stored = Folder::new().read();
        stored.expect("the small library is valid").library
    });
    &SMALL
}

/// One file of a library: mattes.zip, background.png or library.json, by its first bytes.
pub(super) fn library(bytes: &[u8]) {
    let name = match bytes {
        [b'P', b'K', ..] => "mattes.zip",
        [0x89, b'P', b'N', b'G', ..] => "background.png",
        _ => "library.json",
    };
    read_with(name, bytes);
}

/// poses.json of a library.
pub(super) fn poses(bytes: &[u8]) {
    read_with("poses.json", bytes);
}

/// Reads the small library with another file, and does with it what the commands do.
fn read_with(name: &str, bytes: &[u8]) {
    static FOLDER: LazyLock<Folder> = LazyLock::new(Folder::new);
    FOLDER.write(name, bytes);
    let stored = FOLDER.read();
    FOLDER.restore();
    if let Some(stored) = stored {
        show(&stored.library);
        compare(&stored);
        swim(&stored.library);
        for params in [Params::default(), Params::papers()] {
            plan_and_film(&stored.library, params);
        }
    }
}

/// Draws what `analyze` draws of a library, and what the page loads.
fn show(library: &Library) {
    csv::write_poses(&library.poses);
    let film = Film {
        poses: &library.poses,
        length_px: library.stats.length_px,
        scale: Scale::new(1e-3).ok(),
    };
    film.motion_json();
    film.summary_json(&Zones::default());
    svg::pictures(library);
    let atlas = Atlas::new(library);
    atlas.to_json();
    atlas.pages(&library.sprites).for_each(drop);
    let mut frame = frame_of(library);
    let mut overlay = Overlay::new(&library.poses);
    (0..library.poses.frames.len()).for_each(|idx| overlay.draw(idx, &mut frame));
}

/// Compares the sprites as `matrix` does.
fn compare(stored: &StoredLibrary) {
    let library = &stored.library;
    let planes = stored.params.planes;
    let Ok(pixels) = ComparedSprites::new(&library.sprites, &library.poses, planes) else {
        return;
    };
    let distances = Distances {
        pixels: &pixels,
        clip: stored.params.clip(library.clip_frames),
        side: Side::Mirrored,
        cpu: Level::detect(),
    };
    if let Ok(map) = DistanceMap::compute(&distances, library, &Silent) {
        map.draw_distances();
        map.draw_candidates(library);
    }
    DistanceMatrix::compute(&distances, &Silent).map(drop).ok();
}

/// Makes a virtual fish as `fish` does.
fn swim(library: &Library) {
    for body in [fish::Body::Own, fish::Body::Goldfish] {
        let params = fish::Params {
            body,
            ..fish::Params::default()
        };
        if let Ok(film) = fish::Film::of(library, &params) {
            glb::write(film.motion(), film.renderer().mesh());
            film.render(0, &mut Frame::default());
            fish::likeness(library, &film);
        }
    }
}

/// Makes a flock as `flock` does. `check-plan` must accept its plan.
fn plan_and_film(library: &Library, params: Params) {
    let params = Params {
        count: Some(COUNT),
        frames: FRAMES,
        ..params
    };
    params
        .check()
        .expect("the parameters are within their limits");
    if let Ok(flock) = plan_flock(library, &params, &Silent) {
        check(library, &flock, &Silent).expect("a plan of ours is the cheapest");
        film(library, &flock);
    }
}

/// flock.json of the small library.
pub(super) fn plan(bytes: &[u8]) {
    let library = small();
    if let Ok(flock) = flock_json::read(bytes) {
        check(library, &flock, &Silent).ok();
        if flock.fits(library) {
            film(library, &flock);
        }
    }
}

/// Draws the first and the last frame of a flock, and writes its other files.
pub(super) fn film(library: &Library, flock: &Flock) {
    flock_plan::write(flock);
    svg::plan(flock);
    Advice::all(flock)
        .iter()
        .for_each(|advice| drop(advice.to_string()));
    let planar = Compositor::new(library, flock).with_truth();
    let straight = Compositor::new(library, flock).straight();
    for compositor in [planar, straight] {
        let mut shot = Shot::default();
        let n_frames = compositor.n_frames();
        for frame_idx in [0, n_frames.saturating_sub(1)] {
            if frame_idx < n_frames {
                compositor.render(frame_idx, &mut shot);
            }
        }
    }
    if flock
        .individuals
        .iter()
        .any(|one| !one.source_frame.is_empty())
    {
        let mut frame = frame_of(library);
        FlockOverlay::new(flock, library.background.size()).draw(flock, 0, &mut frame);
    }
}

fn frame_of(library: &Library) -> Frame {
    let [width, height] = library.background.size();
    let mut frame = Frame::new(width, height, ColorSpec::default());
    frame.draw_all_rgb(&library.background);
    frame
}
