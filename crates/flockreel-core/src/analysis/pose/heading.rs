//! Decides which end is the head, in all frames together.
//!
//! Each frame has two states: the head at either end of the length axis. Motion toward an end and the
//! appearance of the ends (`appearance`) are evidence for a state. A turn of the head by more than a quarter circle
//! is expensive while the animal appears long. The Viterbi algorithm finds the cheapest sequence, the
//! forward-backward algorithm its probability. Okabe et al., section 3.3, use only the previous frame, so
//! that one early error lasts forever. See docs/explanation/algorithms.md, "Pose".

use super::Axes;
use super::appearance::SPAN_S;

/// Speed along the axis that counts as evidence 1, body lengths per second. Free choice.
const UNIT_SPEED_BL_S: f64 = 0.45;
/// Greatest evidence from motion, half the log-odds. Free choice.
const MAX_MOTION_EVIDENCE: f64 = 3.0;
/// Evidence where the user gave the head; it exceeds all other evidence.
const GIVEN_HEAD_EVIDENCE: f64 = 1e6;

/// The head in one frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Head {
    /// Whether the head lies toward +axis, with the axis in (-pi/2, pi/2].
    pub(super) forward: bool,
    /// Posterior probability of the chosen end, 0..=1; below 0.5 where the cheapest sequence contradicts it.
    pub(super) confidence: f64,
}

/// The head in one frame, as the user gave it.
#[derive(Clone, Copy, Debug)]
pub(super) struct GivenHead {
    /// Frame number.
    pub(super) frame_idx: usize,
    /// Whether the head lies toward +axis.
    pub(super) forward: bool,
}

/// Costs of keeping and of changing the state between two frames.
#[derive(Clone, Copy, Default)]
struct SwitchCosts {
    keep: f64,
    change: f64,
}

/// Decides for every frame with an axis; other frames get `None`.
///
/// `speed_along` is the speed toward +axis, body lengths per second. `ends` is the evidence of the ends for
/// +axis, half the log-odds. A frame counts as its share of an independent moment.
pub(super) fn decode(
    axes: &[Option<Axes>],
    speed_along: &[Option<f64>],
    ends: &[Option<f64>],
    given_head: Option<GivenHead>,
    fps: f64,
) -> Vec<Option<Head>> {
    let share = (1.0 / (SPAN_S * fps)).min(1.0);
    let evidence = |k: usize| {
        axes[k].as_ref()?.axis_rad?;
        let speed = speed_along[k].unwrap_or(0.0);
        let motion = (speed / UNIT_SPEED_BL_S).clamp(-MAX_MOTION_EVIDENCE, MAX_MOTION_EVIDENCE);
        let given = match given_head.filter(|head| head.frame_idx == k) {
            Some(head) if head.forward => GIVEN_HEAD_EVIDENCE,
            Some(_) => -GIVEN_HEAD_EVIDENCE,
            None => 0.0,
        };
        Some(share * (motion + ends[k].unwrap_or(0.0)) + given)
    };
    let evidence: Vec<Option<f64>> = (0..axes.len()).map(evidence).collect();
    let seen: Vec<usize> = (0..axes.len()).filter(|&k| evidence[k].is_some()).collect();
    let emissions: Vec<f64> = seen.iter().filter_map(|&k| evidence[k]).collect();
    let seen_axes: Vec<&Axes> = seen.iter().filter_map(|&k| axes[k].as_ref()).collect();
    let switches: Vec<SwitchCosts> = (seen_axes.windows(2))
        .map(|pair| switch_costs(pair[0], pair[1]))
        .collect();
    let path = viterbi(&emissions, &switches);
    let posterior = forward_backward(&emissions, &switches);
    let mut heads = vec![None; axes.len()];
    for ((&k, forward), p) in seen.iter().zip(path).zip(posterior) {
        heads[k] = Some(Head {
            forward,
            confidence: if forward { p } else { 1.0 - p },
        });
    }
    heads
}

