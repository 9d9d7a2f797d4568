//! From where the animal is seen, when nobody says (ALGORITHMS.md 4).

use std::f64::consts::FRAC_PI_3;

use crate::analysis::track::Tracked;
use crate::analysis::track::sighting::Sighting;
use crate::library::View;
use crate::order::{median, percentile};

/// A silhouette of this share of the 90th percentile of the lengths is seen at length.
const AT_LENGTH: f64 = 0.7;
/// Standard deviations along and across the axis are in this ratio at least.
const LONG: f64 = 1.3;
/// Fewer frames than these say nothing.
const LEAST_FRAMES: usize = 8;
/// The asymmetry at which both views are as likely, in standard deviations, squared. The labelled clips from above have .07
/// to .7, those from the side 4 and more.
const EVEN: f64 = 1.7;
/// Surer than this nobody can be from a silhouette.
const MOST: f64 = 0.99;

/// The guessed view and the probability that it is right, .5..=1.
///
/// From the side an animal has a back and a belly: its mass and its brightness differ from the upper to the lower side, the same
/// way in all frames. From above it has a left and a right, which lie up and down by turns. So what counts is the mean of that
/// difference over its spread. Frames that the border cuts, or that show the animal steeply or end-on, are left out.
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

/// The median of values over their spread; both ignore silhouettes that went wrong.
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
