//! How a body moves: where it is some frames later, and how far it is usually off.
//!
//! Both are learned from the stretches of the film, in which a body is known to be the same.

use super::stretch::Stretch;
use crate::order;

/// Longest gap for which motion is learned, frames. Free choice.
pub(super) const MAX_GAP: usize = 30;
/// Least error of a predicted place, pixels: that of a centroid.
const LEAST_ERROR_PX: f64 = 1.0;

/// Motion of a body over 1 to `MAX_GAP` frames.
pub(super) struct Motion {
    gaps: Vec<Gap>,
    /// Median change of the median log area between the halves of a long stretch.
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
    /// Median error of the prediction, pixels.
    error_px: f64,
}

impl Motion {
    /// Learns the motion from stretches that show one body each.
    pub(super) fn learn(bodies: &[&Stretch]) -> Motion {
        let mut gaps: Vec<Gap> = Vec::with_capacity(MAX_GAP);
        for n in 1..=MAX_GAP {
            let last = gaps.last().copied();
            gaps.push(Gap::learn(bodies, n, last));
        }
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
        let change = order::median(changes).unwrap_or(population.size);
        Motion {
            gaps,
            area_change: change.clamp(libm::exp(-0.5 * typical), population.size),
            areas: population,
        }
    }

    /// Returns the density of finding the body of stretch `a` where stretch `b` starts, per square pixel.
    ///
    /// It has long tails: animals turn and dart. A change of area beyond the usual lowers it.
    pub(super) fn density(&self, a: &Stretch, b: &Stretch) -> f64 {
        let n = b.first + 1 - a.end();
        let gap = self.over(n);
        let (a_px, b_px) = (&a.places_px, &b.places_px);
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

    fn over(&self, n: usize) -> Gap {
        let longest = self.gaps[MAX_GAP - 1];
        self.gaps.get(n - 1).copied().unwrap_or(Gap {
            persistence: 0.0,
            error_px: longest.error_px * n as f64 / MAX_GAP as f64,
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

    /// Learns the motion over `n` frames. Without a stretch of that length it continues that over fewer frames.
    fn learn(bodies: &[&Stretch], n: usize, last: Option<Gap>) -> Gap {
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
        let off = |step: [[f64; 2]; 2]| {
            let [x, y] = step.map(|[back, ahead]| ahead - persistence * back);
            libm::hypot(x, y)
        };
        let least_px = last.map_or(LEAST_ERROR_PX, |last| last.error_px);
        match (order::median(steps().map(off)), last) {
            (Some(error_px), _) => Gap {
                persistence,
                error_px: error_px.max(least_px),
            },
            (None, Some(last)) => Gap {
                error_px: last.error_px * n as f64 / (n - 1) as f64,
                ..last
            },
            (None, None) => Gap {
                persistence: 0.0,
                error_px: least_px,
            },
        }
    }
}

/// Returns the Cauchy density of a deviation, times pi.
fn tailed(off: f64, spread: f64) -> f64 {
    1.0 / (spread * (1.0 + (off / spread).powi(2)))
}
