//! The library: the result of one analysis and the input of a flock.
//!
//! The types here are plain values without I/O. `formats` writes and reads them (docs/reference/formats.md,
//! "library.json").

pub mod motion;
mod part;
pub mod playback;
pub mod pose;
pub mod scale;
pub mod sprites;
pub mod zones;

pub use playback::{Jump, Patch, Playback, Transition};
pub use pose::{Animal, BeatSpan, BodyPose, Pose, Poses, RawPose, TailBeat, TailBeatMethod, View};
pub use scale::{Scale, ScaleError};
pub use sprites::{Matte, Sprites};
pub use zones::Zones;

use crate::geometry::Rect;
use crate::raster::{RgbImage, RgbaImage};

/// Confidence above which a frame surely shows the animal. Free choice.
const SURE: f64 = 0.9;

/// The result of one analysis.
#[derive(Clone, Debug, PartialEq)]
pub struct Library {
    /// Measurements of every frame.
    pub poses: Poses,
    /// The background: the scene without the animal, of the footage's size.
    pub background: RgbImage,
    /// Foreground objects that hide parts of the animal and are part of the background too. Color is straight
    /// and alpha is the share of the pixel that the object covers; of the footage's size. `None` if none are
    /// known.
    pub occluders: Option<RgbaImage>,
    /// The animal cut out of every frame in which it was found.
    pub sprites: Sprites,
    /// The shadow of the animal. `None` if it casts none or the view is from the side.
    pub shadow: Option<Shadow>,
    /// Number of sprites in a clip: f in Okabe et al.
    pub clip_frames: usize,
    /// Distance below which (strictly) two clips are similar.
    pub epsilon: u64,
    /// Median of D(i, i+1), the distance between successive clips: the natural change from frame to frame.
    pub natural_step: u64,
    /// Pairs of similar clips, sorted by (from, to, mirrored).
    pub transitions: Vec<Transition>,
    /// The playback graph: which frames may follow which.
    pub playback: Playback,
    /// Runs of sprites between jumps.
    pub patches: Vec<Patch>,
    /// Statistics of this library.
    pub stats: LibraryStats,
}

impl Library {
    /// Returns the centroids of the frames in which the whole animal was surely seen, pixels. Frames that
    /// playback may show always count.
    pub fn places_px(&self) -> impl Iterator<Item = [f64; 2]> {
        let size = self.poses.image_size_px.map(f64::from);
        let is_shown = |frame: usize| {
            self.playback
                .component
                .binary_search(&(frame as u32))
                .is_ok()
        };
        let frames = self.poses.frames.iter().enumerate();
        frames
            .filter(move |(frame, pose)| {
                (pose.confidence.is_some_and(|p| p > SURE) && !pose.cut) || is_shown(*frame)
            })
            .filter_map(|(_, pose)| pose.centroid_px)
            .filter(move |place| (0..2).all(|k| (0.0..=size[k]).contains(&place[k])))
    }
}

/// The shadow of an animal on the floor below it: the animal's outline, shifted and blurred.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Shadow {
    /// Share of the light that the shadow removes at its center, 0..=1.
    pub darkness: f64,
    /// Offset of the shadow from the animal in the picture, x right and y down, body lengths.
    pub offset_bl: [f64; 2],
    /// Standard deviation of the Gaussian blur, body lengths.
    pub blur_bl: f64,
}

/// A moving object other than the animal.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Mover {
    /// Classification.
    pub kind: MoverKind,
    /// Time at which the object is first seen, seconds.
    pub from_s: f64,
    /// Time at which the object is last seen, seconds.
    pub to_s: f64,
    /// Bounding box of all its positions, in the frame.
    pub box_px: Rect,
}

/// Classification of a moving object.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum MoverKind {
    /// An object that looks like the animal.
    Animal,
    /// The reflection of the animal in a mirror, a pane or the water surface.
    MirrorImage,
    /// An object that enters across the border of the picture: a hand, a person, a cable.
    FromBorder,
    /// An object that changes in place: a plant, a clock, a reflection, bedding.
    InPlace,
    /// Anything else.
    Other,
}

/// A time in which the whole picture differs from the background: the camera or the light has changed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Disturbance {
    /// Cause.
    pub kind: DisturbanceKind,
    /// Time at which it begins, seconds.
    pub from_s: f64,
    /// Time at which it ends, seconds.
    pub to_s: f64,
}

/// Cause of a difference of the whole picture.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum DisturbanceKind {
    /// The camera shakes, or its focus hunts.
    Camera,
    /// The light has another brightness or color.
    Light,
}

/// Counts and shares that describe the quality of a library.
#[derive(Clone, Debug, PartialEq, Default)]
pub struct LibraryStats {
    /// Number of frames of the footage.
    pub n_frames: usize,
    /// Number of frames in which the animal was found.
    pub n_detected: usize,
    /// Number of background pixels that the animal never left free. They are filled with the texture around
    /// them (Efros & Leung 1999), starting at the edge; beyond 16384 pixels the rest is interpolated
    /// smoothly.
    pub never_seen_px: u64,
    /// Number of background pixels in which a part of the animal rested so long that it was taken for background
    /// at first.
    pub still_px: u64,
    /// Whether several animals move in the footage and the largest was followed, as requested.
    pub several_animals: bool,
    /// Number of frames that show another scene (black frames, title cards). They are not measured.
    pub n_foreign_frames: usize,
    /// Time of the first such frame, seconds; null if there is none.
    pub first_foreign_s: Option<f64>,
    /// Times in which the camera shakes, its focus hunts, or the light differs; in order of time for each kind.
    pub disturbances: Vec<Disturbance>,
    /// Whether the animal covers too few pixels for sprites. The library then holds poses only.
    pub animal_too_small: bool,
    /// Number of pairs of clips with D < epsilon that may be joined, before the selection of local minima.
    /// Such clips are complete and far enough apart; the animal has the same heading, or from above the same
    /// turn rate.
    pub n_candidates: u64,
    /// Number of transitions: pairs that are also local minima of the distance (72 in Okabe et al.).
    pub n_transitions: usize,
    /// Ratio of epsilon to the natural step; null if epsilon was given.
    pub kappa_used: Option<f64>,
    /// Share of the frames that lie in the largest strongly connected component, 0..=1.
    pub component_share: f64,
    /// Number of frames of the component by heading: 36 bins of 10 degrees from -180.
    pub heading_histogram: Vec<u32>,
    /// Measured speed of the animal, body lengths per second: 5th percentile, median, 95th percentile.
    pub speed_bl_per_s: Option<[f64; 3]>,
    /// 95th percentile of the measured turn rate, radians per second.
    pub turn_rate_rad_per_s: Option<f64>,
    /// Body length (BL) of the flock: 80th percentile of the animal's length in the image, pixels.
    pub length_px: Option<f64>,
}
