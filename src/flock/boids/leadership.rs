//! Who leads: a boid at the rim of its neighbors, with few of them ahead, may go its own way for a
//! while, and the others follow by alignment (Hartman & Benes 2006; ALGORITHMS.md 7).

use super::vector::{Vec3, dot, norm, plus, scaled};
use crate::random;

/// Farther out than this share of the cohesion radius is the rim.
const RIM: f64 = 0.7;
/// How often a boid at the rim takes the lead.
const RATE_PER_S: f64 = 0.1;
/// A lead lasts between these.
const SPAN_S: [f64; 2] = [1.0, 3.0];
/// At most this share of the neighbors may be ahead.
const MOST_AHEAD: f64 = 0.25;

/// Seconds of lead that a boid begins with in this step, by the ways to its neighbors; `None` when it does not.
pub fn taken(
    seed: u64,
    key: [u64; 3],
    velocity: Vec3,
    offsets: impl Iterator<Item = Vec3> + Clone,
    (cohesion_bl, step_s): (f64, f64),
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
