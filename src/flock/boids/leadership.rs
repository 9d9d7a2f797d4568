//! Leadership: a boid at the edge of its neighbors, with few of them ahead, may choose its own course for
//! some time. The others follow by alignment (Hartman & Benes 2006; docs/explanation/algorithms.md, "Boids").

use super::vector::{Vec3, dot, norm, plus, scaled};
use crate::random;

/// Eccentricity above which a boid is at the edge, in cohesion radii.
const RIM: f64 = 0.7;
/// Rate at which a boid at the edge takes the lead, per second.
const RATE_PER_S: f64 = 0.1;
/// Least and greatest duration of a lead, seconds.
const SPAN_S: [f64; 2] = [1.0, 3.0];
/// Largest share of the neighbors that may be ahead of a leader. Free choice.
const MOST_AHEAD: f64 = 0.25;

/// Returns the duration of the lead that a boid takes in this step, seconds, or `None` if it takes none.
/// `offsets` are the vectors to its neighbors.
pub fn taken(
    seed: u64,
    key: [u64; 3],
    velocity: Vec3,
    offsets: impl Iterator<Item = Vec3> + Clone,
    cohesion_bl: f64,
    step_s: f64,
) -> Option<f64> {
    let draw = random::unit(seed, &key);
    if draw >= RATE_PER_S * step_s {
        return None;
    }
    let n = offsets.clone().count() as f64;
    let center = offsets.clone().fold([0.0; 3], plus);
    let eccentricity = norm(scaled(1.0 / n.max(1.0), center)) / cohesion_bl;
    let ahead = offsets.filter(|&offset| dot(offset, velocity) > 0.0);
    let in_front = ahead.count() as f64 <= MOST_AHEAD * n;
    (in_front && eccentricity > RIM).then(|| {
        let share = random::unit(seed, &[key[0], key[1], key[2], 1]);
        SPAN_S[0] + share * (SPAN_S[1] - SPAN_S[0])
    })
}
