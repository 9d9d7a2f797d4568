//! Sample film: footage of the virtual fish in which every pose is known exactly.
//!
//! A goldfish swims at random in a planted tank and is filmed from the side, or in a tank of gravel from above,
//! with a little sensor noise. The
//! film is shown to new users, and the analysis is tested against it
//! (docs/explanation/algorithms.md, "Quality measures"). Each frame can be drawn independently of the
//! others.

use std::f64::consts::FRAC_1_SQRT_2;

use glam::{DQuat, DVec3};
use rayon::prelude::*;

use super::error::Error;
use super::film::Film;
use super::mesh::Mesh;
use super::motion::{Motion, Posture, bank_rad, rotation_of};
use super::params::{Palette, Params};
use super::render::Drawing;
use super::scenery::{gravel_scene, tank_scene};
use super::spine::{
    ORIGIN_S, Swimming, bend_of_turn_bl, effort_at, joint_frames, spine_at_m, tail_tip_rad,
};
use super::swimmer::{self, PANE_Z_M, SwimmerState, TANK_M};
use crate::footage::{FootageFormat, FrameSource, FrameStream, SourceError};
use crate::geometry::{Camera, Rect};
use crate::library::{Animal, BodyPose, Pose, Poses, View};
use crate::random;
use crate::raster::{Frame, RgbImage};

/// Parameters of the sample film.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SampleParams {
    /// Number of frames, 1..=1000000.
    pub n_frames: usize,
    /// Random seed of the path, the scene and the noise.
    pub seed: u64,
    /// Frames a second, 1..=240.
    pub fps: f64,
    /// Width in pixels, 64..=7680.
    pub width: u32,
    /// Height in pixels, 64..=4320.
    pub height: u32,
    /// Colors of the fish.
    pub palette: Palette,
    /// Side from which the tank is filmed.
    pub view: View,
    /// Standard deviation of the luma noise, in 8-bit levels, 0..=20.
    pub noise: f64,
}

impl Default for SampleParams {
    fn default() -> SampleParams {
        SampleParams {
            n_frames: 1200,
            seed: 1,
            fps: 30.0,
            width: 640,
            height: 480,
            palette: Palette::Goldfish,
            view: View::Side,
            noise: 1.7,
        }
    }
}

/// Sample film.
pub struct SampleFilm {
    params: SampleParams,
    film: Film,
    noise: Vec<i8>,
}

/// Width of the picture at the tank's front pane, in metres: the tank plus a margin. Free choice.
const PANE_WIDTH_M: f64 = 0.64;

impl SampleFilm {
    /// Returns the film. Fails if a parameter is out of range.
    pub fn new(params: SampleParams) -> Result<SampleFilm, Error> {
        check(&params)?;
        let size = Params::default().size(None);
        let states = swimmer::simulate(params.seed, params.n_frames, params.fps, size.length_m);
        let (width, height) = (params.width, params.height);
        let motion = Motion {
            fps: params.fps,
            image_size_px: [width, height],
            camera: Camera {
                z_min_m: PANE_Z_M,
                pane_px_per_m: f64::from(width) / PANE_WIDTH_M,
                center_px: [f64::from(width) / 2.0, f64::from(height) / 2.0],
                medium_index: 1.0,
            },
            size,
            center_s: ORIGIN_S,
            frames: states
                .iter()
                .map(|s| seen_from(params.view, posture(s, size)))
                .collect(),
            beat_hz: 0.0,
            beats: vec![None; params.n_frames],
        };
        let scene = match params.view {
            View::Side => tank_scene(width, height, params.seed),
            View::Top => gravel_scene(width, height, params.seed),
        };
        Ok(SampleFilm {
            film: Film::new(motion, Mesh::goldfish(size, params.palette), scene),
            noise: noise_table(params.seed, params.noise, width),
            params,
        })
    }

    /// Returns the motion of the fish.
    pub fn motion(&self) -> &Motion {
        self.film.motion()
    }

    /// Returns the scene without fish and without noise.
    pub fn background(&self) -> &RgbImage {
        self.film.background()
    }

    /// Returns the size of the drawn silhouette, without translucent edges.
    pub fn animal(&self) -> Animal {
        let mesh = self.film.renderer().mesh();
        let extent = |axis| {
            let [lo, hi] = mesh.extent_m(axis);
            hi - lo
        };
        Animal {
            length_m: extent(0),
            height_m: extent(1),
        }
    }

