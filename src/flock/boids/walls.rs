//! What walls and obstacles do to whoever swims into them: they hold it off, and turn it no faster than it turns
//! (ALGORITHMS.md 7).

use super::Boids;
use super::lanes::{self, Lanes, by_lane, in_lane};
use super::vector::{Vec3, cross, turned_at_most};

impl Boids<'_> {
    /// Places and velocities after `before`, as the habitat allows: a wall turns nobody faster than they turn.
    #[inline(always)]
    pub(super) fn kept_in<L: Lanes>(
        &self,
        place: [L; 3],
        (before, velocity): ([L; 3], [L; 3]),
    ) -> ([L; 3], [L; 3]) {
        if !self.habitat.may_hold_off(place) {
            return (place, velocity);
        }
        let mut kept = [([0.0; 3], [0.0; 3]); lanes::MOST];
        for lane in 0..L::N {
            let (mut place, velocity) = (in_lane(place, lane), in_lane(velocity, lane));
            let mut reflected = velocity;
            self.habitat.keep_out(&mut place, &mut reflected);
            kept[lane] = (place, velocity);
            if reflected != velocity {
                kept[lane].1 = self.turned(in_lane(before, lane), reflected);
            }
        }
        (by_lane(|lane| kept[lane].0), by_lane(|lane| kept[lane].1))
    }

    /// What a wall makes of a velocity: from what it was before the step, turned toward what is reflected as far as they
    /// turn.
    pub(super) fn turned(&self, before: Vec3, reflected: Vec3) -> Vec3 {
        let turn_rad = self.calibration.turn_rad_per_s * self.step_s;
        let cos_sin = (libm::cos(turn_rad), libm::sin(turn_rad));
        turned_at_most(before, reflected, cos_sin, cross(self.tank.up(), before))
    }
}
