//! Films of the virtual fish with staged events, and their truth. The frames are edited in memory, so a test
//! of a whole analysis takes about a second.

use std::sync::Arc;

use flockreel_core::analysis::{Error, Params, analyze};
use flockreel_core::cpu::Level;
use flockreel_core::fish::motion::Motion;
use flockreel_core::fish::sample::{SampleFilm, SampleParams};
use flockreel_core::footage::{FootageFormat, FrameSource, FrameStream, SourceError};
use flockreel_core::geometry::wrap_rad;
use flockreel_core::library::Library;
use flockreel_core::progress::Silent;
use flockreel_core::raster::{Frame, RgbImage};
use flockreel_core::scratch::{InMemory, Scratch};

/// Number of frames of the unedited film.
pub(super) const N_FRAMES: usize = 150;
pub(super) const FPS: f64 = 30.0;
pub(super) const WIDTH: u32 = 320;
pub(super) const HEIGHT: u32 = 240;

/// A film with edited frames.
pub(super) struct Staged {
    film: SampleFilm,
    frames: Vec<Frame>,
    /// For each frame, the index of the frame of the unedited film; `None` if it does not show the fish.
    shown: Vec<Option<usize>>,
    /// For each frame, the shift of the picture to the right and down, pixels.
    shift_px: Vec<[f64; 2]>,
}

impl Staged {
    /// Returns the unedited film.
    pub(super) fn plain() -> Staged {
        Staged::in_order((0..N_FRAMES).collect())
    }

    /// Returns a film of the unedited frames in this order; frames may be omitted or repeated.
    pub(super) fn in_order(order: Vec<usize>) -> Staged {
        let film = SampleFilm::new(SampleParams {
            n_frames: N_FRAMES,
            width: WIDTH,
            height: HEIGHT,
            ..SampleParams::default()
        })
        .expect("in range");
        let render = |&idx: &usize| {
            let mut frame = Frame::default();
            film.render(idx, &mut frame);
            frame
        };
        Staged {
            frames: order.iter().map(render).collect(),
            shift_px: vec![[0.0; 2]; order.len()],
            shown: order.into_iter().map(Some).collect(),
            film,
        }
    }

    /// Multiplies the brightness of every frame by `light`, a function of frame and row.
    pub(super) fn with_light(mut self, light: impl Fn(usize, usize) -> f64) -> Staged {
        for (k, frame) in self.frames.iter_mut().enumerate() {
            let mut picture = frame.to_rgb();
            for (at, value) in picture.pixels.iter_mut().enumerate() {
                let by_light = f64::from(*value) * light(k, at / (3 * WIDTH as usize));
                *value = by_light.round().min(255.0) as u8;
            }
            frame.draw_all_rgb(&picture);
        }
        self
    }

    /// Edits every frame with `draw`, a function of frame, picture and true centroid of the fish.
    pub(super) fn with_drawing(mut self, draw: impl Fn(usize, &mut RgbImage, [f64; 2])) -> Staged {
        for k in 0..self.frames.len() {
            let centroid_px = self.centroid_px(k).unwrap_or([f64::NAN; 2]);
            let mut picture = self.frames[k].to_rgb();
            draw(k, &mut picture, centroid_px);
            self.frames[k].draw_all_rgb(&picture);
        }
        self
    }

    /// Shifts each frame right and down by whole pixels. Border pixels are repeated.
    pub(super) fn shifted(mut self, by: impl Fn(usize) -> [i64; 2]) -> Staged {
        for (k, frame) in self.frames.iter_mut().enumerate() {
            let [right, down] = by(k);
            let picture = frame.to_rgb();
            let mut moved = picture.clone();
            for y in 0..HEIGHT {
                for x in 0..WIDTH {
                    let from_x = (i64::from(x) - right).clamp(0, i64::from(WIDTH) - 1) as u32;
                    let from_y = (i64::from(y) - down).clamp(0, i64::from(HEIGHT) - 1) as u32;
                    put(&mut moved, [x, y], picture.pixel(from_x, from_y));
                }
            }
            frame.draw_all_rgb(&moved);
            self.shift_px[k] = [right as f64, down as f64];
        }
        self
    }

