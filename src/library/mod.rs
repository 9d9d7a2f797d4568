//! The library: all that one analysis yields, and all that a flock needs (DESIGN.md, names).
//!
//! Plain values that cannot be wrong once made; `formats` writes and reads them.

pub mod playback;
pub mod pose;
pub mod sprites;

pub use playback::{Jump, Patch, Playback, Transition};
pub use pose::{Animal, BeatSpan, Pose, Poses, Raw, TailBeat, TailBeatMethod, View};
pub use sprites::{Matte, Sprites};

use crate::geometry::Rect;
use crate::raster::{RgbImage, RgbaImage};

/// What one analysis yields.
#[derive(Clone, Debug, PartialEq)]
pub struct Library {
    /// What was measured in every frame.
    pub poses: Poses,
    /// The scene without the animal, of the footage's size.
    pub background: RgbImage,
    /// What stands before the animal and is seen in the background too: its straight color, and as alpha the share of
    /// the pixel that it takes; of the footage's size. `None` when nothing is known to.
    pub occluders: Option<RgbaImage>,
    /// The animal cut out of every frame in which it was found.
    pub sprites: Sprites,
    /// The shadow that it casts, seen from above; `None` where it casts none, or is seen from the side.
    pub shadow: Option<Shadow>,
    /// f: how many sprites a clip holds.
    pub clip_frames: usize,
    /// Clips nearer than this (strictly) are alike.
    pub epsilon: u64,
    /// The median of D(i, i+1): how much the animal changes from one frame to the next.
    pub natural_step: u64,
    /// The pairs of clips that were found alike, by (from, to, mirrored).
    pub transitions: Vec<Transition>,
    /// What may follow what.
    pub playback: Playback,
    /// The runs of sprites between jumps.
    pub patches: Vec<Patch>,
    /// What is worth knowing about the above.
    pub stats: LibraryStats,
}

/// The shadow of an animal on the floor below it: its outline, shifted and blurred.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Shadow {
    /// The share of the light that it takes in its midst, 0..=1.
    pub darkness: f64,
    /// How far from the animal it lies in the picture, x right and y down, body lengths.
    pub offset_bl: [f64; 2],
    /// Standard deviation of the Gaussian that blurs it, body lengths.
    pub blur_bl: f64,
}

/// Something that moved besides the animal.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Mover {
    /// What it seems to be.
    pub kind: MoverKind,
    /// When it was first seen, seconds.
    pub from_s: f64,
    /// When it was last seen, seconds.
    pub to_s: f64,
    /// The box of all its places, in the frame.
    pub box_px: Rect,
}

/// What a mover seems to be.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum MoverKind {
    /// It looks like the animal.
    Animal,
    /// The animal's own image in a mirror, a pane or the water's surface.
    MirrorImage,
    /// It reaches in across the border of the picture: a hand, a person, a cable.
    FromBorder,
    /// It changes where it is: a plant, a clock, a reflection, bedding.
    InPlace,
    /// Something else.
    Other,
}

/// Counts and shares that say how good a library is.
#[derive(Clone, Debug, PartialEq, Default)]
pub struct LibraryStats {
    /// Frames of the footage.
    pub n_frames: usize,
    /// Frames in which the animal was found.
    pub n_detected: usize,
    /// Pixels of the background that the animal never left free: continued from the texture around them
    /// (Efros & Leung 1999), nearest the rim first; past 16384 of them the rest is filled smoothly.
    pub never_seen_px: u64,
    /// Several animals move in the footage, and the largest was followed because that was asked for.
    pub several_animals: bool,
    /// Frames that show another scene than the film (black frames, title cards); nothing is measured in them.
    pub n_foreign_frames: usize,
    /// When the first of them is shown, seconds.
    pub first_foreign_s: Option<f64>,
    /// The animal covers too few pixels for sprites: there are poses alone.
    pub animal_too_small: bool,
    /// Pairs of clips that may be joined (whole, far enough apart, the animal pointing the same way, or turning
    /// alike from above) and have D < epsilon, before only the nearest of those around are kept.
    pub n_candidates: u64,
    /// Of an approximate search, the share of such pairs that it finds, measured on the pairs of 256 clips, 0..=1;
    /// null where all pairs were looked at.
    pub recall: Option<f64>,
    /// Transitions found: pairs that are alike, point the same way and are the best around (O: 72).
    pub n_transitions: usize,
    /// The multiple of the natural step that epsilon is; null when epsilon was given.
    pub kappa_used: Option<f64>,
    /// Share of the frames that lie in the largest strongly connected component, 0..=1.
    pub component_share: f64,
    /// Frames of the component by heading: 36 bins of 10 degrees from -180.
    pub heading_histogram: Vec<u32>,
    /// Measured speeds of the animal, lengths a second: 5th percentile, median, 95th percentile.
    pub speed_bl_per_s: Option<[f64; 3]>,
    /// 95th percentile of the measured turn rate, radians a second.
    pub turn_rate_rad_per_s: Option<f64>,
    /// Length of the animal in the image when seen at length (80th percentile), pixels: the body
    /// length (BL) of the flock.
    pub length_px: Option<f64>,
}
