//! Tests on synthetic footage: a patterned disc moves to and fro behind wires and in front of bars.

use std::sync::Arc;

use crate::analysis::scene::background::Background;
use crate::analysis::track::{self, Track};
use crate::analysis::{Params, occluders, read_ahead, scene};
use crate::footage::{FootageFormat, FrameSource, FrameStream, SourceError};
use crate::geometry::Rect;
use crate::progress::Silent;
use crate::random;
use crate::raster::{ColorSpec, Frame, RgbImage, RgbaImage};
use crate::scratch::{InMemory, Scratch};

const SIZE: [u32; 2] = [192, 96];
const N_FRAMES: usize = 60;
const RADIUS_PX: f64 = 14.0;

/// Occluder at a pixel: its share of the pixel, 0..=1, and its level.
type Wires = fn(u32, u32) -> (f64, f64);

/// Wires: one with bright and dull parts, and one of another level that covers half of two rows.
fn two_wires(x: u32, y: u32) -> (f64, f64) {
    match y {
        44 if x % 24 < 16 => (0.9, 230.0),
        44 => (0.4, 230.0),
        53 | 54 => (0.5, 210.0),
        _ => (0.0, 0.0),
    }
}

fn none(_: u32, _: u32) -> (f64, f64) {
    (0.0, 0.0)
}

struct Film {
    wires: Wires,
    /// Share of the disc's color that comes from behind it, 0..=1.
    clear: f64,
}

/// Level of a gray wall with dark bars two pixels wide and bright bars one pixel wide.
fn wall(x: u32) -> f64 {
    match x % 12 {
        0 | 1 => 105.0,
        7 => 190.0,
        _ => 150.0,
    }
}

fn center_px(frame_idx: usize) -> [f64; 2] {
    let phase = frame_idx as f64 * 0.21;
    [
        96.0 + 70.0 * libm::sin(phase),
        48.0 + 12.0 * libm::sin(2.3 * phase),
    ]
}

/// Level of the disc: a pattern of spots that moves with it.
fn coat(u: f64, v: f64) -> f64 {
    let [u, v] = [u, v].map(|at| (at + 100.0) as u64 / 4);
    60.0 + 24.0 * random::uniform(5, &[u, v])
}

impl Film {
    fn level(&self, frame_idx: Option<usize>, x: u32, y: u32) -> f64 {
        let mut level = wall(x);
        if let Some(frame_idx) = frame_idx {
            let [cx, cy] = center_px(frame_idx);
            let (u, v) = (f64::from(x) + 0.5 - cx, f64::from(y) + 0.5 - cy);
            if libm::hypot(u, v) < RADIUS_PX {
                level = self.clear * level + (1.0 - self.clear) * coat(u, v);
            }
        }
        let (share, own) = (self.wires)(x, y);
        share * own + (1.0 - share) * level
    }

    /// Returns the track of the film, its background and the occluders found.
    fn analyzed(&self) -> (Track, Background, Option<RgbaImage>) {
        let params = Params::default();
        let scratch: Arc<dyn Scratch> = Arc::new(InMemory::default());
        let (mut scene, mut track) = read_ahead::while_reading(self, |batches| {
            let scene = scene::estimate(self, None, &params, &Silent)?;
            let track = track::follow(batches, N_FRAMES, &scene, &params, &scratch, &Silent)?;
            Ok::<_, crate::analysis::Error>((scene, track))
        })
        .expect("a disc that moves");
        let background = scene.backgrounds.swap_remove(0);
        let found = occluders::remove(&mut track, &background, &Silent).expect("not cancelled");
        (track, background, found)
    }
}

impl FrameSource for Film {
    fn format(&self) -> FootageFormat {
        FootageFormat {
            width: SIZE[0],
            height: SIZE[1],
            fps: 30.0,
            n_frames_hint: N_FRAMES,
            color: ColorSpec::default(),
        }
    }

    fn open(&self) -> Result<Box<dyn FrameStream + '_>, SourceError> {
        Ok(Box::new(Reel(self, 0)))
    }
}

struct Reel<'a>(&'a Film, usize);

