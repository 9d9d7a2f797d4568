//! Hard shadows that the animal casts on a wall or a floor.
//!
//! A cast shadow darkens the background evenly: over it, the ratio of frame and background is equal in all
//! channels and varies little. It is a lump beside the body that keeps its distance and direction as long as
//! lamp and camera stand still. See docs/explanation/algorithms.md, "Silhouette".

use std::ops::RangeInclusive;

use super::Difference;
use crate::analysis::scene::background::Background;
use crate::geometry::Rect;
use crate::order;
use crate::raster::Mask;
use crate::raster::runs::{self, Component, Run};

/// Brightness of a cast shadow as a share of the background's. A weaker one is soft, a stronger one cannot be
/// told from a black animal. Free choice.
const BRIGHTNESS: RangeInclusive<f32> = 0.3..=0.97;
/// Largest deviation between channels, and between pixels nearby, as a share of the brightness. Free choice.
const MAX_DEVIATION: f32 = 0.12;
/// Half side of the square whose deviation is measured, pixels. Free choice.
const RADIUS: i64 = 2;
/// Level added to frame and background, so that noise near black changes the ratio little. Free choice.
const OFFSET: f32 = 8.0;
/// A shadow lump has this share of a component's area, in this share of the components. Free choice.
const MIN_LUMP_SHARE: f64 = 0.2;
const MIN_FREQUENCY: f64 = 0.4;
/// Least distance of the lump from the rest of its component, in lengths of the component, and as a multiple
/// of its spread. Free choice.
const MIN_DISTANCE: f64 = 0.2;
const MIN_STEADINESS: f64 = 3.0;
/// Range of brightness below the usual one that still is shadow. Free choice.
const TOLERANCE: f32 = 0.1;

/// The lump is seen at this number of places at least, and these are apart by this many lengths of the component: the
/// pale tail of a resting animal keeps its distance too. Free choice.
const MIN_PLACES: usize = 4;
const MIN_STEP: f64 = 0.5;

/// The largest lump of shadow in a component.
pub struct Lump {
    /// Centroid of the component, pixels.
    place_px: [f64; 2],
    /// Length of the component, pixels.
    length_px: f64,
    /// Share of the component's area, 0..=1; 0 without a lump.
    share: f64,
    /// From the rest of the component to the lump, lengths of the component.
    offset: [f64; 2],
    /// Median brightness as a share of the background's.
    brightness: f64,
}

impl Lump {
    /// Returns the largest lump of shadow in a component. `difference` covers its box.
    pub fn largest(
        difference: &Difference,
        background: &Background,
        component: &Component,
    ) -> Lump {
        let rect = component.rect;
        let own = component.mask(rect);
        let mut shadow = Shadow::of(difference, background, BRIGHTNESS).broad;
        (shadow.bits.iter_mut().zip(&own.bits)).for_each(|(bit, own)| *bit &= own);
        let lumps = runs::components(&shadow).into_iter();
        let lump = lumps
            .max_by_key(|lump| lump.area)
            .filter(|lump| lump.area < component.area);
        let place_px = component.centroid_px();
        let mut found = Lump {
            place_px,
            length_px: f64::from(rect.w.max(rect.h)),
            share: 0.0,
            offset: [0.0; 2],
            brightness: 1.0,
        };
        if let Some(lump) = lump {
            found.share = lump.area as f64 / component.area as f64;
            // The centroid of the rest follows from those of the whole and of the lump.
            let from_whole = [0, 1].map(|axis| lump.centroid_px()[axis] - place_px[axis]);
            found.offset = from_whole.map(|px| px / (1.0 - found.share) / found.length_px);
            let in_lump = lump.mask(rect);
            let inside = (0..in_lump.bits.len()).filter(|&k| in_lump.bits[k] == 1);
            let levels = inside.map(|k| f64::from(brightness(difference, background, k)[0]));
            found.brightness = order::median(levels).unwrap_or(1.0);
        }
        found
    }
}