    /// Returns the exact poses of all frames. The silhouette consists of the pixels that the fish covers by
    /// more than one half. The midline is the image of the spine. Axis, extents and `bend_rad` are `None`:
    /// their values depend on the definition of the measurement.
    pub fn truth(&self) -> Poses {
        let frames = (0..self.params.n_frames).into_par_iter();
        Poses {
            tail_beat: None,
            fps: self.params.fps,
            image_size_px: [self.params.width, self.params.height],
            view: self.params.view,
            view_confidence: None,
            other_movers: Vec::new(),
            camera: Some(self.motion().camera),
            animal: Some(self.animal()),
            frames: frames.map(|k| self.true_pose(k)).collect(),
        }
    }

    /// Returns the exact pose of one frame. Panics beyond the last frame.
    pub fn true_pose(&self, frame_idx: usize) -> Pose {
        let posture = &self.motion().frames[frame_idx];
        let (position, forward) = (posture.position_m, posture.forward());
        // Direction in which the image of the fish moves when the fish moves along `forward`.
        let toward = forward * position.z - position * forward.z;
        Pose {
            time_s: frame_idx as f64 / self.params.fps,
            confidence: Some(1.0),
            head_confidence: Some(1.0),
            depth_sign_confidence: Some(1.0),
            heading_rad: Some(libm::atan2(toward.y, toward.x)),
            position_m: Some(position.to_array()),
            forward: Some(forward.to_array()),
            yaw_rad: Some(libm::atan2(forward.z, forward.x)),
            pitch_rad: Some(libm::asin(forward.y.clamp(-1.0, 1.0))),
            gamma_rad: Some(libm::asin(forward.z.abs().min(1.0))),
            midline_px: Some(self.midline_px(posture)),
            body: Some(self.body(posture)),
            ..silhouette(&self.film.draw(frame_idx), &self.params)
        }
    }

    /// Returns the image of 11 points of the spine, at equal distances from the nose to the tail tip.
    fn midline_px(&self, posture: &Posture) -> Vec<[f64; 2]> {
        let Motion { camera, size, .. } = self.motion();
        let joints = joint_frames(size.length_m, &posture.joint_angles_rad);
        let image = |k: usize| {
            let at = spine_at_m(size.length_m, &joints, k as f64 / 10.0);
            camera.image_from_camera((posture.position_m + posture.rotation * at).to_array())
        };
        (0..=10).map(image).collect()
    }

    fn body(&self, posture: &Posture) -> BodyPose {
        BodyPose {
            joint_angles_rad: posture.joint_angles_rad,
            tail_tip_rad: tail_tip_rad(&posture.joint_angles_rad),
            fin_spread_rad: self.film.renderer().mesh().tail_spread_rad(),
        }
    }

    /// Draws one frame with noise into `frame`. Panics beyond the last frame.
    pub fn render(&self, frame_idx: usize, frame: &mut Frame) {
        self.film.render(frame_idx, frame);
        let (width, chroma_width) = (frame.width as usize, frame.chroma_width() as usize);
        let n_luma = width * frame.height as usize;
        let (luma, chroma) = frame.planes.split_at_mut(n_luma);
        for (row, line) in luma.chunks_exact_mut(width).enumerate() {
            add_noise(line, self.noise_of(frame_idx, row), 1);
        }
        for (row, line) in chroma.chunks_exact_mut(chroma_width).enumerate() {
            add_noise(line, self.noise_of(frame_idx, n_luma + row), 2);
        }
    }

    /// Returns the part of the noise table for one row of one plane.
    fn noise_of(&self, frame_idx: usize, row: usize) -> &[i8] {
        let word = random::bits(self.params.seed, &[NOISE, frame_idx as u64, row as u64]);
        &self.noise[word as usize % NOISE_STARTS..]
    }
}

impl FrameSource for SampleFilm {
    fn format(&self) -> FootageFormat {
        FootageFormat {
            width: self.params.width,
            height: self.params.height,
            fps: self.params.fps,
            n_frames_hint: self.params.n_frames,
            color: Default::default(),
        }
    }

    fn open(&self) -> Result<Box<dyn FrameStream + '_>, SourceError> {
        Ok(Box::new(SampleStream {
            film: self,
            next: 0,
            ready: Vec::new(),
        }))
    }
}

/// Stream of the sample film. Frames are drawn in batches, on all threads.
struct SampleStream<'a> {
    film: &'a SampleFilm,
    next: usize,
    ready: Vec<Frame>,
}

/// Number of frames in a batch. Free choice.
const BATCH: usize = 16;

impl FrameStream for SampleStream<'_> {
    fn next_frame(&mut self, frame: &mut Frame) -> Result<Option<f64>, SourceError> {
        let n_frames = self.film.params.n_frames;
        if self.next == n_frames {
            return Ok(None);
        }
        let at = self.next % BATCH;
        if at == 0 {
            let batch = self.next..(self.next + BATCH).min(n_frames);
            self.ready.resize(BATCH, Frame::default());
            let frames = self.ready.par_iter_mut().zip(batch);
            frames.for_each(|(frame, k)| self.film.render(k, frame));
        }
        frame.clone_from(&self.ready[at]);
        let time_s = self.next as f64 / self.film.params.fps;
        self.next += 1;
        Ok(Some(time_s))
    }
}

