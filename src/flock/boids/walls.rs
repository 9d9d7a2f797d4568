//! Effect of walls and obstacles on boids that swim into them (docs/explanation/algorithms.md, "Boids"). They
//! stop the boid and turn it no faster than it can turn.

use super::Boids;
use super::vector::{Vec3, cross, dot, norm, scaled, turned_at_most, unit};

/// Cosine between a velocity and its reflection below which a boid is thrown back. Free choice.
const THROWN_BACK: f64 = -0.7;
/// Share of the greatest turn above which a boid turns on purpose. Free choice.
const TURNING: f64 = 0.3;

impl Boids<'_> {
    /// Returns position and velocity as the habitat allows. `before` is the velocity before the step.
    pub(super) fn kept_in(&self, mut place: Vec3, before: Vec3, velocity: Vec3) -> (Vec3, Vec3) {
        let mut reflected = velocity;
        self.habitat.keep_out(&mut place, &mut reflected);
        if reflected == velocity {
            return (place, velocity);
        }
        let onward = self.onward(before, velocity, reflected);
        (place, self.turned(before, onward))
    }

    /// Returns the velocity to turn toward after a reflection. A boid that is thrown back continues to the
    /// side to which it turned. In a corner, the shorter turn to the reflection leads to the other side, so
    /// the boid would alternate and never get out.
    fn onward(&self, before: Vec3, velocity: Vec3, reflected: Vec3) -> Vec3 {
        let is_thrown_back = dot(reflected, velocity) < THROWN_BACK * dot(velocity, velocity);
        let side = unit(cross(self.tank.up(), before));
        let speed = norm(velocity);
        let turn_rad = libm::asin((dot(velocity, side) / speed).clamp(-1.0, 1.0));
        let most_rad = self.calibration.turn_rad_per_s * self.step_s;
        if is_thrown_back && turn_rad.abs() > TURNING * most_rad {
            scaled(speed.copysign(turn_rad), side)
        } else {
            reflected
        }
    }

    /// Returns the velocity after a wall: that before the step, turned toward the reflected one as far as
    /// possible in a step.
    pub(super) fn turned(&self, before: Vec3, reflected: Vec3) -> Vec3 {
        let turn_rad = self.calibration.turn_rad_per_s * self.step_s;
        let cos_sin = (libm::cos(turn_rad), libm::sin(turn_rad));
        turned_at_most(before, reflected, cos_sin, cross(self.tank.up(), before))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::flock::Params;
    use crate::flock::boids::calibration::Calibration;
    use crate::flock::boids::tank::Tank;
    use crate::flock::boids::vector::minus;
    use crate::flock::lens::Lens;

    #[test]
    fn whoever_swims_into_a_corner_gets_out_again() {
        let calibration = Calibration {
            cruise_bl_per_s: 2.0,
            speed_limits_bl_per_s: [1.0, 4.0],
            turn_rad_per_s: 4.8,
            wander_rad_per_s: 2.0,
            ..Calibration::default()
        };
        let params = Params {
            count: Some(1),
            leaders: false,
            ..Params::default()
        };
        let (lens, tank) = (Lens::flat(40.0), Tank::new([0.0; 3], [6.0, 2.0, 0.0]));
        for degrees in 0..90u32 {
            let mut boids = Boids::at_random(&params, &calibration, (&lens, &tank), 30.0);
            let angle = f64::from(degrees).to_radians();
            let velocity = [-libm::cos(angle), libm::sin(angle), 0.0];
            boids.show(vec![[0.0, 2.0, 0.0]], vec![velocity], None);
            let off = |boids: &Boids| norm(minus(boids.positions()[0], [0.0, 2.0, 0.0]));
            let mut farthest_bl = 0.0f64;
            for _ in 0..45 {
                boids.advance();
                farthest_bl = farthest_bl.max(off(&boids));
            }
            assert!(farthest_bl > 0.7, "{degrees}: {farthest_bl}");
        }
    }
}
