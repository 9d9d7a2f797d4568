//! Evidence for an occluder at each pixel, summed over the frames in which the animal covers the pixel.
//!
//! Symbols: I is the frame's color at the pixel, B the background's. A and S are the means of frame and
//! background over a ring of pixels around it. The formula of the share is in the header of `occluders`.

use rayon::prelude::*;

use super::ring::SummedArea;
use crate::analysis::Error;
use crate::analysis::track::Track;
use crate::analysis::track::sighting::Sighting;
use crate::progress::Progress;
use crate::raster::{Mask, RgbImage, RgbaImage};

/// Least number of the ring's 72 pixels that must show the animal and no occluder. Free choice: a third.
const MIN_RING_PX: i64 = 24;
/// Matte pixels read into memory at a time, but at least one frame. Free choice.
const BATCH_PX: u64 = 1 << 20;
/// Fractions per level in ring means: fixed-point sixteenths keep the sums exact.
const STEPS_PER_LEVEL: i64 = 16;

/// Conditions under which a pixel counts as an occluder.
pub(super) struct Criteria {
    /// Least share of the pixel, 0..=1, after subtraction of the share that a line behind the animal would
    /// imitate.
    pub(super) share: f64,
    /// Whether the background must have a line or speck there, whose contrast is opposite to that of the
    /// animal.
    pub(super) needs_line: bool,
    /// Greatest ratio of the squared residual with the occluder to that without it.
    pub(super) unexplained: f64,
    /// Least gain per frame: decrease of the squared residual per channel, squared levels.
    pub(super) gain: f64,
    /// Least gain over all frames, squared levels: with few frames, each must show more.
    pub(super) gain_of_all: f64,
}

/// Evidence at one pixel: sums over frames and channels, of levels times [`STEPS_PER_LEVEL`].
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Evidence {
    n_frames: i64,
    /// Sum of (I - B)(A - S).
    both: i64,
    /// Sum of (A - S)^2.
    around: i64,
    /// Sum of (I - B)^2.
    here: i64,
    /// Sum of (I - A)^2.
    unlike: i64,
    /// Sum of (I - A)(B - S).
    alike: i64,
    /// Sum of (A - S)(B - S).
    toward: i64,
}

impl Evidence {
    fn add(&mut self, other: &Evidence) {
        self.n_frames += other.n_frames;
        self.both += other.both;
        self.around += other.around;
        self.here += other.here;
        self.unlike += other.unlike;
        self.alike += other.alike;
        self.toward += other.toward;
    }

    /// Returns the occluder's share of the pixel, 0..=1.
    pub(super) fn share(&self) -> f64 {
        let around = self.around.max(1) as f64;
        (1.0 - self.both as f64 / around).clamp(0.0, 1.0)
    }

    /// Returns whether the evidence meets all conditions of `criteria`.
    pub(super) fn meets(&self, criteria: &Criteria) -> bool {
        let share = self.share();
        let transmitted = 1.0 - share;
        let residual = self.here as f64 - 2.0 * transmitted * self.both as f64
            + transmitted * transmitted * self.around as f64;
        let unlike = self.unlike as f64;
        // Share that a line behind an opaque animal would imitate (I = A). A line seen through the animal
        // gives less.
        let imitated_share = (self.toward as f64 / self.around.max(1) as f64).max(0.0);
        let has_line = self.alike > 0 && self.toward < 0;
        let gain = (unlike - residual) / (3 * STEPS_PER_LEVEL * STEPS_PER_LEVEL) as f64;
        let is_seen = gain > criteria.gain_of_all && gain > criteria.gain * self.n_frames as f64;
        residual < criteria.unexplained * unlike
            && is_seen
            && share - imitated_share >= criteria.share
            && (has_line || !criteria.needs_line)
    }
}

/// The inputs that are common to all pixels of a box.
pub(super) struct EvidenceInput<'a> {
    pub(super) background: &'a RgbImage,
    /// Pixels of the box that are already known to show an occluder. Rings leave them out.
    pub(super) found: &'a Mask,
}

