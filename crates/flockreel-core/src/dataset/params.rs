//! Parameters of a data set, with defaults and limits.
//!
//! A range is a list of two numbers, the smallest and the largest. The value of each flock is uniform between
//! them; gains are uniform in their logarithm. A range of two equal numbers fixes the value.

use std::ops::RangeInclusive;

use serde::{Deserialize, Serialize};
use serde_json::{Map, Value};
use smart_default::SmartDefault;
use utoipa::ToSchema;

use crate::flock;
use crate::formats::ground_truth::yolo::Task;
use crate::parameters::Parameters;

/// Parameters of a data set. All have defaults.
#[derive(Clone, Debug, PartialEq, SmartDefault, Serialize, Deserialize, ToSchema)]
#[schema(as = DatasetParams)]
#[serde(default, deny_unknown_fields)]
pub struct Params {
    /// Number of flocks. Each is one sequence of pictures.
    #[default = 20]
    #[schema(minimum = 1, maximum = 100000)]
    pub flocks: u32,
    /// Number of pictures of each flock.
    #[default = 100]
    #[schema(minimum = 1, maximum = 10000)]
    pub pictures: u32,
    /// Every n-th frame of a flock becomes a picture. 1 = all.
    #[default = 1]
    #[schema(minimum = 1, maximum = 1000)]
    pub every: u32,
    /// Random seed of the whole data set.
    #[default = 1]
    pub seed: u64,
    /// Range of the number of individuals, within 1 to 1000.
    #[default(_code = "[2, 20]")]
    #[schema(min_items = 2, max_items = 2)]
    pub count: [u32; 2],
    /// Presets of flocks; each flock has one of them.
    #[default(_code = r#"["school", "swarm", "scatter"].map(String::from).to_vec()"#)]
    #[schema(min_items = 1, max_items = 16)]
    pub presets: Vec<String>,
    /// Parameters that all flocks share, as those of a flock: `{"depth_bl": 4, "rules": {"wander": 1}}`.
    #[schema(value_type = Object)]
    pub flock: Map<String, Value>,
    /// Width and height of all pictures, pixels. null = the size of the footage times `scale`.
    #[schema(min_items = 2, max_items = 2)]
    pub size_px: Option<[u32; 2]>,
    /// Range of the size relative to the footage, within 0.1 to 4.
    #[default(_code = "[0.8, 1.25]")]
    #[schema(min_items = 2, max_items = 2)]
    pub scale: [f64; 2],
    /// Weights of the kinds of background.
    pub backgrounds: Backgrounds,
    /// Range of the share of color that haze takes for each body length of depth, within 0 to 1. From above,
    /// there is no depth.
    #[default(_code = "[0.0, 0.1]")]
    #[schema(min_items = 2, max_items = 2)]
    pub haze_per_bl: [f64; 2],
    /// Range of the darkness of shadows, within 0 to 1. null = as measured in the footage.
    #[schema(min_items = 2, max_items = 2)]
    pub shadow: Option<[f64; 2]>,
    /// Range of the gain of the light, within 0.1 to 10.
    #[default(_code = "[0.75, 1.33]")]
    #[schema(min_items = 2, max_items = 2)]
    pub gain: [f64; 2],
    /// Range of the gain of each color on top of it, within 0.1 to 10.
    #[default(_code = "[0.95, 1.05]")]
    #[schema(min_items = 2, max_items = 2)]
    pub color_gain: [f64; 2],
    /// Range of the standard deviation of the blur, pixels, within 0 to 20.
    #[default(_code = "[0.0, 0.8]")]
    #[schema(min_items = 2, max_items = 2)]
    pub blur_px: [f64; 2],
    /// Range of the standard deviation of the noise, gray levels of 255, within 0 to 100. It comes on top of the
    /// noise of the footage.
    #[default(_code = "[0.0, 5.0]")]
    #[schema(min_items = 2, max_items = 2)]
    pub noise: [f64; 2],
    /// Format of the pictures.
    #[default(Picture::Jpeg)]
    pub picture: Picture,
    /// Range of the quality of JPEG pictures, within 1 to 100.
    #[default(_code = "[70, 95]")]
    #[schema(min_items = 2, max_items = 2)]
    pub jpeg_quality: [u32; 2],
    /// Shares of train, val and test. Whole flocks go to one of them.
    #[default(_code = "[0.8, 0.1, 0.1]")]
    #[schema(min_items = 3, max_items = 3)]
    pub split: [f64; 3],
    /// Label files to write. YOLO has one folder of labels, so at most one of its three kinds is possible.
    #[default(_code = "vec![Format::Coco, Format::Mot, Format::YoloPose, Format::Tracks]")]
    #[schema(min_items = 1, max_items = 16)]
    pub formats: Vec<Format>,
}

/// Weights of the kinds of background; each flock has one kind.
#[derive(Clone, Debug, PartialEq, SmartDefault, Serialize, Deserialize, ToSchema)]
#[schema(as = DatasetBackgrounds)]
#[serde(default, deny_unknown_fields)]
pub struct Backgrounds {
    /// Background of the flock's own footage.
    #[default = 1.0]
    #[schema(minimum = 0, maximum = 1000)]
    pub plate: f64,
    /// One of the given pictures. Without pictures, the weight counts as 0.
    #[default = 1.0]
    #[schema(minimum = 0, maximum = 1000)]
    pub picture: f64,
    /// One plain color.
    #[default = 0.2]
    #[schema(minimum = 0, maximum = 1000)]
    pub color: f64,
}

