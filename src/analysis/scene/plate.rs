//! The plate: a picture of the scene without the animal, and how much each of its pixels wavers (ALGORITHMS.md 2.4).

use super::light;
use crate::analysis::silhouette::Blocks;
use crate::raster::{Frame, RgbImage};

/// Least noise of a pixel, levels of 255. The background of a lossy codec looks steadier than it is.
pub(super) const SIGMA_FLOOR: f32 = 1.5;

/// The scene without the animal.
pub struct Plate {
    /// The picture, as the decoder would give it.
    pub frame: Frame,
    /// The same picture in RGB.
    pub rgb: RgbImage,
    /// The second color of pixels that something sways across, and the color of `rgb` everywhere else. Colors
    /// between the two are no difference. `None` where nothing sways.
    pub other: Option<RgbImage>,
    /// Noise of each pixel (the largest over R, G, B), one standard deviation, levels of 255.
    pub sigma: Vec<f32>,
    /// Least difference that certainly is no background, levels of 255: max(threshold, 4 sigma).
    pub core_threshold: Vec<u8>,
    /// Pixels beside those count from this share of it on.
    pub weak_share: f32,
    /// The pixels whose light is compared.
    pub probes: Vec<light::Probe>,
    /// Means and noise of 4 x 4 blocks, to find places worth a closer look.
    pub blocks: Blocks,
    /// The light of frames differs over the picture.
    pub uneven_light: bool,
    /// Which light it was filmed in; colors of one light are comparable.
    pub light: usize,
    /// Pixels that the animal never left free. They continue the texture around them (Efros & Leung 1999).
    pub never_seen_px: u64,
}

/// From which difference on a pixel counts.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Threshold {
    /// Least difference that certainly is no background, levels of 255; 4 sigma where that is more ...
    pub core: u8,
    /// ... but at most this.
    pub most: u8,
    /// Share of it from which a pixel counts beside one that certainly does.
    pub weak_share: f32,
}

impl Threshold {
    /// Half counts beside the whole: the blurred rim of the animal, a fin that lets light through.
    pub const fn usual(core: u8) -> Threshold {
        Threshold {
            core,
            most: u8::MAX,
            weak_share: 0.5,
        }
    }

    /// Where the scene differs by half as much, only the whole counts. The animal is known to differ by twice as much; a
    /// higher threshold, where the scene was changed meanwhile, would make holes in it.
    pub const fn raised(core: u8) -> Threshold {
        Threshold {
            core,
            most: core.saturating_mul(2),
            weak_share: 1.0,
        }
    }
}

impl Plate {
    /// A plate from a picture and the noise of its pixels.
    pub(in crate::analysis) fn of(frame: Frame, sigma: Vec<f32>, threshold: u8) -> Plate {
        let rgb = frame.to_rgb();
        Plate {
            probes: light::probes(&rgb),
            rgb,
            core_threshold: core_thresholds(&sigma, Threshold::usual(threshold)),
            blocks: Blocks::of(&frame),
            frame,
            other: None,
            sigma,
            weak_share: Threshold::usual(threshold).weak_share,
            uneven_light: false,
            light: 0,
            never_seen_px: 0,
        }
    }

    /// A plate from a picture alone, with the least noise.
    pub(super) fn without_noise(frame: Frame, threshold: u8) -> Plate {
        let n_px = frame.luma().len();
        Plate::of(frame, vec![SIGMA_FLOOR; n_px], threshold)
    }

    /// Sets from which difference on a pixel counts.
    pub(super) fn set_threshold(&mut self, threshold: Threshold) {
        self.core_threshold = core_thresholds(&self.sigma, threshold);
        self.weak_share = threshold.weak_share;
    }

    /// Least difference of a pixel beside one that certainly is no background, levels of 255.
    pub fn weak_threshold(&self, px: usize) -> u8 {
        (f32::from(self.core_threshold[px]) * self.weak_share) as u8
    }
}

fn core_thresholds(sigma: &[f32], threshold: Threshold) -> Vec<u8> {
    let [least, most] = [threshold.core, threshold.most].map(f32::from);
    let of = |s: &f32| (4.0 * s).max(least).min(most) as u8;
    sigma.iter().map(of).collect()
}
