//! Cuts the animal out of a frame: the pixels that more likely show it than the scene, in one piece.
//!
//! The cut starts from the silhouette and spreads to connected pixels that more likely show the animal. Then
//! pixels change sides while that lowers the energy: the log-likelihoods, and a cost for neighbors on two
//! sides, smaller across an edge of the frame (Besag, "On the statistical analysis of dirty pictures", 1986).
//! Only pixels next to the outline and pixels that changed are looked at.

use std::collections::VecDeque;

use super::around::Around;
use super::coat::Coat;
use crate::analysis::scene::background::Background;
use crate::analysis::silhouette::Difference;
use crate::raster::Mask;
use crate::raster::runs::components;

/// Largest log-likelihood of a pixel; one color does not decide. Free choice.
const MAX_ODDS: f32 = 6.0;
/// Log-odds that a pixel shows the animal if its silhouette or a cut of a frame nearby does, and that it does not if
/// that does not. Free choice.
const CUT_ODDS: f32 = 1.0;
/// Cost of two neighbors on two sides where the frame is even. Free choice.
const SMOOTHNESS: f32 = 1.5;
/// Greatest width of gaps in the silhouette that are of the animal, pixels. A wire across the animal leaves one.
/// Gaps twice as wide separate no pieces.
const MAX_GAP_PX: u32 = 2;

/// A frame around a silhouette, with its background.
pub(super) struct Cut<'a> {
    pub(super) difference: &'a Difference,
    pub(super) background: &'a Background,
    pub(super) coat: &'a Coat,
    /// The silhouette in the box of the difference.
    pub(super) silhouette: &'a Mask,
    /// Mean of the squared differences of neighbors in the frame ([`mean_gap`]).
    pub(super) mean_gap: f32,
    /// The animal in frames around this one.
    pub(super) around: &'a [Around<'a>],
}

