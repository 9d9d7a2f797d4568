//! Poses: what is measured in each frame. What could not be measured is `None`, never invented.

use super::Mover;
use crate::geometry::{Camera, Rect};

/// From where the animal is seen.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum View {
    /// From the side: gravity points down in the picture.
    Side,
    /// From above: no direction of the picture is special.
    Top,
}

/// The known size of the animal.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Animal {
    /// From the nose to the tip of the tail, metres.
    pub length_m: f64,
    /// Dorsoventral extent of the whole silhouette, fins included, metres.
    pub height_m: f64,
}

/// The poses of a footage, one for every frame.
#[derive(Clone, Debug, PartialEq)]
pub struct Poses {
    /// Frames a second.
    pub fps: f64,
    /// Width and height in square pixels.
    pub image_size_px: [u32; 2],
    /// From where the animal is seen.
    pub view: View,
    /// The probability that the view was guessed right, .5..=1; `None` where it was given.
    pub view_confidence: Option<f64>,
    /// What moved besides the animal, by the first time it was seen.
    pub other_movers: Vec<Mover>,
    /// The camera, when it was given.
    pub camera: Option<Camera>,
    /// The animal's size, when it was given.
    pub animal: Option<Animal>,
    /// One entry for every frame of the footage, in order.
    pub frames: Vec<Pose>,
    /// How often the tail beats, where that can be told.
    pub tail_beat: Option<TailBeat>,
}

impl Poses {
    /// Tail beats a second in a frame, where they were measured.
    pub fn tail_beat_hz(&self, frame_idx: usize) -> Option<f64> {
        let spans = &self.tail_beat.as_ref()?.spans;
        let span = (spans.iter()).find(|s| (s.frames[0]..s.frames[1]).contains(&frame_idx))?;
        Some(span.frequency_hz)
    }
}

/// How often the tail beats.
#[derive(Clone, Debug, PartialEq)]
pub struct TailBeat {
    /// What swings with the tail.
    pub method: TailBeatMethod,
    /// Where it stands out of the noise, in order and apart; at least one.
    pub spans: Vec<BeatSpan>,
}

/// What the tail beat was measured by.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TailBeatMethod {
    /// The bend of the midline, seen from above.
    Bend,
    /// The length and the skew of the silhouette, seen from the side.
    LengthAndSkew,
}

/// A while in which the tail beats at one rate.
#[derive(Clone, Debug, PartialEq)]
pub struct BeatSpan {
    /// The first frame and the one after the last.
    pub frames: [usize; 2],
    /// Seconds from the first frame of the footage, at its constant rate.
    pub start_s: f64,
    /// Likewise.
    pub end_s: f64,
    /// Beats a second: one to the left and one to the right is one beat.
    pub frequency_hz: f64,
    /// Of the bend, radians; of the length, as a share of it.
    pub amplitude: f64,
    /// 1 less the noise floor over the power, 0.75..=1.
    pub confidence: f64,
}

/// What was measured in one frame.
#[derive(Clone, Debug, PartialEq, Default)]
pub struct Pose {
    /// True time of the picture, seconds from the first frame.
    pub time_s: f64,
    /// The silhouette touches the border of the image.
    pub cut: bool,
    /// Probability that the centroid lies within a tenth of the body length of the true one, 0.5..=1.
    pub confidence: Option<f64>,
    /// Posterior probability of the head being where `heading_rad` says, 0.5..=1.
    pub head_confidence: Option<f64>,
    /// Posterior probability of the sign of `forward[2]`, 0.5..=1.
    pub depth_sign_confidence: Option<f64>,
    /// Centroid of the silhouette, N (2); the centre of the first pixel is (0.5, 0.5).
    pub centroid_px: Option<[f64; 2]>,
    /// Bounding box of the silhouette.
    pub box_px: Option<Rect>,
    /// Area of the silhouette, pixels.
    pub area_px: Option<f64>,
    /// Direction of the length axis, in (-pi/2, pi/2].
    pub axis_rad: Option<f64>,
    /// Direction in which the head points, in (-pi, pi].
    pub heading_rad: Option<f64>,
    /// Extent of the silhouette along the length axis.
    pub length_px: Option<f64>,
    /// Extent of the silhouette along the height axis.
    pub height_px: Option<f64>,
    /// Third standardised moment along the length axis, positive toward +axis.
    pub skew: Option<f64>,
    /// Points from head to tail, top view only.
    pub midline_px: Option<Vec<[f64; 2]>>,
    /// Angle of the last third of the midline against the first third.
    pub bend_rad: Option<f64>,
    /// Position in the camera frame, metres: x right, y down, z away.
    pub position_m: Option<[f64; 3]>,
    /// Unit vector of the direction in space.
    pub forward: Option<[f64; 3]>,
    /// atan2(dz, dx) of `forward`.
    pub yaw_rad: Option<f64>,
    /// asin(dy) of `forward`: positive = nose down.
    pub pitch_rad: Option<f64>,
    /// Angle between the direction in space and the image plane, N (8), 0..=pi/2.
    pub gamma_rad: Option<f64>,
    /// What this frame alone says of the same, before all frames were looked at together.
    pub raw: Option<Raw>,
}

/// Values of one frame alone (N 5 and 6).
#[derive(Clone, Copy, Debug, PartialEq, Default)]
pub struct Raw {
    /// Along the length axis, in (-pi, pi].
    pub heading_rad: Option<f64>,
    /// From the height of the silhouette, metres.
    pub position_m: Option<[f64; 3]>,
    /// From the share of the length that is seen; away or toward by the change of depth.
    pub forward: Option<[f64; 3]>,
    /// N (8), 0..=pi/2.
    pub gamma_rad: Option<f64>,
}

impl Pose {
    /// True when the animal was found in the frame: its confidence is 0.5 at least.
    pub fn detected(&self) -> bool {
        self.centroid_px.is_some()
    }
}