/// Decides as Okabe et al., section 3.3, print it: the head turns least from the previous frame.
///
/// In the first frame it lies toward +axis. The rule gives no probability, so the confidence is 0.5.
pub(super) fn least_turn(axes: &[Option<Axes>]) -> Vec<Option<Head>> {
    let mut last: Option<[f64; 2]> = None;
    let mut head = |axes: &Option<Axes>| {
        let u = axes.as_ref()?.direction()?;
        let forward = last.is_none_or(|v| u[0] * v[0] + u[1] * v[1] >= 0.0);
        last = Some(if forward { u } else { [-u[0], -u[1]] });
        Some(Head {
            forward,
            confidence: 0.5,
        })
    };
    axes.iter().map(&mut head).collect()
}

/// Returns the speed along +axis in each frame, body lengths per second.
pub(super) fn speed_along(
    axes: &[Option<Axes>],
    velocity_px: &[Option<[f64; 2]>],
    length_px: f64,
) -> Vec<Option<f64>> {
    let speed = |(axes, velocity): (&Option<Axes>, &Option<[f64; 2]>)| {
        let (u, v) = (axes.as_ref()?.direction()?, (*velocity)?);
        Some((v[0] * u[0] + v[1] * u[1]) / length_px)
    };
    axes.iter().zip(velocity_px).map(speed).collect()
}

/// Returns the costs of keeping and of changing the state between two axes.
fn switch_costs(a: &Axes, b: &Axes) -> SwitchCosts {
    let (Some(u), Some(v)) = (a.direction(), b.direction()) else {
        return SwitchCosts::default();
    };
    let cost = 2.0 + 10.0 * (b.length_px / (2.5 * b.height_px.max(1.0))).clamp(0.0, 1.0);
    // The axis itself may flip across the vertical; then the head turns when the state is kept.
    let (keep, change) = if u[0] * v[0] + u[1] * v[1] >= 0.0 {
        (0.0, cost)
    } else {
        (cost, 0.0)
    };
    SwitchCosts { keep, change }
}

/// Returns the cheapest sequence: true where the head lies toward +axis.
fn viterbi(emissions: &[f64], switches: &[SwitchCosts]) -> Vec<bool> {
    let mut costs = [0.0f64; 2];
    let mut came_from: Vec<[usize; 2]> = Vec::with_capacity(emissions.len());
    for (k, &evidence) in emissions.iter().enumerate() {
        let switch = if k == 0 {
            SwitchCosts::default()
        } else {
            switches[k - 1]
        };
        let mut next = [0.0; 2];
        let mut from = [0; 2];
        for state in 0..2 {
            let (kept, changed) = (costs[state] + switch.keep, costs[1 - state] + switch.change);
            from[state] = if kept <= changed { state } else { 1 - state };
            next[state] = kept.min(changed) + if state == 1 { -evidence } else { evidence };
        }
        costs = next;
        came_from.push(from);
    }
    let mut state = usize::from(costs[1] < costs[0]);
    let mut path = vec![false; emissions.len()];
    for k in (0..emissions.len()).rev() {
        path[k] = state == 1;
        state = came_from[k][state];
    }
    path
}

