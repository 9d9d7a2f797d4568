//! The value that a flock is: per individual its boid, the frames of its plan, and where and how each
//! is shown (DESIGN.md, flock.json). Numbers are rounded when they are made, so that the file holds
//! exactly what was computed with.

use std::ops::Range;

/// One simulated animal with its sprites.
#[derive(Clone, Debug, PartialEq)]
pub struct Individual {
    /// Its number, from 0.
    pub id: u32,
    /// The source frame shown at each output frame.
    pub source_frame: Vec<u32>,
    /// Whether that is shown left-right mirrored.
    pub mirrored: Vec<bool>,
    /// How far the sprite (mirrored first) is rotated, clockwise positive.
    pub rotation_rad: Vec<f64>,
    /// Who shows the frame after its last, in a loop; that one's first frame is it.
    pub continues_as: Option<u32>,
    /// The second sprites shown around jumps.
    pub fades: Vec<Fade>,
    /// Where the centroid is drawn.
    pub centroid_px: Vec<[f64; 2]>,
    /// The direction of the head as shown.
    pub heading_rad: Vec<f64>,
    /// The direction in space as shown, a unit vector; only where the tank has depth.
    pub forward: Option<Vec<[f64; 3]>>,
    /// Size relative to the footage.
    pub scale: Vec<f64>,
    /// Depth in the camera's frame; only with a camera.
    pub depth_m: Option<Vec<f64>>,
    /// The target that the plan was matched with.
    pub boid: BoidTrack,
    /// What the plan costs.
    pub cost: PlanCost,
}

/// Where a boid was and what it did.
#[derive(Clone, Debug, PartialEq, Default)]
pub struct BoidTrack {
    /// x, y in the picture, and z behind the front of the tank; all in pixels, z at the flock's body length.
    pub position_px: Vec<[f64; 3]>,
    /// Direction of its motion in space, a unit vector; only where the tank has depth.
    pub forward: Option<Vec<[f64; 3]>>,
    /// Direction of its motion in the picture.
    pub heading_rad: Vec<f64>,
    /// Speed in the picture, body lengths a second.
    pub speed_bl_per_s: Vec<f64>,
}

/// A second sprite shown for some frames around a jump: what was shown goes on under what comes.
#[derive(Clone, Debug, PartialEq)]
pub struct Fade {
    /// The first output frame concerned.
    pub start: u32,
    /// The second sprite's source frame at each.
    pub source_frame: Vec<u32>,
    /// Whether the second sprite is mirrored.
    pub mirrored: bool,
    /// Its rotation.
    pub rotation_rad: Vec<f64>,
    /// Its size relative to the footage.
    pub scale: Vec<f64>,
    /// Its weight at each frame, 0..=1; the main sprite has the rest.
    pub weight: Vec<f64>,
}

/// The plan's cost, radians: sums of integers times 2 pi / 65536, to 6 decimals (ALGORITHMS.md 6).
#[derive(Clone, Copy, Debug, PartialEq, Default)]
pub struct PlanCost {
    /// The sum of the five below.
    pub total: f64,
    /// Headings and rotations.
    pub heading: f64,
    /// Speeds.
    pub speed: f64,
    /// Jumps.
    pub transition: f64,
    /// Looking like a neighbor of smaller id.
    pub crowd: f64,
    /// Jumps back to what was just seen.
    pub repetition: f64,
    /// No plan costs less, crowd or not.
    pub lower_bound: f64,
}

impl BoidTrack {
    /// The frames of a range alone.
    pub(super) fn part(&self, range: Range<usize>) -> BoidTrack {
        BoidTrack {
            position_px: self.position_px[range.clone()].to_vec(),
            forward: (self.forward.as_ref()).map(|all| all[range.clone()].to_vec()),
            heading_rad: self.heading_rad[range.clone()].to_vec(),
            speed_bl_per_s: self.speed_bl_per_s[range].to_vec(),
        }
    }

    /// Goes on with another.
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
    /// Cuts off what comes from frame `n_frames` on, as that of an heir who begins there.
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
    /// Whether everything about it is there for every one of `n_frames` frames.
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
            && self.fades.iter().all(|fade| {
                let n = fade.weight.len();
                let lengths = [&fade.rotation_rad, &fade.scale].map(Vec::len);
                (fade.source_frame.len(), lengths) == (n, [n; 2])
                    && fade.start as usize + n <= n_frames
            })
    }
}

/// `value` to so many decimals, as files hold it.
pub(super) fn rounded(value: f64, decimals: i32) -> f64 {
    let unit = 10f64.powi(decimals);
    // + 0.0 turns -0 into 0.
    (value * unit).round() / unit + 0.0
}
