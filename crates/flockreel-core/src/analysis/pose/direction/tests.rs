//! Tests on a synthetic swimmer with a known course. Its silhouette moments come from many projected points.

use std::f64::consts::TAU;

use super::state::State;
use super::*;
use crate::random;

const CAMERA: Camera = Camera {
    z_min_m: 0.7,
    pane_px_per_m: 1000.0,
    center_px: [320.0, 240.0],
    medium_index: 1.0,
};
const ANIMAL: Animal = Animal {
    length_m: 0.1,
    height_m: 0.05,
};

/// The true position and direction.
struct Truth {
    position_m: [f64; 3],
    forward: [f64; 3],
}

/// Returns `n` frames of a swimmer: uneven turns in yaw, little pitch, about one body length per second, and
/// a beating tail.
fn swimmer(n: usize, camera: &Camera) -> (Vec<Truth>, Vec<Option<Measurement>>) {
    let mut position_m = [0.0, 0.0, 0.85];
    (0..n)
        .map(|k| {
            let t = k as f64 / 30.0;
            let yaw = 0.9 * t + 1.3 * libm::sin(0.7 * t) + 0.5 * libm::sin(1.9 * t + 1.0);
            let pitch = 0.2 * libm::sin(0.5 * t);
            let axes = BodyAxes::new(yaw, pitch);
            let speed = 0.1 + 0.03 * libm::sin(0.4 * t);
            for c in 0..3 {
                position_m[c] += axes.forward[c] * speed / 30.0;
            }
            let truth = Truth {
                position_m,
                forward: axes.forward,
            };
            let measured =
                measurement(&axes, position_m, 0.1 * libm::sin(TAU * 2.3 * t), camera, k);
            (truth, Some(measured))
        })
        .unzip()
}

/// Returns the moments of 600 projected points of an ellipsoid with a bent tail.
fn measurement(
    axes: &BodyAxes,
    position_m: [f64; 3],
    bend: f64,
    camera: &Camera,
    frame: usize,
) -> Measurement {
    let points: Vec<[f64; 2]> = (0..600)
        .map(|m| {
            let [a, b, c] = [0, 1, 2].map(|word| random::normal(11, &[m, word]));
            // The silhouette of a uniform ellipsoid has a quarter of each full axis as standard deviation.
            let along = a * ANIMAL.length_m / 4.0;
            let side = c * 0.018 / 4.0 + bend * (along - 0.05).powi(2) / 0.1;
            let down = b * ANIMAL.height_m / 4.0;
            let point: [f64; 3] = std::array::from_fn(|k| {
                position_m[k] + axes.forward[k] * along + axes.down[k] * down + axes.side[k] * side
            });
            camera.image_from_camera(point)
        })
        .collect();
    let n = points.len() as f64;
    let mean = [0, 1].map(|c| points.iter().map(|p| p[c]).sum::<f64>() / n);
    let second = |i: usize, j: usize| {
        points
            .iter()
            .map(|p| (p[i] - mean[i]) * (p[j] - mean[j]))
            .sum::<f64>()
            / n
    };
    let noise = |word: u64| random::normal(5, &[frame as u64, word]);
    let pitch = libm::asin(axes.forward[1]);
    let tall = libm::hypot(0.05 * libm::cos(pitch), 0.1 * libm::sin(pitch));
    let apparent = camera.apparent_from_true_depth_m(position_m[2]);
    Measurement {
        centroid_px: [mean[0] + 0.2 * noise(0), mean[1] + 0.2 * noise(1)],
        covariance_px2: [second(0, 0), second(0, 1), second(1, 1)],
        vertical_px: tall * camera.focal_px() / apparent * (1.0 + 0.02 * noise(2)),
        cut: false,
        given_head_px: None,
        head_evidence: None,
    }
}

fn angles_deg(truth: &[Truth], found: &[Option<Direction>]) -> Vec<f64> {
    let angle = |(truth, found): (&Truth, &Option<Direction>)| {
        let found = found.as_ref()?.forward;
        let dot: f64 = found.iter().zip(&truth.forward).map(|(a, b)| a * b).sum();
        Some(libm::acos(dot.clamp(-1.0, 1.0)).to_degrees())
    };
    let mut angles: Vec<f64> = truth.iter().zip(found).filter_map(angle).collect();
    angles.sort_by(f64::total_cmp);
    angles
}