/// Returns the posterior probability of the head toward +axis in each frame. Costs are negative logarithms.
fn forward_backward(emissions: &[f64], switches: &[SwitchCosts]) -> Vec<f64> {
    let n = emissions.len();
    let log_sum = |a: f64, b: f64| a.max(b) + libm::log1p(libm::exp(-(a - b).abs()));
    let pass = |order: &mut dyn Iterator<Item = usize>, switch: &dyn Fn(usize) -> SwitchCosts| {
        let mut messages = vec![[0.0f64; 2]; n];
        let mut last = [0.0f64; 2];
        for (step, k) in order.enumerate() {
            if step > 0 {
                let SwitchCosts { keep, change } = switch(k);
                last = [0, 1].map(|s: usize| log_sum(last[s] - keep, last[1 - s] - change));
                // Only the difference of the two states matters.
                last = [last[0] - last[1], 0.0];
            }
            messages[k] = last;
            last = [last[0] - emissions[k], last[1] + emissions[k]];
        }
        messages
    };
    let ahead = pass(&mut (0..n), &|k| switches[k - 1]);
    let behind = pass(&mut (0..n).rev(), &|k| switches[k]);
    (0..n)
        .map(|k| {
            let odds =
                (ahead[k][1] - ahead[k][0]) + (behind[k][1] - behind[k][0]) + 2.0 * emissions[k];
            1.0 / (1.0 + libm::exp(-odds))
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use std::f64::consts::{FRAC_PI_2, PI};

    use super::*;

    struct Circling {
        headings: Vec<f64>,
        axes: Vec<Option<Axes>>,
        velocity: Vec<Option<[f64; 2]>>,
    }

    /// An animal that swims in a circle, 60 px long, described by its axis only.
    fn circling(n: usize, speed_px_s: impl Fn(usize) -> f64) -> Circling {
        let heading = |k: usize| crate::geometry::wrap_rad(k as f64 * 0.05);
        let axis = |h: f64| {
            if h > FRAC_PI_2 {
                h - PI
            } else if h <= -FRAC_PI_2 {
                h + PI
            } else {
                h
            }
        };
        let headings: Vec<f64> = (0..n).map(heading).collect();
        let axes = headings
            .iter()
            .map(|&h| {
                let toward_axis = (axis(h) - h).abs() < 1e-9;
                let skew = if toward_axis { -0.3 } else { 0.3 };
                Some(Axes {
                    axis_rad: Some(axis(h)),
                    length_px: 60.0,
                    height_px: 20.0,
                    skew,
                })
            })
            .collect();
        let velocity = (0..n)
            .map(|k| {
                Some([
                    speed_px_s(k) * headings[k].cos(),
                    speed_px_s(k) * headings[k].sin(),
                ])
            })
            .collect();
        Circling {
            headings,
            axes,
            velocity,
        }
    }

    /// Decodes from motion only.
    fn decoded(
        axes: &[Option<Axes>],
        velocity: &[Option<[f64; 2]>],
        given_head: Option<GivenHead>,
    ) -> Vec<Option<Head>> {
        let ends = vec![None; axes.len()];
        decode(
            axes,
            &speed_along(axes, velocity, 60.0),
            &ends,
            given_head,
            30.0,
        )
    }

    fn errors(headings: &[f64], axes: &[Option<Axes>], heads: &[Option<Head>]) -> usize {
        let wrong = |k: &usize| {
            let axis = axes[*k]
                .as_ref()
                .and_then(|a| a.axis_rad)
                .expect("every frame has one");
            let toward_axis = crate::geometry::wrap_rad(headings[*k] - axis).abs() < 1e-6;
            heads[*k].expect("decided").forward != toward_axis
        };
        (0..headings.len()).filter(wrong).count()
    }

    #[test]
    fn the_head_is_right_all_round_a_circle() {
        let Circling {
            headings,
            axes,
            velocity,
        } = circling(400, |_| 60.0);
        let heads = decoded(&axes, &velocity, None);
        assert_eq!(errors(&headings, &axes, &heads), 0);
        assert!(heads.iter().flatten().all(|head| head.confidence > 0.99));
    }

    #[test]
    fn drifting_backward_slowly_does_not_turn_the_head() {
        let Circling {
            headings,
            axes,
            velocity,
        } = circling(400, |k| if (150..200).contains(&k) { -6.0 } else { 50.0 });
        let heads = decoded(&axes, &velocity, None);
        assert_eq!(errors(&headings, &axes, &heads), 0);
    }

    #[test]
    fn a_given_head_decides_for_an_animal_that_never_moves() {
        let axes = vec![
            Some(Axes {
                axis_rad: Some(0.1),
                length_px: 60.0,
                height_px: 20.0,
                skew: 0.0
            });
            30
        ];
        let velocity = vec![Some([0.0; 2]); 30];
        for forward in [true, false] {
            let given_head = GivenHead {
                frame_idx: 7,
                forward,
            };
            let heads = decoded(&axes, &velocity, Some(given_head));
            assert!(heads.iter().flatten().all(|head| head.forward == forward));
        }
    }

    #[test]
    fn with_the_least_turn_the_first_frame_decides_for_all() {
        let Circling { headings, axes, .. } = circling(400, |_| 0.0);
        for (start, right) in [(0, true), (50, false)] {
            let heads = least_turn(&axes[start..]);
            for ((head, axes), heading) in heads.iter().zip(&axes[start..]).zip(&headings[start..])
            {
                let u = axes.as_ref().and_then(Axes::direction).expect("it is long");
                let along = u[0] * libm::cos(*heading) + u[1] * libm::sin(*heading) > 0.0;
                assert_eq!(head.expect("it has an axis").forward == along, right);
            }
        }
    }
}
