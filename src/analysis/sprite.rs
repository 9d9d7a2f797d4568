//! Mattes made into sprites: one size, the centroid at the middle (O 3.1; ALGORITHMS.md 5).

use std::sync::Arc;

use super::track::sighting::Sighting;
use super::track::{Track, Tracked};
use crate::library::{Matte, Poses, Sprites, View};
use crate::order::median;

/// Room around the largest silhouette.
const MARGIN_PX: f64 = 4.0;
/// An animal of a smaller median area is too small to be looked at.
const LEAST_AREA_PX: f64 = 24.0;
/// Sides are multiples of this.
const MULTIPLE: u32 = 8;

/// Sprites of one height: never enlarged by more, nor reduced by more.
const SCALES: [f64; 2] = [0.25, 1.5];
/// A height is the median over so much time: fins open and close.
const HEIGHT_SPAN_S: f64 = 0.5;

/// The size of every frame's sprite relative to the frame at which the animal has its median height; by its depth
/// where that was measured. To 5 decimals, as files hold them.
pub fn scales(poses: &Poses) -> Vec<f64> {
    let frames = &poses.frames;
    let reach = (HEIGHT_SPAN_S * poses.fps / 2.0).round() as usize;
    let near = |frame: usize| {
        let around = frame.saturating_sub(reach)..(frame + reach + 1).min(frames.len());
        median(frames[around].iter().filter_map(|pose| pose.height_px))
    };
    let depth = |frame: usize| {
        let z_m = frames[frame].position_m?[2];
        Some(poses.camera?.apparent_from_true_depth_m(z_m))
    };
    // What grows as the animal gets smaller in the picture.
    let is_deep = frames.iter().any(|pose| pose.position_m.is_some());
    let farness: Vec<Option<f64>> = (0..frames.len())
        .map(|frame| match is_deep {
            true => depth(frame),
            false => near(frame).map(|height_px| 1.0 / height_px),
        })
        .collect();
    let usual = median(farness.iter().flatten().copied()).unwrap_or(1.0);
    let scale = |far: &Option<f64>| {
        let scale = far.map_or(1.0, |far| (far / usual).clamp(SCALES[0], SCALES[1]));
        (scale * 1e5).round() / 1e5
    };
    farness.iter().map(scale).collect()
}

/// The sprites of a track, of the size filmed or of `scales`: its mattes, each with its centroid. The box holds the
/// largest extent from the centroid over the frames in which the animal is not cut off; from above it is a square
/// that holds the animal at any turn. `is_in_light` says which plates were filmed in the light of the background; in any
/// other the animal has other colors, and no sprites.
pub fn align(
    track: &Track,
    view: View,
    scales: Option<Vec<f64>>,
    is_in_light: impl Fn(usize) -> bool,
) -> Sprites {
    let scale = |frame_idx: usize| scales.as_ref().map_or(1.0, |scales| scales[frame_idx]);
    let size = common_size(&track.frames, view, &scale);
    let of = |t: &Tracked| {
        let sighting = t.sighting.as_ref()?;
        t.plate_idx
            .is_some_and(&is_in_light)
            .then(|| matte(sighting))
    };
    let mattes = track.frames.iter().map(of).collect();
    Sprites::of(size, mattes, scales, Arc::clone(&track.scratch))
}

fn matte(sighting: &Sighting) -> Matte {
    let rect = sighting.rect;
    let [x, y] = sighting.moments.centroid_px;
    let thousandths = |px: f64| (px * 1000.0).round() / 1000.0;
    Matte {
        size: [rect.w, rect.h],
        center_px: [(x, rect.x), (y, rect.y)].map(|(px, from)| thousandths(px - f64::from(from))),
        at: sighting.at,
    }
}

/// Whether the animal covers, in the median, fewer pixels than are worth looking at.
pub fn is_too_small(track: &[Tracked]) -> bool {
    let sightings = track.iter().filter_map(|t| t.sighting.as_ref());
    let mut areas_px: Vec<f64> = sightings.map(|s| s.moments.area_px).collect();
    areas_px.sort_by(f64::total_cmp);
    areas_px
        .get(areas_px.len() / 2)
        .is_some_and(|&area_px| area_px < LEAST_AREA_PX)
}

/// The sprites of an animal that none are cut of: all missing.
pub fn none(n_frames: usize) -> Sprites {
    Sprites::missing(MULTIPLE, MULTIPLE, n_frames)
}

fn common_size(track: &[Tracked], view: View, scale: &dyn Fn(usize) -> f64) -> [u32; 2] {
    let seen = |(idx, tracked): (usize, &Tracked)| {
        let sighting = tracked.sighting.as_ref()?;
        Some((sighting.cut, sighting.reach_px.map(|px| px * scale(idx))))
    };
    let all = || track.iter().enumerate().filter_map(seen);
    let reach = |sightings: &mut dyn Iterator<Item = (bool, [f64; 3])>| {
        sightings
            .map(|seen| seen.1)
            .fold([0.0f64; 3], |most, reach| {
                [
                    most[0].max(reach[0]),
                    most[1].max(reach[1]),
                    most[2].max(reach[2]),
                ]
            })
    };
    let whole = reach(&mut all().filter(|seen| !seen.0));
    // An animal that is never seen whole has sprites all the same.
    let [x, y, radius] = if whole[2] > 0.0 {
        whole
    } else {
        reach(&mut all())
    };
    let side = |reach: f64| ((2.0 * reach + MARGIN_PX).ceil() as u32).next_multiple_of(MULTIPLE);
    match view {
        View::Side => [side(x), side(y)],
        View::Top => [side(radius); 2],
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::Camera;
    use crate::library::Pose;

    fn poses(frames: Vec<Pose>) -> Poses {
        Poses {
            tail_beat: None,
            // So slow that every frame is looked at by itself.
            fps: 1.0,
            image_size_px: [640, 480],
            view: View::Side,
            view_confidence: None,
            other_movers: Vec::new(),
            camera: None,
            animal: None,
            frames,
        }
    }

    #[test]
    fn who_looks_half_as_tall_is_enlarged_but_not_beyond_the_limit_and_who_was_not_seen_stays() {
        let of_height = |height_px| Pose {
            height_px,
            ..Pose::default()
        };
        let heights = [
            Some(40.0),
            Some(32.0),
            Some(80.0),
            Some(10.0),
            None,
            Some(40.0),
            Some(40.0),
        ];
        let frames = heights.map(of_height).to_vec();
        assert_eq!(scales(&poses(frames)), [1.0, 1.25, 0.5, 1.5, 1.0, 1.0, 1.0]);
    }

    #[test]
    fn where_depth_was_measured_it_decides_and_not_the_fins() {
        let at = |z_m| Pose {
            position_m: Some([0.0, 0.0, z_m]),
            height_px: Some(1000.0 * z_m * z_m),
            ..Pose::default()
        };
        let camera = Camera {
            z_min_m: 0.7,
            pane_px_per_m: 1000.0,
            center_px: [320.0, 240.0],
            medium_index: 1.0,
        };
        let poses = Poses {
            camera: Some(camera),
            ..poses(vec![at(0.8), at(1.0), at(1.2)])
        };
        assert_eq!(scales(&poses), [0.8, 1.0, 1.2]);
    }
}
