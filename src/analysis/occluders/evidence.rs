//! What the frames tell of each pixel that the animal covers.

use rayon::prelude::*;

use super::ring::SummedArea;
use crate::analysis::Error;
use crate::analysis::track::Track;
use crate::analysis::track::sighting::Sighting;
use crate::progress::Progress;
use crate::raster::{Mask, RgbImage, RgbaImage};

/// The animal must be known at so many pixels of a ring of 72.
const LEAST_RING: i64 = 24;
/// Pixels of mattes that are looked at at once, but for one frame.
const BATCH_PX: u64 = 1 << 20;
/// Means over rings are kept in parts of a level.
const PARTS: i64 = 16;

/// What speaks for an occluder at a pixel.
pub(super) struct Proof {
    /// It takes at least this share of the pixel, beyond what a line behind the animal would feign.
    pub(super) share: f64,
    /// The plate must have a line or a speck there, the other way than the animal is off the scene.
    pub(super) is_in_plate: bool,
    /// With it, what is seen is off by at most this part of the squares that it is off without ...
    pub(super) unexplained: f64,
    /// ... by so many squared levels less, for each channel, in the mean of frames: what is less is not seen ...
    pub(super) gain: f64,
    /// ... and in their sum: few frames must show more than many.
    pub(super) gain_of_all: f64,
}

/// What frames tell of one pixel: sums over frames and channels, of levels times [`PARTS`].
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Evidence {
    n_frames: i64,
    /// (I - B)(A - S).
    both: i64,
    /// (A - S)^2.
    around: i64,
    /// (I - B)^2.
    here: i64,
    /// (I - A)^2.
    unlike: i64,
    /// (I - A) times what the plate is off its own ring.
    alike: i64,
    /// (A - S) times the same.
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

    /// The share of the pixel that something before the animal takes.
    pub(super) fn share(&self) -> f64 {
        let around = self.around.max(1) as f64;
        (1.0 - self.both as f64 / around).clamp(0.0, 1.0)
    }

    /// Whether so much speaks for such a thing.
    pub(super) fn is(&self, proof: &Proof) -> bool {
        let share = self.share();
        let through = 1.0 - share;
        let left = self.here as f64 - 2.0 * through * self.both as f64
            + through * through * self.around as f64;
        let unlike = self.unlike as f64;
        // A line behind the animal, seen through it, takes at most this share: just so much were the animal opaque.
        let feigned = (self.toward as f64 / self.around.max(1) as f64).max(0.0);
        let is_in_plate = self.alike > 0 && self.toward < 0;
        let gain = (unlike - left) / (3 * PARTS * PARTS) as f64;
        let is_seen = gain > proof.gain_of_all && gain > proof.gain * self.n_frames as f64;
        left < proof.unexplained * unlike
            && is_seen
            && share - feigned >= proof.share
            && (is_in_plate || !proof.is_in_plate)
    }
}

/// What is asked about all pixels of a box, and what is known already.
pub(super) struct Question<'a> {
    pub(super) plate: &'a RgbImage,
    /// Those that show something before the animal, so that rings go without them.
    pub(super) found: &'a Mask,
}

impl Question<'_> {
    /// What sightings tell of each pixel that they cover: its index in the box, and the sum over all. The order is the same for any number of threads.
    pub(super) fn answer(
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

    /// What one frame tells of the pixels that its animal covers.
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
        let plate = |k: usize, c: usize| {
            let [x, y] = place(k);
            self.plate.pixels[(y as usize * self.plate.width as usize + x as usize) * 3 + c]
        };
        let n = SummedArea::of(rect, is_known);
        let channels: [_; 3] = std::array::from_fn(|c| {
            let frame = |k: usize| is_known(k) * i32::from(matte.pixels[4 * k + c]);
            let plate = |k: usize| is_known(k) * i32::from(plate(k, c));
            [SummedArea::of(rect, frame), SummedArea::of(rect, plate)]
        });
        let of_pixel = |k: usize| {
            let (x, y) = (k % columns, k / columns);
            let n = i64::from(n.ring(x, y));
            if n < LEAST_RING {
                return None;
            }
            let mut evidence = Evidence {
                n_frames: 1,
                ..Evidence::default()
            };
            for (c, sums) in channels.iter().enumerate() {
                let mean = |sums: &SummedArea| (PARTS * i64::from(sums.ring(x, y)) + n / 2) / n;
                let [animal, scene] = [mean(&sums[0]), mean(&sums[1])];
                let seen = PARTS * i64::from(matte.pixels[4 * k + c]);
                let back = PARTS * i64::from(plate(k, c));
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