fn check(params: &SampleParams) -> Result<(), Error> {
    let within = |name: &str, value: f64, lo: f64, hi: f64| {
        if (lo..=hi).contains(&value) {
            return Ok(());
        }
        let message = format!("{name} must lie in {lo}..={hi}: {value}");
        Err(Error::InvalidParams(message))
    };
    within("frames", params.n_frames as f64, 1.0, 1e6)?;
    within("fps", params.fps, 1.0, 240.0)?;
    within("width", f64::from(params.width), 64.0, 7680.0)?;
    within("height", f64::from(params.height), 64.0, 4320.0)?;
    within("noise", params.noise, 0.0, 20.0)
}

fn posture(state: &SwimmerState, size: Animal) -> Posture {
    let speed_bl_per_s = state.speed_m_per_s / size.length_m;
    let swimming = Swimming {
        phase_turns: state.phase_turns,
        effort: effort_at(speed_bl_per_s),
        bend_bl: bend_of_turn_bl(state.turn_rad_per_s),
    };
    let limit_rad = Params::default().bank_rad;
    let roll = bank_rad(state.turn_rad_per_s, state.speed_m_per_s, limit_rad);
    let rotation = rotation_of(state.yaw_rad, state.pitch_rad, roll);
    Posture {
        joint_angles_rad: swimming.joint_angles_rad(),
        ..Posture::at(state.position_m, rotation)
    }
}

/// Returns the posture in the frame of the camera that films the tank. The swimmer's own frame is that of the
/// camera at the side. The camera above has the front pane at the lower edge of its picture, and the water
/// surface at the distance at which the other one has the pane.
fn seen_from(view: View, posture: Posture) -> Posture {
    if view == View::Side {
        return posture;
    }
    let [_, height_m, depth_m] = TANK_M;
    let DVec3 { x, y, z } = posture.position_m;
    Posture {
        position_m: DVec3::new(
            x,
            PANE_Z_M + 0.5 * depth_m - z,
            y + PANE_Z_M + 0.5 * height_m,
        ),
        rotation: DQuat::from_xyzw(FRAC_1_SQRT_2, 0.0, 0.0, FRAC_1_SQRT_2) * posture.rotation,
        ..posture
    }
}

/// Returns a pose with centroid, box and area of the pixels covered by more than one half. Its fields are
/// empty if there are none.
fn silhouette(drawing: &Drawing, params: &SampleParams) -> Pose {
    let rect = drawing.rect;
    let (mut n, mut sum) = (0u64, [0u64; 2]);
    let mut bounds = Rect::default();
    for y in 0..rect.h {
        for x in (0..rect.w).filter(|&x| drawing.alpha(x, y) > 0.5) {
            let (px, py) = (rect.x + x, rect.y + y);
            bounds = bounds.union(&Rect::new(px, py, 1, 1));
            sum = [sum[0] + u64::from(px), sum[1] + u64::from(py)];
            n += 1;
        }
    }
    if n == 0 {
        return Pose::default();
    }
    let reaches_end = bounds.right() == params.width || bounds.bottom() == params.height;
    Pose {
        cut: bounds.x == 0 || bounds.y == 0 || reaches_end,
        centroid_px: Some(sum.map(|s| s as f64 / n as f64 + 0.5)),
        box_px: Some(bounds),
        area_px: Some(n as f64),
        ..Pose::default()
    }
}

/// First key word of the noise's random numbers.
const NOISE: u64 = 0x6e_6f69_7365;
/// Number of positions in the noise table at which a row may start. Free choice.
const NOISE_STARTS: usize = 1 << 17;

/// Returns a table of normally distributed noise, long enough for a row of `width` from any start.
fn noise_table(seed: u64, sigma: f64, width: u32) -> Vec<i8> {
    let draw = |k: u64| (sigma * random::normal(seed, &[NOISE, k])).round() as i8;
    (0..NOISE_STARTS as u64 + u64::from(width))
        .into_par_iter()
        .map(draw)
        .collect()
}

/// Adds noise to a row, divided by `divisor`. Chroma averages over a block and therefore takes half of the
/// noise.
fn add_noise(line: &mut [u8], noise: &[i8], divisor: i16) {
    for (value, &n) in line.iter_mut().zip(noise) {
        *value = (i16::from(*value) + i16::from(n) / divisor).clamp(0, 255) as u8;
    }
}

#[cfg(test)]
mod tests;
