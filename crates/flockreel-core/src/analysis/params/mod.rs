//! Parameters of an analysis, with defaults, limits and presets. docs/explanation/algorithms.md explains the
//! defaults.

mod hints;

use serde::{Deserialize, Serialize};
use smart_default::SmartDefault;
use utoipa::ToSchema;

pub use hints::{AnimalAtParam, IgnoreParam};

use super::similarity::distance::Clip;
use crate::geometry::Camera;
use crate::library::{Animal, View};
use crate::parameters::{CoordinatePx, Parameters};

/// Parameters of an analysis. All have defaults.
#[derive(Clone, Debug, PartialEq, SmartDefault, Serialize, Deserialize, ToSchema)]
#[schema(as = AnalysisParams)]
#[serde(default, deny_unknown_fields)]
pub struct Params {
    /// Frame rate, frames per second. null = as the file says. If it is set, each picture of the file is used
    /// once, whatever its time.
    #[schema(minimum = 0.01, maximum = 1000)]
    pub fps: Option<f64>,
    /// Width of a pixel divided by its height. null = as the file says.
    #[schema(minimum = 0.1, maximum = 10)]
    pub pixel_aspect: Option<f64>,
    /// Start of the measured part, seconds from the first frame of the file. null = the first frame. Frames
    /// keep their numbers and times in the film; frames outside of the part count as frames without the
    /// animal.
    #[schema(minimum = 0, maximum = 1000000)]
    pub from_s: Option<f64>,
    /// End of the measured part, seconds from the first frame of the file. null = the last frame.
    #[schema(exclusive_minimum = 0, maximum = 1000000)]
    pub to_s: Option<f64>,
    /// Position of the animal in one frame. The analysis follows the object there, whatever else moves.
    pub animal_at: Option<AnimalAtParam>,
    /// Boxes in which nothing counts as the animal.
    #[schema(max_items = 64)]
    pub ignore: Vec<IgnoreParam>,
    /// View from which the animal was filmed. null = guessed.
    pub view: Option<ViewParam>,
    /// Calibrated camera. null = no results in metres.
    pub camera: Option<CameraParams>,
    /// Size of the animal. null = unknown, so there are no results in metres.
    pub animal: Option<AnimalParams>,
    /// Smallest difference from the background that counts as the animal, on the scale of brightness from 0
    /// to 255.
    #[default = 18]
    #[schema(minimum = 1, maximum = 254)]
    pub threshold: u8,
    /// Behavior when several animals move: `one` refuses the footage, `largest` follows the largest animal.
    #[default(Follow::One)]
    pub follow: Follow,
    /// Whether to cut out an animal with a median area below 24 square pixels: `auto` does not, `always`
    /// does. Without cut-out pictures there is no flock.
    #[default(CutSprites::Auto)]
    pub sprites: CutSprites,
    /// Scale of the sprites: `native` as filmed. `depth` gives the animal the same height in all frames (side
    /// view only).
    #[default(ScaleMode::Native)]
    pub scale_mode: ScaleMode,
    /// Position of the head in one frame. It decides which end of the animal is the head.
    pub head: Option<HeadParam>,
    /// Whether to smooth positions and directions over time. false = the raw values of each frame.
    #[default = true]
    pub smooth: bool,
    /// Length of a clip (the successive frames that are compared together), frames. null = 8 at 30 frames per
    /// second, in proportion to the frame rate. At most 24 with `clip_weights: binomial`.
    #[schema(minimum = 1, maximum = 120)]
    pub clip_frames: Option<u32>,
    /// Weights of the frames of a clip in the distance: `uniform`, or `binomial`, where the middle frames
    /// count most.
    #[default(ClipWeights::Uniform)]
    pub clip_weights: ClipWeights,
    /// Distance below which two clips are similar. null = `kappa` times the natural step, the median distance
    /// of successive clips.
    #[schema(maximum = 9000000000000000u64)] // numbers in JSON are exact up to here
    pub epsilon: Option<u64>,
    /// If `epsilon` is null, it is `kappa` times the natural step. A larger value allows more jumps, but they
    /// may be visible. If playback is too short, the analysis tries larger values.
    #[default = 2.0]
    #[schema(exclusive_minimum = 0, maximum = 1000000)]
    pub kappa: f64,
    /// Largest difference between the mean headings of two similar clips in side view, degrees.
    #[default = 15.0]
    #[schema(minimum = 0, maximum = 180)]
    pub heading_gate_deg: f64,
    /// Image planes that are compared: color and alpha (`rgba`), or color only (`rgb`, Okabe et al., equation
    /// 3).
    #[default(Planes::Rgba)]
    pub planes: Planes,
    /// Whether sprites may also be shown mirrored.
    #[default = true]
    pub mirror: bool,
    /// Reading of Nakajima et al., equation 7: `corrected`, or `printed`, with the quotient inverted.
    #[default(Eq7::Corrected)]
    pub eq7: Eq7,
    /// Method for the length axis and the head: `corrected`, or `printed` as in the two papers.
    #[default(AxisAndHead::Corrected)]
    pub axis_and_head: AxisAndHead,
}

/// Scale at which sprites are compared and exported.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum ScaleMode {
    /// As filmed (Okabe et al.).
    Native,
    /// In side view, scaled to a constant height, so that near and far moments are comparable; enlarged at
    /// most 1.5 times. In top view as filmed.
    Depth,
}

/// View from which the animal was filmed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum ViewParam {
    /// From the side.
    Side,
    /// From above.
    Top,
}

