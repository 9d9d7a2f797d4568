//! Guesses whether the animal is filmed from the side or from above, when the user does not say. See
//! docs/explanation/algorithms.md, "Pose".

use std::f64::consts::FRAC_PI_3;

use crate::analysis::track::Tracked;
use crate::analysis::track::sighting::Sighting;
use crate::library::View;
use crate::order::{median, percentile};

/// Least length of a usable silhouette, as a share of the 90th percentile of lengths. Free choice.
const MIN_LENGTH_SHARE: f64 = 0.7;
/// Least ratio of the standard deviations along and across the axis. Free choice.
const MIN_ELONGATION: f64 = 1.3;
/// Least number of usable frames; with fewer the view is unknown. Free choice.
const MIN_FRAMES: usize = 8;
/// Asymmetry at which both views are equally likely, standard deviations squared. On the labelled clips, it
/// is 0.07 to 0.7 from above and at least 4 from the side.
const EVEN_ASYMMETRY: f64 = 1.7;
/// Greatest probability of a guess. Free choice.
const MAX_PROBABILITY: f64 = 0.99;

/// Returns the guessed view and the probability that it is right, 0.5..=1.
///
/// From the side, the animal has a back and a belly: its upper and lower half differ in mass and brightness,
/// with one sign in all frames. From above, either flank can be the upper half, so the sign changes. The
/// statistic is the median of each difference over its spread. Frames that are cut by the border, or show
/// the animal steep or short, are left out.
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
        .filter(|s| s.extent_px[0] >= MIN_LENGTH_SHARE * longest)
        .filter(|s| s.moments.eigenvalue_ratio >= MIN_ELONGATION * MIN_ELONGATION)
        .filter(|s| {
            s.moments
                .major_rad
                .is_some_and(|axis| axis.abs() < FRAC_PI_3)
        })
        .collect();
    if level.len() < MIN_FRAMES {
        return (View::Side, 0.5);
    }
    let mass = level.iter().map(|s| s.moments.skew[1]);
    let shade = level
        .iter()
        .filter_map(|s| Some(s.asymmetry.as_ref()?.shade));
    let asymmetry = constancy(mass.collect()).powi(2) + constancy(shade.collect()).powi(2);
    let odds = (asymmetry / EVEN_ASYMMETRY).powi(2);
    let side = odds / (1.0 + odds);
    if side >= 0.5 {
        (View::Side, side.min(MAX_PROBABILITY))
    } else {
        (View::Top, (1.0 - side).min(MAX_PROBABILITY))
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
    use crate::analysis::pose::synthetic::{Appearance, fish};

    fn tracked(appearance: impl Fn(usize) -> Appearance) -> Vec<Tracked> {
        (0..40).map(|k| fish(k, appearance(k))).collect()
    }

    #[test]
    fn a_dark_back_above_a_light_belly_means_side_view() {
        let (view, probability) = guess(&tracked(|k| Appearance {
            is_left: k >= 20,
            is_upper_dark: true,
        }));
        assert_eq!(view, View::Side);
        assert!(probability > 0.9, "{probability}");
    }

    #[test]
    fn a_light_flank_that_changes_sides_with_the_direction_means_top_view() {
        let (view, probability) = guess(&tracked(|k| Appearance {
            is_left: k >= 20,
            is_upper_dark: k >= 20,
        }));
        assert_eq!(view, View::Top);
        assert!(probability > 0.9, "{probability}");
    }

    #[test]
    fn few_frames_leave_the_view_unknown() {
        let appearance = Appearance {
            is_left: false,
            is_upper_dark: true,
        };
        let few: Vec<Tracked> = (0..MIN_FRAMES - 1).map(|k| fish(k, appearance)).collect();
        assert_eq!(guess(&few), (View::Side, 0.5));
    }
}
