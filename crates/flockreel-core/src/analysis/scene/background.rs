//! The background: a picture of the scene without the animal, and the noise of each of its pixels
//! (docs/explanation/algorithms.md, "Light and noise").
//!
//! A [`Background`] also holds all that a frame is compared by: thresholds, light probes and block means.
//! `background_estimate` makes the picture.

use super::probes::{self, Probe};
use crate::analysis::silhouette::Blocks;
use crate::geometry::Rect;
use crate::raster::{Frame, RgbImage};

/// Least noise of a pixel, levels of 255. A lossy codec hides noise of the background. Free choice.
pub(super) const MIN_SIGMA: f32 = 1.5;

/// The background: the scene without the animal.
pub struct Background {
    /// The picture, in the decoder's format.
    pub frame: Frame,
    /// The background in RGB.
    pub rgb: RgbImage,
    /// Second color of pixels that scenery sways across; equal to `rgb` elsewhere. Colors between the two
    /// count as background. `None` where nothing sways.
    pub other: Option<RgbImage>,
    /// Noise of each pixel, levels of 255: one standard deviation in the noisiest of R, G and B.
    pub sigma: Vec<f32>,
    /// Difference above which a pixel certainly is foreground, levels of 255: at least the threshold and 4
    /// sigma. `background_estimate` raises it for an animal of high contrast.
    pub core_threshold: Vec<u8>,
    /// Share of `core_threshold` above which a pixel beside a certain one counts, 0..=1.
    pub weak_share: f32,
    /// The pixels at which the light of frames is measured.
    pub probes: Vec<Probe>,
    /// Means and noise of 4 x 4 blocks, which propose boxes for a full comparison.
    pub blocks: Blocks,
    /// Whether the light of frames varies over the picture.
    pub uneven_light: bool,
    /// Brightness of the hard shadow that the animal casts, as a share of the background's; `None` without one.
    pub cast_shadow: Option<f32>,
    /// Index of the light of the scene. Colors of backgrounds are comparable only in the same light.
    pub light: usize,
    /// Number of pixels that the animal never left free; `fill` computed them from their surroundings.
    pub never_seen_px: u64,
}

/// Rule for the difference from which a pixel counts as foreground.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Threshold {
    /// Least core threshold, levels of 255. A pixel of more noise has 4 sigma instead.
    pub core: u8,
    /// Largest core threshold, levels of 255.
    pub max: u8,
    /// Share of the core threshold above which a pixel beside a certain one counts, 0..=1.
    pub weak_share: f32,
}

impl Threshold {
    /// The usual rule. Half the core threshold counts beside a certain pixel: the blurred rim, a translucent
    /// fin.
    pub const fn usual(core: u8) -> Threshold {
        Threshold {
            core,
            max: u8::MAX,
            weak_share: 0.5,
        }
    }

    /// The rule for a busy scene and an animal of high contrast: there is no weak threshold, because the
    /// scene itself differs by half as much. The limit is twice the core threshold, because the animal is
    /// known to differ by that much. A higher one would make holes in the animal where the scene changed.
    pub const fn raised(core: u8) -> Threshold {
        Threshold {
            core,
            max: core.saturating_mul(2),
            weak_share: 1.0,
        }
    }
}

impl Background {
    /// Returns a background from a picture and the noise of its pixels, under the usual threshold.
    pub(in crate::analysis) fn new(frame: Frame, sigma: Vec<f32>, threshold: u8) -> Background {
        let rgb = frame.to_rgb();
        Background {
            probes: probes::of_background(&rgb),
            rgb,
            core_threshold: core_thresholds(&sigma, Threshold::usual(threshold)),
            blocks: Blocks::new(&frame),
            frame,
            other: None,
            sigma,
            weak_share: Threshold::usual(threshold).weak_share,
            uneven_light: false,
            cast_shadow: None,
            light: 0,
            never_seen_px: 0,
        }
    }

    /// Returns a background from a picture, with the least noise at every pixel.
    pub(super) fn without_noise(frame: Frame, threshold: u8) -> Background {
        let n_px = frame.luma().len();
        Background::new(frame, vec![MIN_SIGMA; n_px], threshold)
    }

    /// Replaces the picture; noise and thresholds stay.
    pub(super) fn set_picture(&mut self, frame: Frame) {
        self.rgb = frame.to_rgb();
        self.probes = probes::of_background(&self.rgb);
        self.blocks = Blocks::new(&frame);
        self.frame = frame;
    }

    /// Sets the thresholds of all pixels.
    pub(super) fn set_threshold(&mut self, threshold: Threshold) {
        self.core_threshold = core_thresholds(&self.sigma, threshold);
        self.weak_share = threshold.weak_share;
    }

    /// Returns the index in the picture of pixel `k` of a box.
    pub fn px_in(&self, rect: Rect, k: usize) -> usize {
        let width = rect.w as usize;
        (rect.y as usize + k / width) * self.frame.width as usize + rect.x as usize + k % width
    }

    /// Returns the color of a pixel, levels of 255.
    pub fn color(&self, px: usize) -> [f32; 3] {
        [0, 1, 2].map(|c| f32::from(self.rgb.pixels[3 * px + c]))
    }

    /// Returns the difference above which a pixel beside a certain one counts, levels of 255.
    pub fn weak_threshold(&self, px: usize) -> u8 {
        (f32::from(self.core_threshold[px]) * self.weak_share) as u8
    }
}

fn core_thresholds(sigma: &[f32], threshold: Threshold) -> Vec<u8> {
    let [min, max] = [threshold.core, threshold.max].map(f32::from);
    let at_pixel = |s: &f32| (4.0 * s).max(min).min(max) as u8;
    sigma.iter().map(at_pixel).collect()
}
