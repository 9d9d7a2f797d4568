//! Effect of walls and obstacles on boids that swim into them (docs/explanation/algorithms.md, "Boids"). They
//! stop the boid and turn it no faster than it can turn.

use super::Boids;
use super::vector::{CosSin, Vec3, cross, dot, norm, scaled, turned_at_most, unit};

/// Cosine between a velocity and its reflection below which a boid is reversed. Free choice.
const REVERSED_COS: f64 = -0.7;
/// Share of the greatest turn above which a boid turns on purpose. Free choice.
const TURNING_SHARE: f64 = 0.3;

impl Boids<'_> {
    /// Returns position and velocity as the habitat allows. `before` is the velocity before the step.
    pub(super) fn within_habitat(
        &self,
        mut position: Vec3,
        before: Vec3,
        velocity: Vec3,
    ) -> (Vec3, Vec3) {
        let mut reflected = velocity;
        self.habitat.confine(&mut position, &mut reflected);
        if reflected == velocity {
            return (position, velocity);
        }
        let target = self.velocity_after_wall(before, velocity, reflected);
        (position, self.turned_toward(before, target))
    }

    /// Returns the velocity to turn toward after a reflection. A boid that is reversed continues to the
    /// side to which it turned. In a corner, the shorter turn to the reflection leads to the other side, so
    /// the boid would alternate and never get out.
    fn velocity_after_wall(&self, before: Vec3, velocity: Vec3, reflected: Vec3) -> Vec3 {
        let is_reversed = dot(reflected, velocity) < REVERSED_COS * dot(velocity, velocity);
        let side = unit(cross(self.tank.up(), before));
        let speed = norm(velocity);
        let turn_rad = libm::asin((dot(velocity, side) / speed).clamp(-1.0, 1.0));
        let max_turn_rad = self.calibration.turn_rad_per_s * self.step_s;
        if is_reversed && turn_rad.abs() > TURNING_SHARE * max_turn_rad {
            scaled(speed.copysign(turn_rad), side)
        } else {
            reflected
        }
    }

    /// Returns the velocity after a wall: that before the step, turned toward the reflected one as far as
    /// possible in a step.
    pub(super) fn turned_toward(&self, before: Vec3, reflected: Vec3) -> Vec3 {
        let max_turn = CosSin::new(self.calibration.turn_rad_per_s * self.step_s);
        turned_at_most(before, reflected, max_turn, cross(self.tank.up(), before))
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
    fn boids_leave_corners() {
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
            let mut boids = Boids::at_random(&params, &calibration, &lens, &tank, 30.0);
            let angle = f64::from(degrees).to_radians();
            let velocity = [-libm::cos(angle), libm::sin(angle), 0.0];
            boids.set_states(vec![[0.0, 2.0, 0.0]], vec![velocity], None);
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