/// Returns the brightness of the shadow that an animal casts, from the lumps of its components; `None` if it casts
/// none.
pub fn usual_brightness(lumps: &[Lump]) -> Option<f32> {
    let clear: Vec<&Lump> = lumps
        .iter()
        .filter(|lump| lump.share >= MIN_LUMP_SHARE)
        .collect();
    let mut apart: Vec<&Lump> = Vec::new();
    for lump in &clear {
        let is_near = |other: &&Lump| {
            let [dx, dy] = [0, 1].map(|axis| lump.place_px[axis] - other.place_px[axis]);
            libm::hypot(dx, dy) < MIN_STEP * lump.length_px
        };
        if !apart.iter().any(is_near) {
            apart.push(lump);
        }
    }
    if apart.len() < MIN_PLACES || (clear.len() as f64) < MIN_FREQUENCY * lumps.len() as f64 {
        return None;
    }
    let middle = [0, 1].map(|axis| order::median(clear.iter().map(|lump| lump.offset[axis])));
    let [x, y] = [middle[0]?, middle[1]?];
    let spread = clear
        .iter()
        .map(|lump| libm::hypot(lump.offset[0] - x, lump.offset[1] - y));
    let distance = libm::hypot(x, y);
    let is_cast = distance > MIN_DISTANCE && distance > MIN_STEADINESS * order::median(spread)?;
    let brightness = order::median(clear.iter().map(|lump| lump.brightness))?;
    is_cast.then_some(brightness as f32)
}

/// Clears the pixels of the shadow that the animal casts.
pub fn remove(mask: &mut Mask, difference: &Difference, background: &Background, usual: f32) {
    let range = usual - TOLERANCE..=*BRIGHTNESS.end();
    let shadow = Shadow::of(difference, background, range).with_rim();
    for (bit, shadow) in mask.bits.iter_mut().zip(shadow.bits) {
        *bit &= 1 - shadow;
    }
}

/// Pixels that may be cast shadow.
struct Shadow {
    /// Pixels that are darker by equal shares in all channels.
    even: Mask,
    /// Those of broad parts that vary little.
    broad: Mask,
}

impl Shadow {
    fn of(difference: &Difference, background: &Background, range: RangeInclusive<f32>) -> Shadow {
        let rect = difference.rect;
        let all = 0..difference.levels.len();
        let ratios: Vec<[f32; 2]> = all.map(|k| brightness(difference, background, k)).collect();
        let bits = ratios.iter().map(|[ratio, deviation]| {
            u8::from(range.contains(ratio) && *deviation < MAX_DEVIATION * ratio)
        });
        let even = Mask {
            rect,
            bits: bits.collect(),
        };
        let mut broad = even.clone();
        for (k, bit) in broad
            .bits
            .iter_mut()
            .enumerate()
            .filter(|(_, bit)| **bit == 1)
        {
            *bit = u8::from(deviation_nearby(&ratios, rect, k) < MAX_DEVIATION * ratios[k][0]);
        }
        Shadow {
            even,
            broad: broad.eroded().dilated(),
        }
    }

    /// Returns the broad parts with the soft rim around them: the even pixels that lead to them.
    fn with_rim(self) -> Mask {
        let mut shadow = self.broad;
        let rect = shadow.rect;
        for part in runs::components(&self.even) {
            let pixels = |run: &Run| {
                let first = ((run.y - rect.y) * rect.w) as usize;
                first + (run.x0 - rect.x) as usize..first + (run.x1 - rect.x) as usize
            };
            let is_set = |run: &Run| shadow.bits[pixels(run)].contains(&1);
            if part.runs.iter().any(is_set) {
                (part.runs.iter()).for_each(|run| shadow.bits[pixels(run)].fill(1));
            }
        }
        shadow
    }
}

/// Returns the brightness of a pixel as a share of the background's: the mean over the channels, and their
/// range.
fn brightness(difference: &Difference, background: &Background, k: usize) -> [f32; 2] {
    let color = background.color(background.px_in(difference.rect, k));
    let ratio =
        |c: usize| (f32::from(difference.rgb.pixels[3 * k + c]) + OFFSET) / (color[c] + OFFSET);
    let ratios = [0, 1, 2].map(ratio);
    let [least, most] = [
        ratios.into_iter().fold(f32::MAX, f32::min),
        ratios.into_iter().fold(0.0, f32::max),
    ];
    [ratios.iter().sum::<f32>() / 3.0, most - least]
}

/// Returns the standard deviation of the brightness around a pixel.
fn deviation_nearby(ratios: &[[f32; 2]], rect: Rect, k: usize) -> f32 {
    let [w, h] = [i64::from(rect.w), i64::from(rect.h)];
    let (x, y) = (k as i64 % w, k as i64 / w);
    let near = |at: i64, n: i64| (at - RADIUS).max(0)..(at + RADIUS + 1).min(n);
    let (mut n, mut sum, mut squares) = (0.0, 0.0, 0.0);
    for at in near(y, h).flat_map(|y| near(x, w).map(move |x| (y * w + x) as usize)) {
        n += 1.0;
        sum += ratios[at][0];
        squares += ratios[at][0] * ratios[at][0];
    }
    let mean = sum / n;
    (squares / n - mean * mean).max(0.0).sqrt()
}
