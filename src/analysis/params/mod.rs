//! What a person may set about an analysis. Every default is the value of ALGORITHMS.md.

mod hints;

use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

pub use hints::{AnimalAtParam, IgnoreParam};

use super::distance::Clip;
use crate::geometry::Camera;
use crate::library::{Animal, View};

/// Parameters of an analysis; all have defaults.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
#[schema(as = AnalysisParams)]
#[serde(default, deny_unknown_fields)]
pub struct Params {
    /// Frames a second, 0.01..=1000; null = as the file says. With a value every picture of the file is used once.
    pub fps: Option<f64>,
    /// Width of a pixel over its height, 0.1..=10; null = as the file says.
    pub pixel_aspect: Option<f64>,
    /// Where the part that is measured begins, seconds from the file's first frame; null = there. All frames and times
    /// are counted from this.
    pub from_s: Option<f64>,
    /// Where the part that is measured ends, seconds from the file's first frame; null = at the last one.
    pub to_s: Option<f64>,
    /// Where the animal is in one frame: that thing is followed, whatever else moves.
    pub animal_at: Option<AnimalAtParam>,
    /// Boxes in which nothing is taken for the animal, at most 64.
    pub ignore: Vec<IgnoreParam>,
    /// From where the animal is seen; guessed when absent.
    pub view: Option<ViewParam>,
    /// The calibrated camera; without it nothing is given in metres.
    pub camera: Option<CameraParams>,
    /// The animal's known size; without it the depth is null.
    pub animal: Option<AnimalParams>,
    /// Least difference from the background, of 255, that counts as the animal: 1..=254.
    pub threshold: u8,
    /// What to do when several animals move.
    pub follow: Follow,
    /// Whether sprites are cut out of an animal too small to be looked at.
    pub sprites: CutSprites,
    /// At which size sprites are cut out.
    pub scale_mode: ScaleMode,
    /// Where the head is, once and for all, in one frame: decides between head and tail.
    pub head: Option<HeadParam>,
    /// Smooth positions and directions over time; off gives each frame's raw values.
    pub smooth: bool,
    /// f: frames in a clip, 1..=120; null = 8 at 30 frames a second, in proportion to the rate.
    pub clip_frames: Option<u32>,
    /// How much each frame of two clips counts in their distance.
    pub clip_weights: ClipWeights,
    /// Clips nearer than this are alike; null = kappa times the natural step.
    pub epsilon: Option<u64>,
    /// Multiple of the natural step, > 0, when epsilon is null; larger ones are tried where it joins too little.
    pub kappa: f64,
    /// Whether only clips that look roughly alike are compared, which is faster above 50 000 frames and misses
    /// some transitions: `stats.recall` says how many. Those found are transitions all the same.
    pub approximate: bool,
    /// Largest difference of the mean headings of two like clips, degrees, 0..=180.
    pub heading_gate_deg: f64,
    /// Sum over the color planes and alpha (`rgba`), or over the color planes alone (`rgb`, O 3).
    pub planes: Planes,
    /// Whether sprites may also be shown left-right mirrored.
    pub mirror: bool,
    /// How N (7) is read: `corrected`, or `printed` with its quotient upside down.
    pub eq7: Eq7,
    /// How axis and head are told: `corrected`, or as N and O are `printed`.
    pub axis_and_head: AxisAndHead,
}

/// At which size sprites are compared and exported (ALGORITHMS.md 5).
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum ScaleMode {
    /// As filmed (O).
    Native,
    /// In side view at one height, as if the animal had always been as far from the camera, so that what it does
    /// far away compares with what it does near by. Enlarged at most 1.5 times. From above as filmed.
    Depth,
}

/// From where the animal is seen.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum ViewParam {
    /// From the side.
    Side,
    /// From above.
    Top,
}

/// A calibrated camera (N 5.1).
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct CameraParams {
    /// Distance from the camera to the front pane, metres.
    pub z_min_m: f64,
    /// Pixels per metre on the pane.
    pub pane_px_per_m: f64,
    /// The image point straight ahead; null = the middle of the image.
    #[serde(default)]
    pub center_px: Option<[f64; 2]>,
    /// Refractive index behind the pane: 1 (N) for air, 1.333 for water.
    #[serde(default = "air")]
    pub medium_index: f64,
}

/// The animal's size.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct AnimalParams {
    /// From the nose to the tip of the tail, metres.
    pub length_m: f64,
    /// Height of the whole silhouette, fins included, metres.
    pub height_m: f64,
}

/// Where the head is in one frame.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct HeadParam {
    /// The frame.
    pub frame: u32,
    /// A point nearer the head than the tail, pixels.
    pub point: [f64; 2],
}

/// What to do when several animals move.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum Follow {
    /// Refuse the footage with `several_animals`.
    One,
    /// Follow the largest.
    Largest,
}

/// Whether sprites are cut.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum CutSprites {
    /// Unless the animal's median area is below 24 pixels: then the library holds poses alone, and a
    /// flock of it is refused with `animal_too_small`.
    Auto,
    /// Of an animal of any size.
    Always,
}

/// How much each frame of a clip counts.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum ClipWeights {
    /// All the same: O (2).
    Uniform,
    /// Frame k of f by the binomial coefficient of k out of f - 1, so that the middle, where playback jumps,
    /// counts most (Schoedl et al., Video Textures, 2000). f must be at most 24.
    Binomial,
}

/// Which planes are compared.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum Planes {
    /// Premultiplied R, G, B, and alpha.
    Rgba,
    /// Premultiplied R, G, B: O (3).
    Rgb,
}

