//! Leadership: a boid at the edge of its neighbors, with few of them ahead, may choose its own course for
//! some time. The others follow by alignment (Hartman & Benes 2006; docs/explanation/algorithms.md, "Boids").

use super::nearest::Neighbor;
use super::vector::{Vec3, dot, norm, plus, scaled};
use crate::random;

/// Eccentricity above which a boid is at the edge, in cohesion radii.
const EDGE_ECCENTRICITY: f64 = 0.7;
/// Rate at which a boid at the edge takes the lead, per second.
const LEAD_RATE_PER_S: f64 = 0.1;
/// Least and greatest duration of a lead, seconds.
const LEAD_DURATION_S: [f64; 2] = [1.0, 3.0];
/// Largest share of the neighbors that may be ahead of a leader. Free choice.
const MAX_SHARE_AHEAD: f64 = 0.25;

/// Boid that may take the lead.
pub struct Candidate<'a> {
    /// Velocity of the boid.
    pub velocity: Vec3,
    /// Its neighbors.
    pub neighbors: &'a [Neighbor],
    /// Radius of cohesion, body lengths.
    pub cohesion_bl: f64,
}

impl Candidate<'_> {
    /// Returns the duration of the lead that the boid takes in this step, seconds, or `None` if it takes none.
    pub fn new_lead_s(&self, seed: u64, key: [u64; 3], step_s: f64) -> Option<f64> {
        if random::uniform(seed, &key) >= LEAD_RATE_PER_S * step_s {
            return None;
        }
        let offsets = self.neighbors.iter().map(|neighbor| neighbor.offset);
        let n = self.neighbors.len() as f64;
        let center = scaled(1.0 / n.max(1.0), offsets.clone().fold([0.0; 3], plus));
        let eccentricity = norm(center) / self.cohesion_bl;
        let ahead = offsets.filter(|&offset| dot(offset, self.velocity) > 0.0);
        let is_in_front = ahead.count() as f64 <= MAX_SHARE_AHEAD * n;
        (is_in_front && eccentricity > EDGE_ECCENTRICITY).then(|| {
            let share = random::uniform(seed, &[key[0], key[1], key[2], 1]);
            LEAD_DURATION_S[0] + share * (LEAD_DURATION_S[1] - LEAD_DURATION_S[0])
        })
    }
}
