//! Collision avoidance in top view (Reynolds 1999, unaligned collision avoidance). Each animal predicts the
//! nearest approach of every other one and steers away from it.

use rayon::prelude::*;

/// Time over which approaches are predicted, seconds. Free choice: about the time in which a mouse turns
/// aside.
const AHEAD_S: f64 = 0.6;
/// Distance to keep between centroids, body lengths. Free choice between the width and the length of a body.
pub(in crate::flock) const CLEARANCE_BL: f64 = 0.8;

/// Position and velocity of an animal in top view.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Mover {
    pub(super) position_bl: [f64; 2],
    pub(super) velocity_bl_per_s: [f64; 2],
}

/// Returns the avoidance vector of each animal: the sum over the others that are about to come too near. Each
/// term is at most 1 long, and longer for a nearer and earlier approach.
pub(super) fn avoidance_vectors(movers: &[Mover]) -> Vec<[f64; 2]> {
    let mut by_x: Vec<usize> = (0..movers.len()).collect();
    by_x.sort_by(|&a, &b| movers[a].position_bl[0].total_cmp(&movers[b].position_bl[0]));
    let fastest = movers
        .iter()
        .map(|m| m.velocity_bl_per_s[0].hypot(m.velocity_bl_per_s[1]));
    let reach_bl = CLEARANCE_BL + 2.0 * AHEAD_S * fastest.fold(0.0, f64::max);
    let of = |&one: &Mover| {
        let x = one.position_bl[0];
        let first = by_x.partition_point(|&id| movers[id].position_bl[0] < x - reach_bl);
        let near = by_x[first..].iter().map(|&id| &movers[id]);
        let near = near.take_while(|other| other.position_bl[0] <= x + reach_bl);
        near.map(|other| avoidance_term(&one, other))
            .fold([0.0; 2], |[x, y], [dx, dy]| [x + dx, y + dy])
    };
    movers.par_iter().with_min_len(64).map(of).collect()
}

/// Returns the term of the avoidance vector that `other` adds.
fn avoidance_term(one: &Mover, other: &Mover) -> [f64; 2] {
    let offset = [0, 1].map(|k| one.position_bl[k] - other.position_bl[k]);
    let relative = [0, 1].map(|k| one.velocity_bl_per_s[k] - other.velocity_bl_per_s[k]);
    let square = relative[0] * relative[0] + relative[1] * relative[1];
    let closing = -(offset[0] * relative[0] + offset[1] * relative[1]);
    let after_s = if square > 1e-9 {
        (closing / square).clamp(0.0, AHEAD_S)
    } else {
        0.0
    };
    let then = [0, 1].map(|k| offset[k] + after_s * relative[k]);
    let distance_bl = then[0].hypot(then[1]);
    if distance_bl >= CLEARANCE_BL || offset == [0.0; 2] {
        return [0.0; 2];
    }
    let strength = (1.0 - distance_bl / CLEARANCE_BL) * (1.0 - 0.5 * after_s / AHEAD_S);
    // Two animals that approach head-on both turn to their left.
    let away = if distance_bl > 0.05 {
        then
    } else {
        [-offset[1], offset[0]]
    };
    let length = away[0].hypot(away[1]).max(1e-9);
    away.map(|part| strength * part / length)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn mover(position_bl: [f64; 2], velocity_bl_per_s: [f64; 2]) -> Mover {
        Mover {
            position_bl,
            velocity_bl_per_s,
        }
    }

    /// Returns the least distance of two animals that steer along their avoidance vectors, body lengths.
    fn nearest_bl(mut movers: [Mover; 2]) -> f64 {
        const STEP_S: f64 = 0.05;
        let mut nearest_bl = f64::INFINITY;
        for _ in 0..60 {
            let avoidance_vectors = avoidance_vectors(&movers);
            for (mover, avoidance_term) in movers.iter_mut().zip(avoidance_vectors) {
                let speed = mover.velocity_bl_per_s[0].hypot(mover.velocity_bl_per_s[1]);
                let wanted =
                    [0, 1].map(|k| mover.velocity_bl_per_s[k] + 4.0 * STEP_S * avoidance_term[k]);
                let length = wanted[0].hypot(wanted[1]);
                mover.velocity_bl_per_s = wanted.map(|v| v * speed / length);
                for k in 0..2 {
                    mover.position_bl[k] += STEP_S * mover.velocity_bl_per_s[k];
                }
            }
            let [a, b] = movers.map(|mover| mover.position_bl);
            nearest_bl = nearest_bl.min((a[0] - b[0]).hypot(a[1] - b[1]));
        }
        nearest_bl
    }

    #[test]
    fn animals_that_would_collide_pass_each_other() {
        let head_on = [
            mover([0.0, 0.0], [1.0, 0.0]),
            mover([2.0, 0.0], [-1.0, 0.0]),
        ];
        let crossing = [
            mover([0.0, 0.0], [1.0, 0.0]),
            mover([1.0, -1.2], [0.0, 1.0]),
        ];
        for movers in [head_on, crossing] {
            let nearest_bl = nearest_bl(movers);
            assert!(nearest_bl > 0.4, "{nearest_bl}");
        }
    }

    #[test]
    fn animals_that_do_not_come_near_keep_their_course() {
        let parallel = [mover([0.0, 0.0], [1.0, 0.0]), mover([0.0, 1.0], [1.0, 0.0])];
        let parting = [
            mover([0.0, 0.0], [-1.0, 0.0]),
            mover([1.0, 0.0], [1.0, 0.0]),
        ];
        for movers in [parallel, parting] {
            assert_eq!(avoidance_vectors(&movers), [[0.0; 2]; 2]);
        }
    }
}