#[test]
fn directions_of_a_swimmer_are_found_all_round() {
    for medium_index in [1.0, 4.0 / 3.0] {
        let camera = Camera {
            medium_index,
            ..CAMERA
        };
        let (truth, measured) = swimmer(600, &camera);
        let found = estimate(&measured, &camera, &ANIMAL, 30.0);
        let angles = angles_deg(&truth, &found);
        assert_eq!(angles.len(), 600);
        assert!(
            angles[300] < 6.0 && angles[540] < 15.0,
            "{} {}",
            angles[300],
            angles[540]
        );
        let depth_error = |(truth, found): (&Truth, &Option<Direction>)| {
            let z = found.as_ref().expect("found").z_apparent_m;
            (camera.point_in_camera([0.0; 2], z)[2] - truth.position_m[2]).powi(2)
        };
        let squares: f64 = truth.iter().zip(&found).map(depth_error).sum();
        assert!(
            (squares / 600.0).sqrt() < 0.02,
            "{}",
            (squares / 600.0).sqrt()
        );
    }
}

#[test]
fn cut_frames_and_short_gaps_are_bridged_and_long_gaps_are_not() {
    let (truth, mut measured) = swimmer(400, &CAMERA);
    for one in measured[100..140].iter_mut().flatten() {
        one.cut = true;
    }
    measured[200..210].fill(None);
    measured[300..330].fill(None);
    let found = estimate(&measured, &CAMERA, &ANIMAL, 30.0);
    assert!(found[205].is_some() && found[120].is_some());
    assert!(found[315].is_none());
    let angles = angles_deg(&truth, &found);
    assert!(
        angles[angles.len() / 2] < 10.0,
        "{}",
        angles[angles.len() / 2]
    );
}

#[test]
fn a_given_head_outweighs_the_motion() {
    let (truth, mut measured) = swimmer(300, &CAMERA);
    let backward = truth[150].forward.map(|c| -c);
    for one in measured[149..152].iter_mut().flatten() {
        one.given_head_px = Some([backward[0], backward[1]]);
    }
    let found = estimate(&measured, &CAMERA, &ANIMAL, 30.0);
    let forward = found[150].expect("found").forward;
    assert!(forward[0] * backward[0] + forward[1] * backward[1] > -1e-3);
}

#[test]
fn too_few_measurements_give_no_direction() {
    let (_, measured) = swimmer(20, &CAMERA);
    assert!(
        estimate(&measured, &CAMERA, &ANIMAL, 30.0)
            .iter()
            .all(Option::is_none)
    );
    assert!(
        estimate(&[None; 50], &CAMERA, &ANIMAL, 30.0)
            .iter()
            .all(Option::is_none)
    );
}

#[test]
fn a_mirrored_turn_is_corrected() {
    let (truth, measured) = swimmer(800, &CAMERA);
    let observations = Observations::new(&measured, &CAMERA, 30.0).expect("measured");
    let shape = Shape::initial(&observations, &ANIMAL).expect("measured");
    let energy = Energy {
        observations: &observations,
        shape: &shape,
    };
    let mut right = sphere::decode(&observations, &shape).initial_states(&observations, &shape);
    for (state, truth) in right.iter_mut().zip(&truth) {
        state.yaw = libm::atan2(truth.forward[2], truth.forward[0]);
        state.pitch = libm::asin(truth.forward[1]);
    }
    mirror::unwrap_yaw(&mut right);
    solve::minimize(&energy, &mut right);
    let away = |state: &State| libm::sin(state.yaw) > 0.0;
    let ends: Vec<usize> = (1..800)
        .filter(|&k| away(&right[k]) != away(&right[k - 1]))
        .collect();
    let turns = ends.windows(2).map(|pair| pair[0]..pair[1]);
    let range = turns
        .min_by_key(|turn| turn.len().abs_diff(60))
        .expect("it turns");
    let mut wrong = right.clone();
    for state in &mut wrong[range.clone()] {
        state.yaw = -state.yaw;
    }
    mirror::unwrap_yaw(&mut wrong);
    solve::minimize(&energy, &mut wrong);
    let middle = range.start.midpoint(range.end);
    assert_ne!(away(&wrong[middle]), away(&right[middle]), "still mirrored");
    mirror::improve(&energy, &mut wrong);
    assert_eq!(away(&wrong[middle]), away(&right[middle]));
    solve::minimize(&energy, &mut wrong);
    assert!(energy.cost(0, &wrong) < 1.01 * energy.cost(0, &right));
}
