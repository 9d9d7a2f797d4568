//! Guesses whether the animal is filmed from the side or from above, when the user does not say. See
//! docs/explanation/algorithms.md, "Pose".

use std::f64::consts::FRAC_PI_3;

use crate::analysis::track::Tracked;
use crate::analysis::track::sighting::Sighting;
use crate::library::View;
use crate::order::{median, percentile};

/// Least length of a usable silhouette, as a share of the 90th percentile of lengths. Free choice.
const AT_LENGTH: f64 = 0.7;
/// Least ratio of the standard deviations along and across the axis. Free choice.
const LONG: f64 = 1.3;
/// Least number of usable frames; with fewer the view is unknown. Free choice.
const LEAST_FRAMES: usize = 8;
/// Asymmetry at which both views are equally likely, standard deviations squared. On the labelled clips, it
/// is 0.07 to 0.7 from above and at least 4 from the side.
const EVEN: f64 = 1.7;
/// Greatest probability of a guess. Free choice.
const MOST: f64 = 0.99;

/// Returns the guessed view and the probability that it is right, 0.5..=1.
///
/// From the side, the animal has a back and a belly: mass and brightness differ between its upper and lower
/// half, alike in all frames. From above, left and right are up and down in turn, so the differences change
/// sign. The statistic is the median of each difference over its spread. Frames that are cut by the border,
/// or show the animal steep or short, are left out.
///
/// Returns the side view at 0.5 with too few frames.
pub(super) fn guess(track: &[Tracked]) -> (View, f64) {
    let whole = || {
        let sightings = track.iter().filter_map(|t| t.sighting.as_ref());
        sightings.filter(|sighting| !sighting.cut)
    };
    let mut lengths: Vec<f64> = whole().map(|s| s.extent_px[0]).collect();
    let longest = percentile(&mut lengths, 0.9).unwrap_or(0.0);
    let level: Vec<&Sighting> = whole()
        .filter(|s| s.extent_px[0] >= AT_LENGTH * longest)
        .filter(|s| s.moments.eigenvalue_ratio >= LONG * LONG)
        .filter(|s| {
            s.moments
                .major_rad
                .is_some_and(|axis| axis.abs() < FRAC_PI_3)
        })
        .collect();
    if level.len() < LEAST_FRAMES {
        return (View::Side, 0.5);
    }
    let mass = level.iter().map(|s| s.moments.skew[1]);
    let shade = level
        .iter()
        .filter_map(|s| Some(s.asymmetry.as_ref()?.shade));
    let asymmetry = constancy(mass.collect()).powi(2) + constancy(shade.collect()).powi(2);
    let odds = (asymmetry / EVEN).powi(2);
    let side = odds / (1.0 + odds);
    match side >= 0.5 {
        true => (View::Side, side.min(MOST)),
        false => (View::Top, (1.0 - side).min(MOST)),
    }
}

/// Returns the median of values over their spread. Both are robust against failed silhouettes.
fn constancy(values: Vec<f64>) -> f64 {
    let usual = median(values.iter().copied()).unwrap_or(0.0);
    let spread = median(values.iter().map(|value| (value - usual).abs())).unwrap_or(0.0);
    usual / (1.4826 * spread).max(0.01)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::analysis::pose::painted::{Look, fish};

    fn tracked(look: impl Fn(usize) -> Look) -> Vec<Tracked> {
        (0..40).map(|k| fish(k, look(k))).collect()
    }

    #[test]
    fn a_dark_back_above_a_light_belly_is_seen_from_the_side() {
        let (view, probability) = guess(&tracked(|k| Look {
            is_left: k >= 20,
            is_upper_dark: true,
        }));
        assert_eq!(view, View::Side);
        assert!(probability > 0.9, "{probability}");
    }

    #[test]
    fn a_light_flank_that_is_up_when_it_goes_one_way_and_down_when_it_goes_back_is_seen_from_above()
    {
        let (view, probability) = guess(&tracked(|k| Look {
            is_left: k >= 20,
            is_upper_dark: k >= 20,
        }));
        assert_eq!(view, View::Top);
        assert!(probability > 0.9, "{probability}");
    }

    #[test]
    fn of_a_few_frames_nothing_is_known() {
        let look = Look {
            is_left: false,
            is_upper_dark: true,
        };
        let few: Vec<Tracked> = (0..LEAST_FRAMES - 1).map(|k| fish(k, look)).collect();
        assert_eq!(guess(&few), (View::Side, 0.5));
    }
}