impl FrameStream for Reel<'_> {
    fn next_frame(&mut self, frame: &mut Frame) -> Result<Option<f64>, SourceError> {
        let Reel(film, frame_idx) = *self;
        if frame_idx == N_FRAMES {
            return Ok(None);
        }
        let mut picture = RgbImage::new(SIZE[0], SIZE[1]);
        for (y, x) in (0..SIZE[1]).flat_map(|y| (0..SIZE[0]).map(move |x| (y, x))) {
            let noise = random::normal(3, &[frame_idx as u64, u64::from(y * SIZE[0] + x)]);
            let level = film.level(Some(frame_idx), x, y) + 1.5 * noise;
            picture.set_pixel(x, y, [level.round() as u8; 3]);
        }
        *frame = Frame::new(SIZE[0], SIZE[1], ColorSpec::default());
        frame.draw_rgb(&picture, Rect::of_size(SIZE[0], SIZE[1]));
        self.1 += 1;
        Ok(Some(frame_idx as f64 / 30.0))
    }
}

#[test]
fn wires_in_front_are_found_and_bars_behind_are_not() {
    let film = Film {
        wires: two_wires,
        clear: 0.0,
    };
    let (_, background, found) = film.analyzed();
    let found = found.expect("two wires");
    let (mut n_right, mut n_wire, mut n_wrong) = (0, 0, 0);
    // Rows and columns that the whole disc crosses.
    for (x, y) in (40..152).flat_map(|x| (40..56).map(move |y| (x, y))) {
        let (share, level) = two_wires(x, y);
        let [r, g, b, alpha] = found.pixel(x, y).map(f64::from);
        // Shares are less accurate where a wire crosses a bar.
        let is_wire = share > 0.0 && wall(x) == 150.0;
        n_wire += usize::from(is_wire);
        if share > 0.0 {
            let is_right = (alpha / 255.0 - share).abs() < 0.12
                && [r, g, b].iter().all(|own| (own - level).abs() < 35.0);
            n_right += usize::from(is_wire && is_right);
        } else {
            n_wrong += usize::from(alpha > 0.0);
        }
    }
    assert!(10 * n_right >= 9 * n_wire, "{n_right} of {n_wire}");
    assert!(n_wrong <= n_wire / 50, "{n_wrong} beside {n_wire}");
    assert_eq!(background.rgb.width, found.width);
}

#[test]
fn mattes_show_the_animal_without_the_wires() {
    let film = Film {
        wires: two_wires,
        clear: 0.0,
    };
    let (track, _, _) = film.analyzed();
    let (mut off, mut n, mut n_torn) = (0.0, 0.0, 0);
    for (frame_idx, tracked) in track.frames.iter().enumerate() {
        let seen = tracked.sighting.as_ref().expect("always in the picture");
        let image = track.image(seen);
        let [cx, cy] = center_px(frame_idx);
        for y in [44, 53, 54] {
            for x in seen.rect.x..seen.rect.right() {
                let (u, v) = (f64::from(x) + 0.5 - cx, f64::from(y) + 0.5 - cy);
                if libm::hypot(u, v) < RADIUS_PX - 4.0 {
                    let [r, _, _, alpha] = image.pixel(x - seen.rect.x, y - seen.rect.y);
                    n_torn += usize::from(alpha < 200);
                    off += (f64::from(r) - coat(u, v)).abs();
                    n += 1.0;
                }
            }
        }
        let [x, y] = seen.moments.centroid_px;
        assert!(libm::hypot(x - cx, y - cy) < 0.5, "{x}, {y}: {cx}, {cy}");
    }
    assert!(n_torn as f64 <= n / 50.0, "{n_torn} of {n}");
    // The levels of the spots span 24.
    assert!(off / n < 5.0, "{}", off / n);
}

#[test]
fn nothing_is_found_without_wires() {
    for clear in [0.0, 0.5] {
        let film = Film { wires: none, clear };
        let (track, _, found) = film.analyzed();
        let area = found.map_or(0, |image| {
            image.pixels.chunks(4).filter(|p| p[3] > 0).count()
        });
        assert_eq!(area, 0, "clear {clear}");
        assert_eq!(track.frames.len(), N_FRAMES);
    }
}
