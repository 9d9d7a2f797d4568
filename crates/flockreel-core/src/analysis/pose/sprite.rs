//! Sprites from mattes: all of one size, with the centroid at the center (Okabe et al., section 3.1).
//!
//! See docs/explanation/algorithms.md, "Sprites".

use std::sync::Arc;

use crate::analysis::track::sighting::Sighting;
use crate::analysis::track::{Track, Tracked};
use crate::library::{Matte, Poses, Sprites, View};
use crate::order::median;

/// Margin added to the width and height of the largest silhouette, pixels. Free choice.
const MARGIN_PX: f64 = 4.0;
/// Least median area of an animal for sprites, pixels. Free choice.
const MIN_AREA_PX: f64 = 24.0;
/// The sides of a sprite are multiples of this, pixels. Free choice.
const SIZE_STEP: u32 = 8;

/// Smallest and greatest scale of a sprite. Free choice.
const SCALE_RANGE: [f64; 2] = [0.25, 1.5];
/// Span of the running median of the height, seconds: fins open and close. Free choice.
const HEIGHT_SPAN_S: f64 = 0.5;

/// Returns each frame's scale, relative to the frame with the animal's median height, rounded to 5 decimals.
///
/// The apparent depth decides instead of the height if depths were measured. Frames without a value get 1.
pub fn scales(poses: &Poses) -> Vec<f64> {
    let frames = &poses.frames;
    let half_span = (HEIGHT_SPAN_S * poses.fps / 2.0).round() as usize;
    let median_height_px = |frame: usize| {
        let around = frame.saturating_sub(half_span)..(frame + half_span + 1).min(frames.len());
        median(frames[around].iter().filter_map(|pose| pose.height_px))
    };
    let depth = |frame: usize| {
        let z_m = frames[frame].position_m?[2];
        Some(poses.camera?.apparent_from_true_depth_m(z_m))
    };
    // A quantity that grows as the animal appears smaller.
    let has_depth = frames.iter().any(|pose| pose.position_m.is_some());
    let farness = |frame: usize| {
        if has_depth {
            depth(frame)
        } else {
            median_height_px(frame).map(|height_px| 1.0 / height_px)
        }
    };
    let farness: Vec<Option<f64>> = (0..frames.len()).map(farness).collect();
    let typical = median(farness.iter().flatten().copied()).unwrap_or(1.0);
    let scale = |far: &Option<f64>| {
        let scale = far.map_or(1.0, |far| {
            (far / typical).clamp(SCALE_RANGE[0], SCALE_RANGE[1])
        });
        (scale * 1e5).round() / 1e5
    };
    farness.iter().map(scale).collect()
}

/// Returns the sprites of a track, in the filmed size or scaled by `scales`.
///
/// The common box holds the largest extent from the centroid over the uncut frames. In top view it is a
/// square that holds the animal at any rotation. `is_in_light` returns whether a background has the light of
/// the main one. In another light the animal has other colors, so those frames have no sprites.
pub fn align(
    track: &Track,
    view: View,
    scales: Option<Vec<f64>>,
    is_in_light: impl Fn(usize) -> bool,
) -> Sprites {
    let scale = |frame_idx: usize| scales.as_ref().map_or(1.0, |scales| scales[frame_idx]);
    let size = common_size(&track.frames, view, &scale);
    let matte_in_light = |tracked: &Tracked| {
        let sighting = tracked.sighting.as_ref()?;
        let is_in_light = tracked.background_idx.is_some_and(&is_in_light);
        is_in_light.then(|| matte(sighting))
    };
    let mattes = track.frames.iter().map(matte_in_light).collect();
    Sprites::new(size, mattes, scales, Arc::clone(&track.scratch))
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

/// Returns whether the animal's median area is too small for sprites.
pub fn is_too_small(track: &[Tracked]) -> bool {
    let sightings = track.iter().filter_map(|t| t.sighting.as_ref());
    median(sightings.map(|s| s.moments.area_px)).is_some_and(|area_px| area_px < MIN_AREA_PX)
}

/// Returns missing sprites for all frames, for an animal that is too small.
pub fn missing(n_frames: usize) -> Sprites {
    Sprites::missing(SIZE_STEP, SIZE_STEP, n_frames)
}

fn common_size(track: &[Tracked], view: View, scale: &dyn Fn(usize) -> f64) -> [u32; 2] {
    let largest_extent_px = |include: &dyn Fn(&Sighting) -> bool| {
        let mut largest = [0.0f64; 3];
        for (frame_idx, tracked) in track.iter().enumerate() {
            if let Some(sighting) = tracked.sighting.as_ref().filter(|s| include(s)) {
                for (largest, extent_px) in largest.iter_mut().zip(sighting.reach_px) {
                    *largest = largest.max(extent_px * scale(frame_idx));
                }
            }
        }
        largest
    };
    let mut extent_px = largest_extent_px(&|sighting| !sighting.cut);
    if extent_px[2] <= 0.0 {
        // An animal that is cut in all frames has sprites too.
        extent_px = largest_extent_px(&|_| true);
    }
    let [x, y, radius] =
        extent_px.map(|px| ((2.0 * px + MARGIN_PX).ceil() as u32).next_multiple_of(SIZE_STEP));
    match view {
        View::Side => [x, y],
        View::Top => [radius; 2],
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
            // At 1 frame per second, the running median has one frame.
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
    fn small_animals_are_enlarged_up_to_the_limit() {
        let pose_of_height = |height_px| Pose {
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
        let frames = heights.map(pose_of_height).to_vec();
        assert_eq!(scales(&poses(frames)), [1.0, 1.25, 0.5, 1.5, 1.0, 1.0, 1.0]);
    }

    #[test]
    fn measured_depth_decides_instead_of_height() {
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
