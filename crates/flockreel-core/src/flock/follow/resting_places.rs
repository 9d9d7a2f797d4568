//! Resting places in side view. Animals rest where the filmed animal rested: a bird on a perch, a dog on the
//! floor.
//!
//! An animal that comes to rest within a segment is led to the nearest resting place. The corrections are as
//! small as those toward a boid.

use crate::flock::lens::Lens;
use crate::flock::motion::FrameMotion;
use crate::library::{Library, View};

/// Speed below which the animal rests, body lengths per second. Free choice.
const REST_BL_PER_S: f64 = 0.1;
/// Least duration of a rest, seconds. Free choice: fish pause for shorter times in open water.
pub(super) const REST_S: f64 = 0.7;
/// Distance below which two resting places count as one, body lengths. Free choice.
const SAME_BL: f64 = 0.1;

/// Resting places of the filmed animal.
#[derive(Clone, Debug, Default)]
pub(in crate::flock) struct RestingPlaces {
    /// Positions in the image, pixels. Empty in top view, where the animal may rest anywhere.
    places_px: Vec<[f64; 2]>,
    /// Share of the frames in which the animal rests, 0..=1.
    rest_share: f64,
}

/// Way from the position before a frame to the next rest.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct WayToRest {
    /// Displacement, pixels.
    way_px: [f64; 2],
    /// Length along the way, pixels.
    length_px: f64,
    /// Length of the step of this frame, pixels.
    step_px: f64,
}

/// Returns whether the animal rests.
pub(super) fn rests(moved: &FrameMotion) -> bool {
    moved.speed_bl_per_s < REST_BL_PER_S
}

/// Returns the way to the next rest of at least `n_rest` frames, by frame. `steps` holds, by frame, whether
/// the animal rests and its step from the previous frame, pixels.
pub(super) fn ways_to_rest(steps: &[(bool, [f64; 2])], n_rest: usize) -> Vec<Option<WayToRest>> {
    let mut ways = vec![None; steps.len()];
    let mut ahead: Option<WayToRest> = None;
    let mut n_rested = 0;
    for (t, &(rests, step)) in steps.iter().enumerate().rev() {
        n_rested = if rests { n_rested + 1 } else { 0 };
        if n_rested >= n_rest {
            ahead = Some(WayToRest::default());
        } else if let Some(rest) = &mut ahead {
            let step_px = libm::hypot(step[0], step[1]);
            *rest = WayToRest {
                way_px: [0, 1].map(|axis| rest.way_px[axis] + step[axis]),
                length_px: rest.length_px + step_px,
                step_px,
            };
            ways[t] = ahead;
        }
    }
    ways
}

impl RestingPlaces {
    /// Returns the resting places of a library's animal. `lens` gives the body length in pixels.
    pub(in crate::flock) fn new(
        library: &Library,
        motion: &[FrameMotion],
        lens: &Lens,
    ) -> RestingPlaces {
        let mut resting_places = RestingPlaces::default();
        let poses = &library.poses;
        if poses.view == View::Top {
            return resting_places;
        }
        let same_px = SAME_BL * lens.length_px;
        let n_rest = (REST_S * poses.fps).ceil() as usize;
        let frames: Vec<usize> = (0..motion.len()).collect();
        let is_known = |frame: &usize| poses.frames[*frame].heading_rad.is_some();
        let is_at_rest = |frame: &usize| rests(&motion[*frame]) && is_known(frame);
        let mut n_rested = 0;
        let runs = frames.chunk_by(|a, b| is_at_rest(a) && is_at_rest(b));
        for frame in runs.filter(|run| run.len() >= n_rest).flatten() {
            let Some(place) = poses.frames[*frame].centroid_px else {
                continue;
            };
            n_rested += 1;
            if (resting_places.places_px.iter()).all(|known| gap(known, &place) >= same_px) {
                resting_places.places_px.push(place);
            }
        }
        let n_known = frames.iter().filter(|frame| is_known(frame)).count();
        resting_places.rest_share = f64::from(n_rested) / n_known.max(1) as f64;
        resting_places
    }

