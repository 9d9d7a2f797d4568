//! Parameters of analyses, flocks and virtual fish, as the JSON object of a request. Accepted parameters are used on a
//! small film or library, because a number may pass the check and overflow later.

use flockreel_core::analysis::{self, analyze};
use flockreel_core::cpu::Level;
use flockreel_core::footage::{FootageFormat, FrameSource, FrameStream, SourceError};
use flockreel_core::formats::{flock_json, glb, params, poses_json};
use flockreel_core::parameters::Parameters;
use flockreel_core::progress::Silent;
use flockreel_core::raster::{ColorSpec, Frame, RgbImage};
use flockreel_core::scratch::{InMemory, Scratch};
use flockreel_core::{fish, flock};
use serde_json::{Map, Value};
use std::sync::{Arc, LazyLock};

use super::library;

/// Reads parameters as a request does, and checks that they are stored and read back unchanged.
fn read<P: Parameters>(bytes: &[u8]) -> Option<P> {
    let overrides: Map<String, Value> = serde_json::from_slice(bytes).ok()?;
    let params: P = params::read(overrides).ok()?;
    let stored = serde_json::to_vec(&params).expect("parameters are stored as JSON");
    let loaded: P = serde_json::from_slice(&stored).expect("stored parameters are read back");
    assert!(loaded == params, "stored parameters differ");
    Some(params)
}

/// Parameters of an analysis.
pub(super) fn analysis(bytes: &[u8]) {
    static FILM: LazyLock<Film> = LazyLock::new(Film::new);
    let Some(params) = read::<analysis::Params>(bytes) else {
        return;
    };
    let scratch: Arc<dyn Scratch> = Arc::new(InMemory::default());
    let made = analyze(&*FILM, None, &params, Level::detect(), &scratch, &Silent);
    if let Ok(library) = made {
        let poses = poses_json::write(&library.poses, Some(&params));
        let read = poses_json::read(&poses).expect("written poses are read back");
        assert!(read.frames.len() == library.poses.frames.len());
    }
}

/// Parameters of a flock.
pub(super) fn flock(bytes: &[u8]) {
    let Some(mut params) = read::<flock::Params>(bytes) else {
        return;
    };
    // Few individuals and frames, so that an input takes milliseconds.
    params.count = Some(params.most_individuals().min(4));
    params.frames = params.frames.min(40);
    if params.render.size_px.is_some_and(|[w, h]| w * h > 1 << 18) {
        params.render.size_px = None;
    }
    let library = library::small();
    let Ok(flock) = flock::plan_flock(library, &params, &Silent) else {
        return;
    };
    let stored = flock_json::write(&flock);
    let read = flock_json::read(&stored).expect("a written flock is read back");
    assert!(read == flock, "a written flock differs");
    library::film(library, &flock);
}

/// Parameters of a virtual fish.
pub(super) fn fish(bytes: &[u8]) {
    let Some(params) = read::<fish::Params>(bytes) else {
        return;
    };
    let library = library::small();
    if let Ok(film) = fish::Film::of(library, &params) {
        let model = glb::write(film.motion(), film.renderer().mesh());
        assert!(model.starts_with(b"glTF"));
        film.render(0, &mut Frame::default());
    }
}

/// A film of a dark disk that moves over a gray ground.
struct Film(Vec<Frame>);

const FILM_SIZE_PX: [u32; 2] = [64, 48];
const N_FILM_FRAMES: usize = 40;

impl Film {
    fn new() -> Film {
        Film((0..N_FILM_FRAMES).map(frame).collect())
    }
}

fn frame(frame_idx: usize) -> Frame {
    let [width, height] = FILM_SIZE_PX;
    let mut image = RgbImage::new(width, height);
    let at = frame_idx as f64 / N_FILM_FRAMES as f64 * std::f64::consts::TAU;
    let (cx, cy) = (32.0 + 18.0 * at.cos(), 24.0 + 10.0 * at.sin());
    for y in 0..height {
        for x in 0..width {
            let far = (f64::from(x) - cx).hypot(2.0 * (f64::from(y) - cy));
            let shade = 180 + ((x * 7 + y * 13) % 5) as u8;
            image.set_pixel(x, y, if far < 9.0 { [30; 3] } else { [shade; 3] });
        }
    }
    let mut frame = Frame::new(width, height, ColorSpec::default());
    frame.draw_all_rgb(&image);
    frame
}

impl FrameSource for Film {
    fn format(&self) -> FootageFormat {
        let [width, height] = FILM_SIZE_PX;
        FootageFormat {
            width,
            height,
            fps: 25.0,
            n_frames_hint: N_FILM_FRAMES,
            color: ColorSpec::default(),
        }
    }

    fn open(&self) -> Result<Box<dyn FrameStream + '_>, SourceError> {
        Ok(Box::new(Frames(self.0.iter(), 0)))
    }
}

/// The frames that are left of a film, and the number of frames read.
struct Frames<'a>(std::slice::Iter<'a, Frame>, usize);

impl FrameStream for Frames<'_> {
    fn next_frame(&mut self, frame: &mut Frame) -> Result<Option<f64>, SourceError> {
        let Some(next) = self.0.next() else {
            return Ok(None);
        };
        frame.clone_from(next);
        self.1 += 1;
        Ok(Some((self.1 - 1) as f64 / 25.0))
    }
}