/// How N (7) is read.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum Eq7 {
    /// z = H z_min / len.
    Corrected,
    /// z = len / H z_min, as printed.
    Printed,
}

/// How the length axis and the head are told.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum AxisAndHead {
    /// The axis with memory, the head by one decision over the whole footage.
    Corrected,
    /// N (4) and 5.3: the arctangent of a quotient gives the axis nearer the horizontal, each frame by
    /// itself. O 3.3: the head is where it was in the frame before, in the first one at +axis.
    Printed,
}

impl Default for Params {
    fn default() -> Params {
        Params {
            fps: None,
            pixel_aspect: None,
            from_s: None,
            to_s: None,
            animal_at: None,
            ignore: Vec::new(),
            view: None,
            camera: None,
            animal: None,
            threshold: 18,
            follow: Follow::One,
            sprites: CutSprites::Auto,
            scale_mode: ScaleMode::Native,
            head: None,
            smooth: true,
            clip_frames: None,
            clip_weights: ClipWeights::Uniform,
            epsilon: None,
            kappa: 2.0,
            approximate: false,
            heading_gate_deg: 15.0,
            planes: Planes::Rgba,
            mirror: true,
            eq7: Eq7::Corrected,
            axis_and_head: AxisAndHead::Corrected,
        }
    }
}

impl Params {
    /// What N and O say, as far as they say it: raw values, axis and head as printed,
    /// RGB planes, no mirror.
    pub fn papers() -> Params {
        Params {
            smooth: false,
            planes: Planes::Rgb,
            mirror: false,
            axis_and_head: AxisAndHead::Printed,
            ..Params::default()
        }
    }

    /// f for a footage of `fps`: as set, or 8 at 30 frames a second in proportion, at least 2.
    pub fn clip_frames_at(&self, fps: f64) -> usize {
        match self.clip_frames {
            Some(frames) => frames as usize,
            None => {
                ((fps * 8.0 / 30.0).round() as usize).clamp(2, self.most_clip_frames() as usize)
            }
        }
    }

    /// A clip of so many frames, weighed as asked for.
    pub fn clip(&self, frames: usize) -> Clip {
        let weights = self.clip_weights;
        Clip { frames, weights }
    }

    /// The camera for an image of the given size, if one was set.
    pub fn camera(&self, width: u32, height: u32) -> Option<Camera> {
        self.camera.map(|camera| Camera {
            z_min_m: camera.z_min_m,
            pane_px_per_m: camera.pane_px_per_m,
            center_px: camera
                .center_px
                .unwrap_or([f64::from(width) / 2.0, f64::from(height) / 2.0]),
            medium_index: camera.medium_index,
        })
    }

    /// The animal's size, if it was set.
    pub fn animal(&self) -> Option<Animal> {
        self.animal.map(|a| Animal {
            length_m: a.length_m,
            height_m: a.height_m,
        })
    }

    /// The view, if it was set.
    pub fn view(&self) -> Option<View> {
        self.view.map(|view| match view {
            ViewParam::Side => View::Side,
            ViewParam::Top => View::Top,
        })
    }

    /// Binomial coefficients of longer clips would exceed what sums of distances hold.
    fn most_clip_frames(&self) -> u32 {
        match self.clip_weights {
            ClipWeights::Uniform => 120,
            ClipWeights::Binomial => 24,
        }
    }

    /// Checks every range; the sentence says which parameter is out of which range.
    pub fn check(&self) -> Result<(), String> {
        let positive = |name: &str, value: f64| {
            (value.is_finite() && value > 0.0)
                .then_some(())
                .ok_or(format!("{name} must be above 0: {value}"))
        };
        positive("kappa", self.kappa)?;
        within("fps", self.fps, 0.01..=1000.0)?;
        within("pixel_aspect", self.pixel_aspect, 0.1..=10.0)?;
        self.check_hints()?;
        if !(0.0..=180.0).contains(&self.heading_gate_deg) {
            return Err(format!(
                "heading_gate_deg must lie in 0..=180: {}",
                self.heading_gate_deg
            ));
        }
        if !(1..=254).contains(&self.threshold) {
            return Err(format!("threshold must lie in 1..=254: {}", self.threshold));
        }
        if let Some(frames) = self.clip_frames
            && !(1..=self.most_clip_frames()).contains(&frames)
        {
            let most = self.most_clip_frames();
            return Err(format!("clip_frames must lie in 1..={most}: {frames}"));
        }
        if let Some(camera) = self.camera {
            positive("camera.z_min_m", camera.z_min_m)?;
            positive("camera.pane_px_per_m", camera.pane_px_per_m)?;
            positive("camera.medium_index", camera.medium_index)?;
            if camera
                .center_px
                .is_some_and(|c| c.iter().any(|v| !v.is_finite()))
            {
                return Err("camera.center_px must be two finite numbers".into());
            }
        }
        if let Some(animal) = self.animal {
            positive("animal.length_m", animal.length_m)?;
            positive("animal.height_m", animal.height_m)?;
        }
        Ok(())
    }
}

/// Checks that a value, where one is set, lies in a range.
fn within(
    name: &str,
    value: Option<f64>,
    range: std::ops::RangeInclusive<f64>,
) -> Result<(), String> {
    match value {
        Some(value) if !range.contains(&value) => Err(format!(
            "{name} must lie in {}..={}: {value}",
            range.start(),
            range.end()
        )),
        _ => Ok(()),
    }
}

fn air() -> f64 {
    1.0
}