    /// Returns the number of animals that find a resting place at least `clear_px` from the others. Each is
    /// assumed to rest for as much of the time as the filmed one. Returns `None` if the filmed animal never
    /// rested.
    pub(in crate::flock) fn capacity(&self, clearance_px: f64) -> Option<u32> {
        let mut clear: Vec<[f64; 2]> = Vec::new();
        for place in &self.places_px {
            if clear.iter().all(|other| gap(other, place) >= clearance_px) {
                clear.push(*place);
            }
        }
        (self.rest_share > 0.0).then(|| (clear.len() as f64 / self.rest_share).ceil() as u32)
    }

    /// Returns the nearest resting place that is at least `clear_px` from all others, or `None`.
    pub(super) fn nearest(
        &self,
        from_px: [f64; 2],
        others: &[[f64; 2]],
        clearance_px: f64,
    ) -> Option<[f64; 2]> {
        let is_clear =
            |place: &&[f64; 2]| others.iter().all(|other| gap(place, other) >= clearance_px);
        let clear = self.places_px.iter().filter(is_clear);
        clear
            .min_by(|a, b| gap(a, &from_px).total_cmp(&gap(b, &from_px)))
            .copied()
    }
}

fn gap(a: &[f64; 2], b: &[f64; 2]) -> f64 {
    libm::hypot(a[0] - b[0], a[1] - b[1])
}

impl WayToRest {
    /// Returns the correction of the step of this frame, pixels. The corrections of all steps together lead
    /// from the end of the way to the nearest resting place clear of `others`. Each is proportional to the
    /// length of its step. Returns `None` if no resting place is clear.
    pub(super) fn correction(
        &self,
        place_px: [f64; 2],
        resting_places: &RestingPlaces,
        others: &[[f64; 2]],
        clearance_px: f64,
    ) -> Option<[f64; 2]> {
        let end = [0, 1].map(|axis| place_px[axis] + self.way_px[axis]);
        let elsewhere: Vec<[f64; 2]> = others
            .iter()
            .copied()
            .filter(|other| *other != place_px)
            .collect();
        let resting_place = resting_places.nearest(end, &elsewhere, clearance_px)?;
        let share = self.step_px / self.length_px.max(1e-9);
        Some([0, 1].map(|axis| share * (resting_place[axis] - end[axis])))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Ten steps to the right, then ten frames of rest.
    fn flight() -> Vec<(bool, [f64; 2])> {
        let step = |t| {
            if t < 10 {
                (false, [5.0, 0.0])
            } else {
                (true, [0.0; 2])
            }
        };
        (0..20).map(step).collect()
    }

    fn landed(resting_places: &RestingPlaces, others: &[[f64; 2]]) -> [f64; 2] {
        let mut place = [0.0, 0.0];
        for ((_, step), way) in flight().into_iter().zip(ways_to_rest(&flight(), 5)) {
            let correction = way.and_then(|way| way.correction(place, resting_places, others, 8.0));
            let [dx, dy] = correction.unwrap_or_default();
            place = [place[0] + step[0] + dx, place[1] + step[1] + dy];
        }
        place
    }

    #[test]
    fn animals_land_at_the_nearest_free_resting_place() {
        let resting_places = RestingPlaces {
            places_px: vec![[46.0, 6.0], [58.0, -4.0], [0.0, 50.0]],
            rest_share: 0.5,
        };
        let near = |a: [f64; 2], b: [f64; 2]| libm::hypot(a[0] - b[0], a[1] - b[1]) < 1e-6;
        assert!(near(landed(&resting_places, &[]), [46.0, 6.0]));
        assert!(near(landed(&resting_places, &[[44.0, 6.0]]), [58.0, -4.0]));
        assert!(near(landed(&RestingPlaces::default(), &[]), [50.0, 0.0]));
    }

    #[test]
    fn capacity_grows_with_the_time_not_rested() {
        let resting_places = RestingPlaces {
            places_px: vec![[46.0, 6.0], [58.0, -4.0], [0.0, 50.0]],
            rest_share: 0.5,
        };
        assert_eq!(resting_places.capacity(10.0), Some(6));
        assert_eq!(resting_places.capacity(20.0), Some(4));
        assert_eq!(RestingPlaces::default().capacity(10.0), None);
    }

    #[test]
    fn pauses_shorter_than_a_rest_are_ignored() {
        assert!(ways_to_rest(&flight(), 11).iter().all(Option::is_none));
        assert!(
            ways_to_rest(&flight(), 10)[..10]
                .iter()
                .all(Option::is_some)
        );
    }
}
