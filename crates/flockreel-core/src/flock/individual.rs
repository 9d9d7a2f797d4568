//! The individuals of a flock: for each one its boid, the source frames of its plan, and how each frame is
//! shown (docs/reference/formats.md, "flock.json").
//!
//! Numbers are rounded when they are computed, so that the file holds exactly the numbers used.

use std::ops::Range;

use serde::{Deserialize, Serialize};

/// One simulated animal with its sprites. Lists have one entry per output frame, except `fades`.
#[derive(Clone, Debug, PartialEq)]
pub struct Individual {
    /// Index, from 0.
    pub id: u32,
    /// Source frame shown.
    pub source_frame: Vec<u32>,
    /// Whether the sprite is mirrored left to right.
    pub mirrored: Vec<bool>,
    /// Rotation of the sprite after mirroring, radians, clockwise positive.
    pub rotation_rad: Vec<f64>,
    /// In a loop, the id of the individual whose first frame follows the last frame. `None` outside loops.
    pub continues_as: Option<u32>,
    /// Second sprites shown around jumps.
    pub fades: Vec<Fade>,
    /// Position at which the centroid is drawn, pixels.
    pub centroid_px: Vec<[f64; 2]>,
    /// Heading as shown, radians.
    pub heading_rad: Vec<f64>,
    /// Direction in space as shown, a unit vector. `None` if the tank has no depth.
    pub forward: Option<Vec<[f64; 3]>>,
    /// Size relative to the footage.
    pub scale: Vec<f64>,
    /// Depth in the camera frame, metres. `None` if the scale in metres is unknown.
    pub depth_m: Option<Vec<f64>>,
    /// Track of the boid that the plan is matched to.
    pub boid: BoidTrack,
    /// Size relative to the filmed animal; `scale` includes it.
    pub size: f64,
    /// State of motion of the animal in the source frame. Empty in files of schema 1.
    pub state: Vec<MotionState>,
    /// Whether something carries the animal in the source frame. Empty from above, where the floor may, and in
    /// older files.
    pub carried: Vec<bool>,
    /// Cost of the plan.
    pub cost: PlanCost,
}

/// State of motion of the animal, by its speed in the image. The usual speed is the median speed of the playable
/// frames in which the animal does not rest.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum MotionState {
    /// Less than 0.1 body lengths per second.
    Rest,
    /// Less than half the usual speed.
    Slow,
    /// From half to twice the usual speed.
    Go,
    /// At least twice the usual speed.
    Dart,
}

/// Track of a boid, with one entry per output frame.
#[derive(Clone, Debug, PartialEq, Default)]
pub struct BoidTrack {
    /// x and y in the image, and z behind the front of the tank, pixels. For z, a body length has
    /// `Flock::length_px` pixels at every depth.
    pub position_px: Vec<[f64; 3]>,
    /// Direction of motion in space, a unit vector. `None` if the tank has no depth.
    pub forward: Option<Vec<[f64; 3]>>,
    /// Direction of motion in the image, radians.
    pub heading_rad: Vec<f64>,
    /// Speed in the image, body lengths per second.
    pub speed_bl_per_s: Vec<f64>,
}

/// A second sprite around a jump. Before the jump it shows the frames that lead up to the new one, after it
/// the frames that follow the old one. Lists have one entry per frame of the fade.
#[derive(Clone, Debug, PartialEq)]
pub struct Fade {
    /// First output frame of the fade.
    pub start: u32,
    /// Source frame of the second sprite.
    pub source_frame: Vec<u32>,
    /// Whether the second sprite is mirrored.
    pub mirrored: bool,
    /// Rotation of the second sprite, radians.
    pub rotation_rad: Vec<f64>,
    /// Size of the second sprite relative to the footage.
    pub scale: Vec<f64>,
    /// Weight of the second sprite, 0..=1. The main sprite has the rest.
    pub weight: Vec<f64>,
}

/// Cost of a plan, radians. Each value is a sum of integers times 2 pi / 65536, rounded to 6 decimals
/// (docs/explanation/algorithms.md, "Planning").
#[derive(Clone, Copy, Debug, PartialEq, Default)]
pub struct PlanCost {
    /// Sum of the five costs below.
    pub total: f64,
    /// Cost of heading errors and rotations.
    pub heading: f64,
    /// Cost of speed errors.
    pub speed: f64,
    /// Cost of the distances of jumps.
    pub transition: f64,
    /// Cost of showing nearly the same frame as a neighbor of smaller id.
    pub crowd: f64,
    /// Cost of jumps back to what was just shown.
    pub repetition: f64,
    /// Lower bound of the total of any plan, with or without the crowd cost. For a flock planned in segments,
    /// the sum of their bounds. 0 for a plan that is not exact.
    pub lower_bound: f64,
    /// Whether no cheaper plan exists. Plans with `position: film` also weigh places, which are not part of
    /// the total.
    pub exact: bool,
}

impl BoidTrack {
    /// Returns the part of the track within a range of frames.
    pub(super) fn part(&self, range: Range<usize>) -> BoidTrack {
        BoidTrack {
            position_px: self.position_px[range.clone()].to_vec(),
            forward: (self.forward.as_ref()).map(|all| all[range.clone()].to_vec()),
            heading_rad: self.heading_rad[range.clone()].to_vec(),
            speed_bl_per_s: self.speed_bl_per_s[range].to_vec(),
        }
    }

    /// Appends a later track.
    pub(super) fn append(&mut self, later: BoidTrack) {
        self.position_px.extend(later.position_px);
        if let (Some(forward), Some(later)) = (&mut self.forward, later.forward) {
            forward.extend(later);
        }
        self.heading_rad.extend(later.heading_rad);
        self.speed_bl_per_s.extend(later.speed_bl_per_s);
    }
}

impl Fade {
    /// Splits off the part from frame `n_frames` on, or returns `None` if there is none. The part starts at
    /// frame 0, because in a loop it belongs to the individual that follows.
    pub(super) fn split_off(&mut self, n_frames: usize) -> Option<Fade> {
        let at = n_frames.saturating_sub(self.start as usize);
        if at >= self.weight.len() {
            return None;
        }
        Some(Fade {
            start: 0,
            source_frame: self.source_frame.split_off(at),
            mirrored: self.mirrored,
            rotation_rad: self.rotation_rad.split_off(at),
            scale: self.scale.split_off(at),
            weight: self.weight.split_off(at),
        })
    }
}

impl Individual {
    /// Returns whether all lists have an entry for each of `n_frames` frames and all fades lie within them.
    pub fn is_complete(&self, n_frames: usize) -> bool {
        let boid = &self.boid;
        let lengths = [
            self.source_frame.len(),
            self.mirrored.len(),
            self.rotation_rad.len(),
            self.centroid_px.len(),
            self.heading_rad.len(),
            self.scale.len(),
            self.depth_m.as_ref().map_or(n_frames, Vec::len),
            self.forward.as_ref().map_or(n_frames, Vec::len),
            boid.forward.as_ref().map_or(n_frames, Vec::len),
            boid.position_px.len(),
            boid.heading_rad.len(),
            boid.speed_bl_per_s.len(),
        ];
        lengths.iter().all(|&length| length == n_frames)
            && [&self.state.len(), &self.carried.len()]
                .iter()
                .all(|&&n| [0, n_frames].contains(&n))
            && self.fades.iter().all(|fade| {
                let n = fade.weight.len();
                let lengths = [&fade.rotation_rad, &fade.scale].map(Vec::len);
                (fade.source_frame.len(), lengths) == (n, [n; 2])
                    && fade.start as usize + n <= n_frames
            })
    }
}