/// Format of the pictures.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[schema(as = DatasetPicture)]
#[serde(rename_all = "snake_case")]
pub enum Picture {
    /// JPEG.
    Jpeg,
    /// PNG, without loss.
    Png,
}

impl Picture {
    /// Returns the extension of the file names.
    pub fn extension(self) -> &'static str {
        match self {
            Picture::Jpeg => "jpg",
            Picture::Png => "png",
        }
    }
}

/// Label files of a data set.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[schema(as = DatasetFormat)]
#[serde(rename_all = "snake_case")]
pub enum Format {
    /// COCO with masks, boxes and keypoints, one file for each split.
    Coco,
    /// MOTChallenge tracks of each flock.
    Mot,
    /// YOLO boxes.
    YoloDetect,
    /// YOLO outlines.
    YoloSegment,
    /// YOLO boxes and keypoints.
    YoloPose,
    /// DeepLabCut labels of each flock.
    Dlc,
    /// `tracks.csv` and `tracks_dlc.csv` of each flock.
    Tracks,
    /// Label pictures, as in the ground truth of a flock.
    Masks,
    /// Depth order of each pixel.
    Depth,
}

impl Format {
    /// Returns the kind of YOLO labels, if the format is one.
    pub fn yolo(self) -> Option<Task> {
        match self {
            Format::YoloDetect => Some(Task::Detect),
            Format::YoloSegment => Some(Task::Segment),
            Format::YoloPose => Some(Task::Pose),
            _ => None,
        }
    }
}

impl Params {
    /// Returns the kind of YOLO labels to write, if any.
    pub fn yolo(&self) -> Option<Task> {
        self.formats.iter().find_map(|format| format.yolo())
    }

    /// Returns the ranges with their names and limits.
    fn ranges(&self) -> Vec<(&'static str, [f64; 2], RangeInclusive<f64>)> {
        let mut ranges = vec![
            ("count", self.count.map(f64::from), 1.0..=1000.0),
            ("scale", self.scale, 0.1..=4.0),
            ("haze_per_bl", self.haze_per_bl, 0.0..=1.0),
            ("gain", self.gain, 0.1..=10.0),
            ("color_gain", self.color_gain, 0.1..=10.0),
            ("blur_px", self.blur_px, 0.0..=20.0),
            ("noise", self.noise, 0.0..=100.0),
            (
                "jpeg_quality",
                self.jpeg_quality.map(f64::from),
                1.0..=100.0,
            ),
        ];
        ranges.extend(self.shadow.map(|shadow| ("shadow", shadow, 0.0..=1.0)));
        ranges
    }
}

impl Parameters for Params {
    const PRESETS: &'static [&'static str] = &[];

    fn preset(_: &str) -> Option<Params> {
        None
    }

    fn check_combinations(&self) -> Result<(), String> {
        for (name, [low, high], limits) in self.ranges() {
            let (min, max) = limits.into_inner();
            if !(min <= low && low <= high && high <= max) {
                return Err(format!(
                    "{name} must be two numbers in {min}..={max}, the smaller first: {low}, {high}"
                ));
            }
        }
        let known = |name: &String| flock::Params::PRESETS.contains(&name.as_str());
        if let Some(name) = self.presets.iter().find(|name| !known(name)) {
            return Err(format!("the preset is unknown: {name}"));
        }
        if self.presets.is_empty() || self.formats.is_empty() {
            return Err("presets and formats must have at least one entry".into());
        }
        if self.formats.iter().filter_map(|one| one.yolo()).count() > 1 {
            return Err(
                "formats must have at most one of yolo_detect, yolo_segment and yolo_pose".into(),
            );
        }
        let sum: f64 = self.split.iter().sum();
        if self.split.iter().any(|share| *share < 0.0) || (sum - 1.0).abs() > 1e-6 {
            return Err("split must be three shares that add up to 1".into());
        }
        let weights = &self.backgrounds;
        if weights.plate + weights.color <= 0.0 {
            return Err("backgrounds must give plate or color a weight above 0".into());
        }
        for drawn in ["count", "frames", "seed", "preset", "loop"] {
            if self.flock.contains_key(drawn) {
                return Err(format!(
                    "flock must not set {drawn}: the data set chooses it for each flock"
                ));
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn refusal(change: impl Fn(&mut Params)) -> String {
        let mut params = Params::default();
        change(&mut params);
        params.check().expect_err("refused")
    }

    #[test]
    fn defaults_pass_and_faults_are_named() {
        assert_eq!(Params::default().check(), Ok(()));
        let text = refusal(|params| params.noise = [5.0, 2.0]);
        assert!(
            text.starts_with("noise must be two numbers in 0..=100"),
            "{text}"
        );
        let text = refusal(|params| params.formats = vec![Format::YoloPose, Format::YoloDetect]);
        assert!(text.contains("at most one"), "{text}");
        let text = refusal(|params| params.split = [0.5, 0.1, 0.1]);
        assert!(text.starts_with("split"), "{text}");
        let text = refusal(|params| params.presets = vec!["herd".into()]);
        assert_eq!(text, "the preset is unknown: herd");
        let text = refusal(|params| {
            params.flock.insert("seed".into(), 3.into());
        });
        assert!(text.contains("seed"), "{text}");
        assert!(refusal(|params| params.gain = [0.0, 1.0]).starts_with("gain"));
    }
}
