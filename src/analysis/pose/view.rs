//! From where the animal is seen, when nobody says (ALGORITHMS.md 4).

use std::f64::consts::{FRAC_PI_4, PI};

use crate::analysis::sighting::Sighting;
use crate::analysis::tracking::Tracked;
use crate::library::View;
use crate::order::{median, percentile};

/// From the side an animal has a back and a belly (the skew across its length keeps its sign), and stays
/// as tall when it turns. From above it has a left and a right, bends, and lies at any angle.
pub(super) fn guess(track: &[Tracked]) -> View {
    const LEVEL: f64 = PI / 3.0;
    let sightings: Vec<&Sighting> = track.iter().filter_map(|t| t.sighting.as_ref()).collect();
    let mut lengths: Vec<f64> = sightings.iter().map(|s| s.extent_px[0]).collect();
    let Some(longest) = percentile(&mut lengths, 0.9) else {
        return View::Side;
    };
    let long = 0.7 * longest;
    let at_length = sightings.iter().filter(|s| s.extent_px[0] >= long);
    let seen: Vec<(f64, f64)> = at_length
        .filter_map(|s| Some((s.moments.major_rad?, s.moments.skew[1])))
        .collect();
    let steep = seen
        .iter()
        .filter(|(axis, _)| axis.abs() > FRAC_PI_4)
        .count();
    let steep_share = steep as f64 / seen.len().max(1) as f64;
    let across: Vec<f64> = seen
        .iter()
        .filter(|(axis, _)| axis.abs() < LEVEL)
        .map(|(_, skew)| *skew)
        .collect();
    // Medians: silhouettes that went wrong in a tenth of the frames must not show a back.
    let usual = median(across.iter().copied()).unwrap_or(0.0);
    let spread = 1.4826 * median(across.iter().map(|skew| (skew - usual).abs())).unwrap_or(0.0);
    let has_back_and_belly = usual.abs() >= (0.5 * spread).max(0.2);
    // Turning toward the camera shortens it and leaves it as tall.
    let sizes = |c: usize| {
        sightings
            .iter()
            .map(move |s| s.moments.covariance_px2[c].sqrt())
    };
    let stands_upright = variation(sizes(2).collect()) < 0.5 * variation(sizes(0).collect());
    let square = across
        .iter()
        .map(|skew| (skew - usual).powi(2))
        .sum::<f64>();
    let deviation = (square / across.len().max(1) as f64).sqrt();
    let bends_or_turns = deviation > 0.12 || steep_share > 0.15;
    if !has_back_and_belly && !stands_upright && bends_or_turns {
        View::Top
    } else {
        View::Side
    }
}

/// How far the middle two thirds of values spread about their median, as a share of it.
fn variation(mut values: Vec<f64>) -> f64 {
    let at = [1.0, 3.0, 5.0].map(|sixth| percentile(&mut values, sixth / 6.0));
    match at {
        [Some(low), Some(middle), Some(high)] => (high - low) / (2.0 * middle.max(1e-9)),
        _ => 0.0,
    }
}