/// A calibrated camera (Nakajima et al., section 5.1).
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct CameraParams {
    /// Distance from the camera to the front pane, metres.
    #[schema(minimum = 0.000001, maximum = 10000)]
    pub z_min_m: f64,
    /// Pixels per metre of a ruler held on the pane.
    #[schema(minimum = 0.000001, maximum = 1000000000)]
    pub pane_px_per_m: f64,
    /// Image point on the optical axis, pixels. null = the center of the image.
    #[serde(default)]
    #[schema(value_type = Option<[CoordinatePx; 2]>, inline, default = json!(null), min_items = 2, max_items = 2)]
    pub center_px: Option<[f64; 2]>,
    /// Refractive index behind the pane: 1 for air (Nakajima et al.), 1.333 for water.
    #[serde(default = "air")]
    #[schema(default = air, minimum = 0.1, maximum = 10)]
    pub medium_index: f64,
}

/// The size of the animal.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct AnimalParams {
    /// Length from the nose to the tip of the tail, metres.
    #[schema(minimum = 0.000001, maximum = 10000)]
    pub length_m: f64,
    /// Height of the silhouette, fins included, metres.
    #[schema(minimum = 0.000001, maximum = 10000)]
    pub height_m: f64,
}

/// The position of the head in one frame.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct HeadParam {
    /// Frame number, counted from 0.
    pub frame: u32,
    /// A point nearer to the head than to the tail, pixels.
    #[schema(value_type = [CoordinatePx; 2], inline, min_items = 2, max_items = 2)]
    pub point: [f64; 2],
}

/// Behavior when several animals move.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum Follow {
    /// Refuse the footage with `several_animals`.
    One,
    /// Follow the largest animal.
    Largest,
}

/// Whether to cut out sprites.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum CutSprites {
    /// Yes, unless the median area of the animal is below 24 square pixels. The library then contains poses
    /// only, and a flock from it is refused with `animal_too_small`.
    Auto,
    /// Yes, for an animal of any size.
    Always,
}

/// Weights of the frames of a clip.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum ClipWeights {
    /// Equal weights (Okabe et al., equation 2).
    Uniform,
    /// Frame k of f has the binomial coefficient of k out of f - 1 as weight. The middle, where playback
    /// jumps, counts most (Schoedl et al., Video Textures, 2000). f is at most 24.
    Binomial,
}

/// Image planes that are compared.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum Planes {
    /// Premultiplied R, G, B, and alpha.
    Rgba,
    /// Premultiplied R, G, B (Okabe et al., equation 3).
    Rgb,
}

/// Reading of Nakajima et al., equation 7.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum Eq7 {
    /// z = H z_min / len.
    Corrected,
    /// z = len / H z_min, as printed.
    Printed,
}

/// Method for the length axis and the head.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum AxisAndHead {
    /// The axis follows from the previous frames, the head from one decision over the whole footage.
    Corrected,
    /// Nakajima et al., equation 4 and section 5.3: the arctangent of a quotient gives the axis nearer to the
    /// horizontal, for each frame separately. Okabe et al., section 3.3: the head stays at the end where it
    /// was in the previous frame, and starts at the positive end of the axis.
    Printed,
}

impl Params {
    /// Returns the preset `papers`, as far as the papers specify the parameters: raw values, axis and head as
    /// printed, RGB planes, no mirroring.
    pub fn papers() -> Params {
        Params {
            smooth: false,
            planes: Planes::Rgb,
            mirror: false,
            axis_and_head: AxisAndHead::Printed,
            ..Params::default()
        }
    }

    /// Returns the clip length f for a frame rate, in frames: as set, or in proportion to 8 at 30 frames per
    /// second, at least 2.
    pub fn clip_frames_at(&self, fps: f64) -> usize {
        match self.clip_frames {
            Some(frames) => frames as usize,
            None => ((fps * 8.0 / 30.0).round() as usize).clamp(2, self.max_clip_frames() as usize),
        }
    }

    /// Returns a clip of `frames` frames with the chosen weights.
    pub fn clip(&self, frames: usize) -> Clip {
        let weights = self.clip_weights;
        Clip { frames, weights }
    }

    /// Returns the camera for an image of the given size, if one is set.
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

    /// Returns the size of the animal, if it is set.
    pub fn animal(&self) -> Option<Animal> {
        self.animal.map(|a| Animal {
            length_m: a.length_m,
            height_m: a.height_m,
        })
    }

    /// Returns the view, if it is set.
    pub fn view(&self) -> Option<View> {
        self.view.map(|view| match view {
            ViewParam::Side => View::Side,
            ViewParam::Top => View::Top,
        })
    }

    /// Returns the largest clip length, frames. Binomial coefficients of longer clips would overflow the
    /// distances.
    pub(crate) fn max_clip_frames(&self) -> u32 {
        match self.clip_weights {
            ClipWeights::Uniform => 120,
            ClipWeights::Binomial => 24,
        }
    }
}

impl Parameters for Params {
    const PRESETS: &'static [&'static str] = &["papers"];

    fn preset(name: &str) -> Option<Params> {
        (name == "papers").then(Params::papers)
    }

    fn check_combinations(&self) -> Result<(), String> {
        self.check_hints()?;
        let max = self.max_clip_frames();
        match self.clip_frames {
            Some(frames) if frames > max => {
                Err(format!("clip_frames must lie in 1..={max}: {frames}"))
            }
            _ => Ok(()),
        }
    }
}

fn air() -> f64 {
    1.0
}