    /// Inserts frames of one color before the film.
    pub(super) fn after(mut self, n_frames: usize, rgb: [u8; 3]) -> Staged {
        let mut frame = self.frames[0].clone();
        let mut picture = frame.to_rgb();
        for y in 0..HEIGHT {
            for x in 0..WIDTH {
                put(&mut picture, [x, y], rgb);
            }
        }
        frame.draw_all_rgb(&picture);
        self.frames.splice(0..0, vec![frame; n_frames]);
        self.shown.splice(0..0, vec![None; n_frames]);
        self.shift_px.splice(0..0, vec![[0.0; 2]; n_frames]);
        self
    }

    /// Returns the background without the fish.
    pub(super) fn scene(&self) -> &RgbImage {
        self.film.background()
    }

    /// Returns the motion of the fish in the unedited film.
    pub(super) fn motion(&self) -> &Motion {
        self.film.motion()
    }

    /// Returns the true centroid of the fish, pixels; `None` if the frame does not show it.
    pub(super) fn centroid_px(&self, k: usize) -> Option<[f64; 2]> {
        let centroid = self.film.true_pose(self.shown[k]?).centroid_px?;
        Some([0, 1].map(|c| centroid[c] + self.shift_px[k][c]))
    }

    /// Runs the whole analysis.
    pub(super) fn analyzed(&self, params: &Params) -> Result<Library, Error> {
        let scratch: Arc<dyn Scratch> = Arc::new(InMemory::default());
        analyze(self, None, params, Level::detect(), &scratch, &Silent)
    }

    /// Checks the poses against the truth. The fish is missed in at most 5 % of the frames. The 95th
    /// percentile of the centroid error is below 2 px. The heading is off by more than 90 degrees in at most
    /// 5 % of the frames. Headings more than 60 degrees out of the image plane are not checked.
    pub(super) fn check(&self, name: &str, library: &Library) {
        let poses = &library.poses.frames;
        assert_eq!(poses.len(), self.frames.len(), "{name}");
        let (mut off_px, mut n_turned, mut n_missed) = (Vec::new(), 0, 0);
        for (k, pose) in poses.iter().enumerate() {
            let Some(truth) = self.centroid_px(k) else {
                assert!(!pose.detected(), "{name}: frame {k} shows nothing");
                continue;
            };
            let Some(found) = pose.centroid_px else {
                n_missed += 1;
                continue;
            };
            off_px.push((found[0] - truth[0]).hypot(found[1] - truth[1]));
            let true_pose = self.film.true_pose(self.shown[k].unwrap_or(0));
            let is_level = true_pose.gamma_rad.is_some_and(|gamma| gamma.cos() > 0.5);
            let turn = true_pose.heading_rad.zip(pose.heading_rad);
            let is_turned =
                |(a, b): (f64, f64)| wrap_rad(a - b).abs() > std::f64::consts::FRAC_PI_2;
            n_turned += usize::from(is_level && turn.is_some_and(is_turned));
        }
        off_px.sort_by(f64::total_cmp);
        let p95 = off_px.get(off_px.len() * 95 / 100).copied();
        let most_missed = self.frames.len() / 20;
        assert!(n_missed <= most_missed, "{name}: not found in {n_missed}");
        assert!(p95.is_some_and(|p95| p95 < 2.0), "{name}: {p95:?} px off");
        assert!(
            20 * n_turned <= self.frames.len(),
            "{name}: turned in {n_turned}"
        );
    }
}

/// Sets one pixel.
pub(super) fn put(picture: &mut RgbImage, [x, y]: [u32; 2], rgb: [u8; 3]) {
    let at = 3 * (y * picture.width + x) as usize;
    picture.pixels[at..at + 3].copy_from_slice(&rgb);
}

impl FrameSource for Staged {
    fn format(&self) -> FootageFormat {
        FootageFormat {
            width: WIDTH,
            height: HEIGHT,
            fps: FPS,
            n_frames_hint: self.frames.len(),
            color: self.frames[0].color,
        }
    }

    fn open(&self) -> Result<Box<dyn FrameStream + '_>, SourceError> {
        Ok(Box::new(StagedStream {
            frames: &self.frames,
            n_given: 0,
        }))
    }
}

struct StagedStream<'a> {
    frames: &'a [Frame],
    n_given: usize,
}

impl FrameStream for StagedStream<'_> {
    fn next_frame(&mut self, frame: &mut Frame) -> Result<Option<f64>, SourceError> {
        let Some(next) = self.frames.get(self.n_given) else {
            return Ok(None);
        };
        frame.clone_from(next);
        self.n_given += 1;
        Ok(Some((self.n_given - 1) as f64 / FPS))
    }
}
