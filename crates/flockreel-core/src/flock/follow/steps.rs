//! Filmed steps and turns, as individuals with `position: film` show them.

use crate::flock::placement::{Placer, is_jump};
use crate::geometry::wrap_rad;

/// Time before and after a frame over which the mean speed is taken, seconds. Free choice.
const SPEED_SPAN_S: f64 = 0.25;

/// Headings, radians, and positions, pixels, of an individual by frame.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Trajectory {
    pub(super) heading_rad: Vec<f64>,
    pub(super) centroid_px: Vec<[f64; 2]>,
}

impl Trajectory {
    pub(super) fn append(&mut self, later: Trajectory) {
        self.heading_rad.extend(later.heading_rad);
        self.centroid_px.extend(later.centroid_px);
    }
}

impl Placer<'_> {
    /// Returns the filmed step as shown, rotated and scaled, without a correction, pixels.
    pub(super) fn shown_step_px(
        &self,
        before: (u32, bool),
        state: (u32, bool),
        heading_rad: f64,
        scale: f64,
    ) -> [f64; 2] {
        let turn = self.rotation(state, heading_rad);
        turned(self.filmed_step_px(before, state), turn, scale)
    }

    /// Returns the filmed turn, radians. At a jump, the turn rate at the target over one frame.
    pub(super) fn filmed_turn_rad(&self, before: (u32, bool), state: (u32, bool)) -> f64 {
        if !is_jump(before, state) {
            return wrap_rad(self.source_heading(state) - self.source_heading(before));
        }
        let rate = self.motion[state.0 as usize].turn_rad_per_s / self.library.poses.fps;
        if state.1 { -rate } else { rate }
    }

    /// Returns the filmed step, pixels. At a jump, the velocity at the target over one frame.
    pub(super) fn filmed_step_px(&self, before: (u32, bool), state: (u32, bool)) -> [f64; 2] {
        let poses = &self.library.poses.frames;
        let [from, to] = [before, state].map(|state| poses[state.0 as usize].centroid_px);
        let step = match (is_jump(before, state), from, to) {
            (false, Some(from), Some(to)) => [to[0] - from[0], to[1] - from[1]],
            _ => {
                let velocity = self.motion[state.0 as usize].velocity_bl_per_s;
                velocity.map(|v| v * self.lens.length_px / self.library.poses.fps)
            }
        };
        if state.1 { [-step[0], step[1]] } else { step }
    }

    /// Returns the mean speed in the frames around `frame`, body lengths per second.
    pub(super) fn speed_around(&self, frame: u32) -> f64 {
        let reach = (SPEED_SPAN_S * self.library.poses.fps).round() as usize;
        let frame = frame as usize;
        let around = frame.saturating_sub(reach)..(frame + reach + 1).min(self.motion.len());
        let speeds = self.motion[around].iter().map(|moved| moved.speed_bl_per_s);
        speeds.clone().sum::<f64>() / speeds.len() as f64
    }
}

/// Returns a step, rotated and scaled.
fn turned(step: [f64; 2], turn_rad: f64, scale: f64) -> [f64; 2] {
    let (cos, sin) = (scale * libm::cos(turn_rad), scale * libm::sin(turn_rad));
    [cos * step[0] - sin * step[1], sin * step[0] + cos * step[1]]
}