impl EvidenceInput<'_> {
    /// Returns the evidence of all sightings, as pairs of pixel index in the box and sums over the frames.
    ///
    /// The order does not depend on the number of threads. Fails with `Cancelled` when `progress` says so.
    pub(super) fn collect(
        &self,
        track: &Track,
        sightings: &[Sighting],
        progress: &dyn Progress,
    ) -> Result<Vec<(usize, Evidence)>, Error> {
        let mut sums: Vec<(usize, Evidence)> = Vec::new();
        let mut slots = vec![u32::MAX; self.found.bits.len()];
        let area = sightings.iter().map(|seen| seen.rect.area()).max();
        let batch = (BATCH_PX / area.unwrap_or(1).max(1)).clamp(1, 64);
        for batch in sightings.chunks(batch as usize) {
            if progress.cancelled() {
                return Err(Error::Cancelled);
            }
            let of_frames: Vec<_> = batch
                .par_iter()
                .map(|seen| self.of_frame(seen, &track.image(seen)))
                .collect();
            for (k, evidence) in of_frames.into_iter().flatten() {
                if slots[k] == u32::MAX {
                    slots[k] = sums.len() as u32;
                    sums.push((k, Evidence::default()));
                }
                sums[slots[k] as usize].1.add(&evidence);
            }
        }
        Ok(sums)
    }

    /// Returns the evidence of one frame for the opaque pixels of its matte.
    fn of_frame(&self, seen: &Sighting, matte: &RgbaImage) -> Vec<(usize, Evidence)> {
        let (rect, of) = (seen.rect, self.found.rect);
        let columns = rect.w as usize;
        let place = |k: usize| [rect.x + (k % columns) as u32, rect.y + (k / columns) as u32];
        let index = |k: usize| {
            let [x, y] = place(k);
            (y - of.y) as usize * of.w as usize + (x - of.x) as usize
        };
        let is_inside = |k: usize| matte.pixels[4 * k + 3] == 255;
        let is_known = |k: usize| i32::from(is_inside(k) && self.found.bits[index(k)] == 0);
        let background = |k: usize, c: usize| {
            let [x, y] = place(k);
            self.background.pixels
                [(y as usize * self.background.width as usize + x as usize) * 3 + c]
        };
        let n = SummedArea::new(rect, is_known);
        let channels: [_; 3] = std::array::from_fn(|c| {
            let frame = |k: usize| is_known(k) * i32::from(matte.pixels[4 * k + c]);
            let background = |k: usize| is_known(k) * i32::from(background(k, c));
            [
                SummedArea::new(rect, frame),
                SummedArea::new(rect, background),
            ]
        });
        let of_pixel = |k: usize| {
            let (x, y) = (k % columns, k / columns);
            let n = i64::from(n.ring(x, y));
            if n < MIN_RING_PX {
                return None;
            }
            let mut evidence = Evidence {
                n_frames: 1,
                ..Evidence::default()
            };
            for (c, sums) in channels.iter().enumerate() {
                let mean =
                    |sums: &SummedArea| (STEPS_PER_LEVEL * i64::from(sums.ring(x, y)) + n / 2) / n;
                let [animal, scene] = [mean(&sums[0]), mean(&sums[1])];
                let seen = STEPS_PER_LEVEL * i64::from(matte.pixels[4 * k + c]);
                let back = STEPS_PER_LEVEL * i64::from(background(k, c));
                evidence.both += (seen - back) * (animal - scene);
                evidence.around += (animal - scene).pow(2);
                evidence.here += (seen - back).pow(2);
                evidence.unlike += (seen - animal).pow(2);
                evidence.alike += (seen - animal) * (back - scene);
                evidence.toward += (animal - scene) * (back - scene);
            }
            Some((index(k), evidence))
        };
        let all = 0..matte.pixels.len() / 4;
        all.filter(|&k| is_inside(k)).filter_map(of_pixel).collect()
    }
}
