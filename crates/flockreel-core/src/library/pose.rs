//! Poses: the measurements of each frame (docs/reference/formats.md, "poses.json"). A value that could not be
//! measured is `None`, never a guess.

use super::Mover;
use crate::geometry::{Camera, Rect};

/// The camera's viewpoint.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum View {
    /// From the side: gravity points down in the picture.
    Side,
    /// From above: no direction of the picture is special.
    Top,
}

/// Known size of the animal.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Animal {
    /// Length from the nose to the tip of the tail, metres.
    pub length_m: f64,
    /// Dorsoventral extent of the whole silhouette, including fins, metres.
    pub height_m: f64,
}

/// The poses of a footage, one for each frame.
#[derive(Clone, Debug, PartialEq)]
pub struct Poses {
    /// Frame rate, frames per second.
    pub fps: f64,
    /// Width and height in square pixels.
    pub image_size_px: [u32; 2],
    /// The camera's viewpoint.
    pub view: View,
    /// Probability that the view was detected correctly, 0.5..=1; `None` if it was given.
    pub view_confidence: Option<f64>,
    /// Moving objects other than the animal, ordered by the time at which they are first seen.
    pub other_movers: Vec<Mover>,
    /// The camera; `None` if it was not given.
    pub camera: Option<Camera>,
    /// Size of the animal; `None` if it was not given.
    pub animal: Option<Animal>,
    /// One pose for each frame of the footage, in order.
    pub frames: Vec<Pose>,
    /// Tail beat frequency; `None` if it could not be measured.
    pub tail_beat: Option<TailBeat>,
}

impl Poses {
    /// Returns the tail beat frequency in a frame, beats per second; `None` if it was not measured there.
    pub fn tail_beat_hz(&self, frame_idx: usize) -> Option<f64> {
        let spans = &self.tail_beat.as_ref()?.spans;
        let span = (spans.iter()).find(|s| (s.frames[0]..s.frames[1]).contains(&frame_idx))?;
        Some(span.frequency_hz)
    }
}

/// Measured tail beats.
#[derive(Clone, Debug, PartialEq)]
pub struct TailBeat {
    /// The signal that was measured.
    pub method: TailBeatMethod,
    /// Spans in which the beat exceeds the noise, in order and without overlap; at least one.
    pub spans: Vec<BeatSpan>,
}

/// Signal from which the tail beat was measured.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TailBeatMethod {
    /// Bend of the midline (top view).
    Bend,
    /// Length and skew of the silhouette (side view).
    LengthAndSkew,
}

/// A span with one tail beat frequency.
#[derive(Clone, Debug, PartialEq)]
pub struct BeatSpan {
    /// The first frame and the frame after the last.
    pub frames: [usize; 2],
    /// Start, seconds from the first frame of the footage, at the constant frame rate.
    pub start_s: f64,
    /// End, in the same unit.
    pub end_s: f64,
    /// Beats per second. One stroke to the left and one to the right make one beat.
    pub frequency_hz: f64,
    /// Amplitude: of the bend, radians, or of the length, as a share of the length.
    pub amplitude: f64,
    /// 1 - (noise floor / power), 0.75..=1.
    pub confidence: f64,
}

/// Measurements of one frame.
#[derive(Clone, Debug, PartialEq, Default)]
pub struct Pose {
    /// True time of the picture, seconds from the first frame.
    pub time_s: f64,
    /// Whether the silhouette touches the border of the image.
    pub cut: bool,
    /// Probability that the centroid lies within a tenth of the body length of the true one, 0.5..=1.
    pub confidence: Option<f64>,
    /// Posterior probability that `heading_rad` points to the head, 0.5..=1.
    pub head_confidence: Option<f64>,
    /// Posterior probability of the sign of `forward[2]`, 0.5..=1.
    pub depth_sign_confidence: Option<f64>,
    /// Centroid of the silhouette, pixels (Nakajima et al., equation 2). The center of the first pixel is
    /// (0.5, 0.5).
    pub centroid_px: Option<[f64; 2]>,
    /// Bounding box of the silhouette.
    pub box_px: Option<Rect>,
    /// Area of the silhouette, pixels.
    pub area_px: Option<f64>,
    /// Direction of the length axis, radians, in (-pi/2, pi/2].
    pub axis_rad: Option<f64>,
    /// Direction in which the head points, radians, in (-pi, pi].
    pub heading_rad: Option<f64>,
    /// Extent of the silhouette along the length axis, pixels.
    pub length_px: Option<f64>,
    /// Extent of the silhouette along the height axis, pixels.
    pub height_px: Option<f64>,
    /// Third standardized moment along the length axis, positive in the direction of `axis_rad`.
    pub skew: Option<f64>,
    /// Midline points from head to tail, pixels; top view only.
    pub midline_px: Option<Vec<[f64; 2]>>,
    /// Angle of the last third of the midline against the first third, radians.
    pub bend_rad: Option<f64>,
    /// Position in camera coordinates, metres: x right, y down, z away.
    pub position_m: Option<[f64; 3]>,
    /// Unit vector of the animal's direction in space, camera coordinates.
    pub forward: Option<[f64; 3]>,
    /// atan2(dz, dx) of `forward`, radians.
    pub yaw_rad: Option<f64>,
    /// asin(dy) of `forward`, radians; positive is nose down.
    pub pitch_rad: Option<f64>,
    /// Angle between `forward` and the image plane, radians, 0..=pi/2 (Nakajima et al., equation 8).
    pub gamma_rad: Option<f64>,
    /// Pose from this frame only, before smoothing over all frames.
    pub raw: Option<RawPose>,
    /// Bend of the body and fins; `None` unless the animal is a model.
    pub body: Option<BodyPose>,
}

/// Bend of a body with a spine of 8 joints, and spread of its tail fin.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BodyPose {
    /// Angle of each joint from head to tail, radians; positive moves the part behind it to the animal's left.
    pub joint_angles_rad: [f64; 8],
    /// Angle between the body's axis and the line from the first joint to the tail tip, radians; positive to
    /// the animal's left.
    pub tail_tip_rad: f64,
    /// Angle between the two lobes of the tail fin, seen from its root, radians.
    pub fin_spread_rad: f64,
}

/// Estimates from one frame only (Nakajima et al., sections 5 and 6).
#[derive(Clone, Copy, Debug, PartialEq, Default)]
pub struct RawPose {
    /// Heading along the length axis, radians, in (-pi, pi].
    pub heading_rad: Option<f64>,
    /// Position from the height of the silhouette, metres.
    pub position_m: Option<[f64; 3]>,
    /// Direction from the foreshortening of the length. The change of depth decides between away and toward.
    pub forward: Option<[f64; 3]>,
    /// Angle to the image plane, radians, 0..=pi/2 (Nakajima et al., equation 8).
    pub gamma_rad: Option<f64>,
}

impl Pose {
    /// Returns whether the animal was found in the frame; its confidence is then at least 0.5.
    pub fn detected(&self) -> bool {
        self.centroid_px.is_some()
    }
}