impl Cut<'_> {
    /// Returns the animal's largest piece, with the floor that its thick parts enclose. Returns the silhouette
    /// where no pixel more likely shows the animal than the scene.
    pub(super) fn animal(&self, thick_px: u32) -> Mask {
        let mut odds = vec![f32::NAN; self.silhouette.bits.len()];
        let mut animal = self.likely(&mut odds);
        self.settle(&mut animal, &mut odds);
        if animal.area() == 0 {
            return self.silhouette.clone();
        }
        self.close_gaps(&mut animal);
        keep_largest_piece(&mut animal);
        add_enclosed(&mut animal, thick_px);
        animal
    }

    /// Returns the likely pixels that are connected to the silhouette.
    fn likely(&self, odds: &mut [f32]) -> Mask {
        let mut likely = Mask::new(self.silhouette.rect);
        let covered = (0..odds.len()).filter(|&k| self.silhouette.bits[k] == 1);
        let mut front: Vec<usize> = covered.filter(|&k| self.odds(k, odds) > 0.0).collect();
        front.iter().for_each(|&k| likely.bits[k] = 1);
        while let Some(at) = front.pop() {
            for (near, _) in self.neighbors(at) {
                if likely.bits[near] == 0 && self.odds(near, odds) > 0.0 {
                    likely.bits[near] = 1;
                    front.push(near);
                }
            }
        }
        likely
    }

    /// Lets pixels change sides until no change lowers the energy.
    fn settle(&self, animal: &mut Mask, odds: &mut [f32]) {
        let gap = self.mean_gap;
        let is_outline = |k: &usize| {
            let side = animal.bits[*k];
            self.neighbors(*k)
                .any(|(near, _)| animal.bits[near] != side)
        };
        let mut queue: VecDeque<usize> = (0..odds.len()).filter(is_outline).collect();
        let mut is_queued = vec![false; odds.len()];
        queue.iter().for_each(|&k| is_queued[k] = true);
        while let Some(at) = queue.pop_front() {
            is_queued[at] = false;
            let pull = |(near, distance_squared): (usize, f32)| {
                let cost = SMOOTHNESS * libm::expf(-0.5 * self.gap(at, near) / gap);
                let side = 2.0 * f32::from(animal.bits[near]) - 1.0;
                side * cost / distance_squared.sqrt()
            };
            let sum = self.odds(at, odds) + self.neighbors(at).map(pull).sum::<f32>();
            let side = u8::from(sum > 0.0);
            if animal.bits[at] != side {
                animal.bits[at] = side;
                for (near, _) in self.neighbors(at) {
                    if !std::mem::replace(&mut is_queued[near], true) {
                        queue.push_back(near);
                    }
                }
            }
        }
    }

    /// Sets the pixels of narrow gaps in the silhouette.
    fn close_gaps(&self, animal: &mut Mask) {
        let closed = (animal.dilated_by(MAX_GAP_PX / 2)).eroded_by(MAX_GAP_PX / 2);
        let gaps = closed.bits.iter().zip(&self.silhouette.bits);
        (animal.bits.iter_mut().zip(gaps)).for_each(|(bit, (closed, own))| *bit |= closed & own);
    }

    /// Returns the log-odds that a pixel shows the animal; `odds` keeps those known.
    fn odds(&self, k: usize, odds: &mut [f32]) -> f32 {
        if odds[k].is_nan() {
            let is_inside = self.silhouette.bits[k] == 1;
            let is_free = self.coat.grows && self.difference.levels[k] > 0;
            odds[k] = if is_inside || is_free {
                let own = self.coat.log_odds(self.difference, self.background, k);
                own.clamp(-MAX_ODDS, MAX_ODDS) + self.prior(k)
            } else {
                -MAX_ODDS
            };
        }
        odds[k]
    }

    /// Returns the log-odds that a pixel shows the animal without the likelihoods of its color: by the silhouette, and
    /// by the cuts of the frames around as far as they show the same color there.
    fn prior(&self, k: usize) -> f32 {
        let side = |shows: bool| if shows { 1.0 } else { -1.0 };
        let own = side(self.silhouette.bits[k] == 1);
        let color = &self.difference.rgb.pixels[3 * k..3 * k + 3];
        let votes = self.around.iter().filter_map(|around| {
            let (shows, there) = around.at(self.silhouette.rect, k)?;
            Some(side(shows) * libm::expf(-0.5 * gap(color, &there) / self.mean_gap))
        });
        CUT_ODDS * (own + votes.sum::<f32>())
    }

    /// Returns the neighbors of a pixel (8-connected), and their squared distances.
    fn neighbors(&self, k: usize) -> impl Iterator<Item = (usize, f32)> + use<> {
        let (w, h) = (self.silhouette.width(), self.silhouette.height());
        let (x, y) = (k % w, k / w);
        let rows = y.saturating_sub(1)..(y + 2).min(h);
        let columns = x.saturating_sub(1)..(x + 2).min(w);
        let all = rows.flat_map(move |v| columns.clone().map(move |u| (u, v)));
        all.filter(move |at| *at != (x, y)).map(move |(u, v)| {
            let steps = u.abs_diff(x) + v.abs_diff(y);
            (v * w + u, steps as f32)
        })
    }

    /// Returns the squared difference of the colors of two pixels.
    fn gap(&self, p: usize, q: usize) -> f32 {
        let rgb = &self.difference.rgb.pixels;
        gap(&rgb[3 * p..3 * p + 3], &rgb[3 * q..3 * q + 3])
    }
}

/// Returns the squared difference of two colors.
fn gap(p: &[u8], q: &[u8]) -> f32 {
    let pairs = p.iter().zip(q);
    pairs.map(|(p, q)| f32::from(p.abs_diff(*q)).powi(2)).sum()
}

/// Returns the mean of the squared differences of neighbors in a row.
pub(super) fn mean_gap(difference: &Difference) -> f32 {
    let rgb = &difference.rgb.pixels;
    let pairs = rgb.chunks_exact(3).zip(rgb[3..].chunks_exact(3));
    let sum: f32 = pairs.map(|(p, q)| gap(p, q)).sum();
    (sum / (rgb.len() / 3).max(2) as f32).max(1.0)
}

/// Clears all but the largest piece; narrow gaps separate none.
fn keep_largest_piece(animal: &mut Mask) {
    let joined = animal.dilated_by(MAX_GAP_PX);
    let pieces = components(&joined);
    let Some(largest) = pieces.iter().max_by_key(|piece| piece.area) else {
        return;
    };
    let largest = largest.mask(animal.rect);
    (animal.bits.iter_mut().zip(&largest.bits)).for_each(|(bit, kept)| *bit &= kept);
}

/// Sets the pixels that are enclosed by parts more than twice `reach_px` thick.
///
/// Thinner parts enclose nothing: a tail and its shadow may meet around a patch of floor.
fn add_enclosed(animal: &mut Mask, reach_px: u32) {
    let mut filled = animal.clone();
    filled.fill_holes();
    if filled == *animal {
        return;
    }
    let mut thick = animal.eroded_by(reach_px);
    thick.fill_holes();
    for (bit, enclosed) in animal.bits.iter_mut().zip(thick.dilated_by(reach_px).bits) {
        *bit |= enclosed;
    }
}
