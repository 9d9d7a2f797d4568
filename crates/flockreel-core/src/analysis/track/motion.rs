//! How a body moves: where it is some frames later, and how far it is usually off.
//!
//! Both are learned from the stretches of the film, in which a body is known to be the same.

use super::stretch::Stretch;
use crate::order;

/// Longest gap over which motion is predicted, frames. Free choice.
const MAX_GAP: usize = 30;
/// Share of the learned errors that the usual error exceeds: animals mostly rest. Free choice.
const USUAL: f64 = 0.9;

/// Motion of a body over 1 frame, 2 frames and so on, up to the longest gap that the stretches show.
pub(super) struct Motion {
    gaps: Vec<Gap>,
    /// Usual change of the median log area between the halves of a long stretch.
    area_change: f64,
    /// Log areas of all bodies.
    areas: Spread,
}

/// Median and median deviation.
struct Spread {
    typical: f64,
    size: f64,
}

#[derive(Clone, Copy)]
struct Gap {
    /// Share of the motion that goes on for as long again.
    persistence: f64,
    /// Usual error of the prediction, pixels; at least that of a centroid, one pixel.
    error_px: f64,
    /// Usual distance that the body goes, pixels; at least one.
    way_px: f64,
}

impl Motion {
    /// Learns the motion from stretches that show one body each.
    pub(super) fn learn(bodies: &[&Stretch]) -> Motion {
        let gaps = (1..=MAX_GAP).map_while(|n| Gap::learn(bodies, n));
        let typical = order::median(bodies.iter().map(|body| body.log_area)).unwrap_or(0.0);
        let off = bodies.iter().map(|body| (body.log_area - typical).abs());
        // The rim of a body is known to about a pixel.
        let population = Spread {
            typical,
            size: order::median(off)
                .unwrap_or(0.0)
                .max(libm::exp(-0.5 * typical)),
        };
        let long = bodies
            .iter()
            .filter(|body| body.log_areas.len() > 2 * MAX_GAP);
        let changes = long.filter_map(|body| {
            let (a, b) = body.log_areas.split_at(body.log_areas.len() / 2);
            let [a, b] = [a, b].map(|half| order::median(half.iter().copied()));
            Some((a? - b?).abs())
        });
        let change =
            order::percentile(&mut changes.collect::<Vec<f64>>(), USUAL).unwrap_or(population.size);
        Motion {
            gaps: gaps.collect(),
            area_change: change.clamp(libm::exp(-0.5 * typical), population.size),
            areas: population,
        }
    }

    /// Returns the density of finding the body of stretch `a` where stretch `b` starts, per square pixel.
    ///
    /// It has long tails: animals turn and dart. A change of area beyond the usual lowers it.
    pub(super) fn density(&self, a: &Stretch, b: &Stretch) -> f64 {
        // Where both are in view, each shows a piece of the body.
        let (left, came) = (a.end().min(b.first), b.first.max(a.end()));
        let n = came + 1 - left;
        let gap = self.over(n);
        let (a_px, b_px) = (
            &a.places_px[..left - a.first],
            &b.places_px[came - b.first..],
        );
        let last = a_px.len() - 1;
        // Predicts ahead from the end of `a` and back from the start of `b`, by the motion over as many frames.
        let (k, l) = (n.min(last), n.min(b_px.len() - 1));
        let off = gap.off_px2(n, k, [a_px[last - k], a_px[last], b_px[0]])
            + gap.off_px2(n, l, [b_px[l], b_px[0], a_px[last]]);
        let tail = 1.0 + 0.5 * off / gap.error_px.powi(2);
        let alike = tailed(a.log_area - b.log_area, self.area_change)
            / tailed(b.log_area - self.areas.typical, self.areas.size);
        alike / (std::f64::consts::TAU * gap.error_px.powi(2) * tail * tail.sqrt())
    }

    /// Returns the motion over `n` frames. Beyond the longest gap, a body goes anywhere within its reach.
    fn over(&self, n: usize) -> Gap {
        let reach = |longest: &Gap| longest.way_px * n as f64 / self.gaps.len() as f64;
        self.gaps.get(n - 1).copied().unwrap_or(Gap {
            persistence: 0.0,
            error_px: self.gaps.last().map_or(n as f64, reach),
            way_px: 0.0,
        })
    }
}

impl Gap {
    /// Returns the squared error of the prediction, from a body that went from `before` to `here` in `k` frames and is
    /// found at `found` after `n`.
    fn off_px2(&self, n: usize, k: usize, [before, here, found]: [[f64; 2]; 3]) -> f64 {
        let share = self.persistence * n as f64 / k.max(1) as f64;
        let off = |axis: usize| found[axis] - here[axis] - share * (here[axis] - before[axis]);
        off(0).powi(2) + off(1).powi(2)
    }

    /// Learns the motion over `n` frames; returns `None` without a stretch of twice that length.
    fn learn(bodies: &[&Stretch], n: usize) -> Option<Gap> {
        let steps = || {
            bodies.iter().flat_map(move |body| {
                let places = body.places_px.windows(2 * n + 1);
                places.map(move |places| {
                    let [from, here, to] = [places[0], places[n], places[2 * n]];
                    [0, 1].map(|axis| [here[axis] - from[axis], to[axis] - here[axis]])
                })
            })
        };
        let (mut both, mut square) = (0.0, 0.0);
        for [back, ahead] in steps().flatten() {
            both += back * ahead;
            square += back * back;
        }
        let persistence = if square > 0.0 { both / square } else { 0.0 };
        let usual_px = |share: f64| {
            let off = steps().map(|step| {
                let [x, y] = step.map(|[back, ahead]| ahead - share * back);
                libm::hypot(x, y).max(1.0)
            });
            order::percentile(&mut off.collect::<Vec<f64>>(), USUAL)
        };
        Some(Gap {
            persistence,
            error_px: usual_px(persistence)?,
            way_px: usual_px(0.0)?,
        })
    }
}

/// Returns the Cauchy density of a deviation, times pi.
fn tailed(off: f64, spread: f64) -> f64 {
    1.0 / (spread * (1.0 + (off / spread).powi(2)))
}
