//! Limits of the numbers in library.json and poses.json. A library may come from another person, and the algorithms rely
//! on what an analysis writes: indices that exist, and numbers whose products stay finite.
//!
//! The limits are far beyond what any footage gives. They are free choices, unless they name a reason.

use std::ops::RangeInclusive;

use super::{Error, MAX_PIXELS, MAX_SIDE_PX};
use crate::formats::library_json::Summary;
use crate::geometry::{Camera, Rect};
use crate::library::{Animal, Pose, Poses, RawPose, Shadow, TailBeat};
use crate::parameters::Parameters;

/// Frame rate, frames per second.
const FPS: RangeInclusive<f64> = 1e-4..=1e4;
/// Time, seconds: a million frames at the least frame rate.
const TIME_S: RangeInclusive<f64> = -1e10..=1e10;
/// Coordinate in the picture, pixels.
const PLACE_PX: RangeInclusive<f64> = -1e6..=1e6;
/// Length in the picture, pixels.
const LENGTH_PX: RangeInclusive<f64> = 0.0..=1e6;
/// Size of an animal or distance of a camera, metres.
const LENGTH_M: RangeInclusive<f64> = 1e-6..=1e4;
/// Coordinate in space, metres.
const PLACE_M: RangeInclusive<f64> = -1e6..=1e6;
/// Angle, radians: one turn to either side.
const ANGLE_RAD: RangeInclusive<f64> = -6.3..=6.3;
/// Component of a unit vector, with room for rounding.
const COMPONENT: RangeInclusive<f64> = -1.01..=1.01;
/// Probability or share.
const SHARE: RangeInclusive<f64> = 0.0..=1.0;
/// Rate, per second, and any other number.
const NUMBER: RangeInclusive<f64> = -1e12..=1e12;
/// Scale of a sprite.
const SCALE: RangeInclusive<f64> = 0.01..=100.0;
/// Number of points of a midline.
const MIDLINE_POINTS: RangeInclusive<usize> = 2..=1000;
/// Distance of two clips: the largest sum of 8-bit differences that a clip of the largest sprites can have.
const MAX_DISTANCE: u64 = 1 << 60;

/// Checks all numbers of library.json.
pub(super) fn check(summary: &Summary, n_frames: usize) -> Result<(), Error> {
    check_graph(summary, n_frames)?;
    check_summary(summary, n_frames)
}

/// Fails with the name of a value that is out of range.
fn require(holds: bool, name: &'static str) -> Result<(), Error> {
    holds.then_some(()).ok_or(Error::OutOfRange(name))
}

/// Returns whether all values lie in a range. NaN lies in none.
fn lie(values: impl IntoIterator<Item = f64>, range: &RangeInclusive<f64>) -> bool {
    values.into_iter().all(|value| range.contains(&value))
}

/// Checks all numbers of poses.json.
pub(super) fn check_poses(poses: &Poses) -> Result<(), Error> {
    let [width, height] = poses.image_size_px;
    let sides = 1..=MAX_SIDE_PX;
    let n_pixels = u64::from(width) * u64::from(height);
    let is_size = sides.contains(&width) && sides.contains(&height) && n_pixels <= MAX_PIXELS;
    require(is_size, "image_size_px of poses.json")?;
    require(FPS.contains(&poses.fps), "fps of poses.json")?;
    require(poses.camera.is_none_or(is_camera), "camera of poses.json")?;
    require(poses.animal.is_none_or(is_animal), "animal of poses.json")?;
    require(
        lie(poses.view_confidence, &SHARE),
        "view_confidence of poses.json",
    )?;
    let movers = poses.other_movers.iter();
    let is_mover = movers.clone().all(|mover| {
        lie([mover.from_s, mover.to_s], &TIME_S) && is_inside(&mover.box_px, poses.image_size_px)
    });
    require(is_mover, "other_movers of poses.json")?;
    let n_frames = poses.frames.len();
    let is_beat = (poses.tail_beat.as_ref()).is_none_or(|beat| is_tail_beat(beat, n_frames));
    require(is_beat, "tail_beat of poses.json")?;
    let is_pose = |pose: &Pose| is_pose(pose, poses.image_size_px);
    require(poses.frames.iter().all(is_pose), "frames of poses.json")
}

fn is_camera(camera: Camera) -> bool {
    LENGTH_M.contains(&camera.z_min_m)
        && (1e-6..=1e9).contains(&camera.pane_px_per_m)
        && lie(camera.center_px, &PLACE_PX)
        && (0.1..=10.0).contains(&camera.medium_index)
}

fn is_animal(animal: Animal) -> bool {
    lie([animal.length_m, animal.height_m], &LENGTH_M)
}

fn is_inside(rect: &Rect, [width, height]: [u32; 2]) -> bool {
    let ends = |from: u32, n: u32, end: u32| from.checked_add(n).is_some_and(|to| to <= end);
    ends(rect.x, rect.w, width) && ends(rect.y, rect.h, height)
}

fn is_tail_beat(beat: &TailBeat, n_frames: usize) -> bool {
    beat.spans.iter().all(|span| {
        let [first, end] = span.frames;
        first <= end
            && end <= n_frames
            && lie([span.start_s, span.end_s], &TIME_S)
            && lie([span.frequency_hz, span.amplitude], &NUMBER)
            && SHARE.contains(&span.confidence)
    })
}

fn is_pose(pose: &Pose, image_size_px: [u32; 2]) -> bool {
    let shares = [
        pose.confidence,
        pose.head_confidence,
        pose.depth_sign_confidence,
    ];
    let lengths_px = [pose.length_px, pose.height_px];
    let angles_rad = [
        pose.axis_rad,
        pose.heading_rad,
        pose.bend_rad,
        pose.yaw_rad,
        pose.pitch_rad,
        pose.gamma_rad,
    ];
    let is_midline = |points: &Vec<[f64; 2]>| {
        MIDLINE_POINTS.contains(&points.len()) && lie(points.iter().flatten().copied(), &PLACE_PX)
    };
    TIME_S.contains(&pose.time_s)
        && lie(shares.into_iter().flatten(), &SHARE)
        && lie(pose.centroid_px.into_iter().flatten(), &PLACE_PX)
        && (pose.box_px.as_ref()).is_none_or(|rect| is_inside(rect, image_size_px))
        && lie(pose.area_px, &(0.0..=1e12))
        && lie(lengths_px.into_iter().flatten(), &LENGTH_PX)
        && lie(angles_rad.into_iter().flatten(), &ANGLE_RAD)
        && lie(pose.skew, &NUMBER)
        && pose.midline_px.as_ref().is_none_or(is_midline)
        && is_in_space(pose.position_m, pose.forward)
        && pose.raw.as_ref().is_none_or(is_raw)
}

fn is_raw(raw: &RawPose) -> bool {
    let angles_rad = [raw.heading_rad, raw.gamma_rad];
    lie(angles_rad.into_iter().flatten(), &ANGLE_RAD) && is_in_space(raw.position_m, raw.forward)
}

fn is_in_space(position_m: Option<[f64; 3]>, forward: Option<[f64; 3]>) -> bool {
    lie(position_m.into_iter().flatten(), &PLACE_M)
        && lie(forward.into_iter().flatten(), &COMPONENT)
}

/// Checks the playback graph: frames exist, the component rises, and jumps lie within it.
fn check_graph(summary: &Summary, n_frames: usize) -> Result<(), Error> {
    let component = &summary.playback.component;
    let exists = |frame: u32| (frame as usize) < n_frames;
    let rises = component.windows(2).all(|pair| pair[0] < pair[1]);
    let is_component = rises && component.last().is_none_or(|&last| exists(last));
    require(is_component, "component of library.json")?;
    let is_playable = |frame: &u32| component.binary_search(frame).is_ok();
    let jumps = summary.playback.jumps.iter();
    let is_graph = jumps
        .clone()
        .all(|jump| is_playable(&jump.from) && is_playable(&jump.to) && jump.cost <= MAX_DISTANCE);
    require(is_graph, "playback of library.json")?;
    let is_transitions = summary.transitions.iter().all(|pair| {
        exists(pair.from)
            && exists(pair.to)
            && pair.distance <= MAX_DISTANCE
            && ANGLE_RAD.contains(&pair.heading_gap_rad)
    });
    require(is_transitions, "transitions of library.json")?;
    let n_patches = summary.patches.len();
    let is_patches = summary.patches.iter().all(|patch| {
        let frames = &patch.frames;
        frames.start <= frames.end
            && frames.end as usize <= n_frames
            && patch.next.iter().all(|&next| (next as usize) < n_patches)
    });
    require(is_patches, "patches of library.json")
}

fn check_summary(summary: &Summary, n_frames: usize) -> Result<(), Error> {
    let params = &summary.params;
    require(params.check().is_ok(), "params of library.json")?;
    let is_clip = (1..=params.max_clip_frames() as usize).contains(&summary.clip_frames);
    require(is_clip, "clip_frames of library.json")?;
    let distances = [summary.epsilon, summary.natural_step];
    let is_distance = distances.iter().all(|&distance| distance <= MAX_DISTANCE);
    require(is_distance, "epsilon or natural_step of library.json")?;
    let scales = summary.sprite_scale.as_deref();
    if scales.is_some_and(|all| all.len() != n_frames) {
        return Err(Error::Mismatch(
            "sprite_scale in library.json must have one value per frame",
        ));
    }
    let is_scale = lie(scales.into_iter().flatten().copied(), &SCALE);
    require(is_scale, "sprite_scale of library.json")?;
    let is_shadow = summary.shadow.as_ref().is_none_or(is_shadow);
    require(is_shadow, "shadow of library.json")?;
    let [width, height] = summary.sprite_size_px.map(u64::from);
    let sides = 1..=u64::from(MAX_SIDE_PX);
    let is_size = sides.contains(&width) && sides.contains(&height) && width * height <= MAX_PIXELS;
    require(is_size, "sprite_size_px of library.json")?;
    let stats = &summary.stats;
    let speeds = stats.speed_bl_per_s.into_iter().flatten();
    let disturbed = stats.disturbances.iter();
    let is_stats = lie(disturbed.flat_map(|d| [d.from_s, d.to_s]), &TIME_S)
        && lie(speeds.chain(stats.turn_rate_rad_per_s), &(0.0..=1e6))
        && lie(stats.length_px, &LENGTH_PX)
        && lie([stats.component_share], &SHARE)
        && lie(stats.first_foreign_s, &TIME_S)
        && lie(stats.kappa_used, &NUMBER);
    require(is_stats, "stats of library.json")
}

fn is_shadow(shadow: &Shadow) -> bool {
    lie([shadow.darkness, shadow.blur_bl], &SHARE) && lie(shadow.offset_bl, &(-1.0..=1.0))
}

#[cfg(test)]
mod tests {
    use std::fs;
    use std::path::Path;
    use std::sync::Arc;

    use serde_json::Value;

    use super::super::{read, write};
    use crate::analysis::Params;
    use crate::flock::synthetic;
    use crate::formats::library_json::FootageSummary;
    use crate::library::{Playback, View};
    use crate::scratch::InMemory;

    /// Returns the sentence with which a library is refused if a value of a file is replaced.
    fn refusal(folder: &Path, file: &str, pointer: &str, value: &Value) -> String {
        let path = folder.join(file);
        let before = fs::read(&path).expect("a file");
        let mut json: Value = serde_json::from_slice(&before).expect("JSON");
        let (parent, field) = pointer.rsplit_once('/').expect("a pointer");
        let parent = json.pointer_mut(parent).expect(pointer);
        match parent {
            Value::Array(items) => items[field.parse::<usize>().expect(pointer)] = value.clone(),
            parent => parent[field] = value.clone(),
        }
        fs::write(&path, json.to_string()).expect("written");
        let found = read(folder, Arc::new(InMemory::default()));
        fs::write(&path, before).expect("written");
        found.err().map_or(String::new(), |error| error.to_string())
    }

    /// File, place and value of numbers out of range. The sentence names the first part of the place.
    const BEYOND: &str = r#"
        poses.json /fps 1e308
        poses.json /fps 0.0
        poses.json /image_size_px [70000,70000]
        poses.json /camera {"z_min_m":1e-308,"pane_px_per_m":1.0,"center_px":[0.0,0.0],"medium_index":1.0}
        poses.json /animal {"length_m":1e308,"height_m":1.0}
        poses.json /frames/3/time_s 1e308
        poses.json /frames/3/centroid_px/1 -1e308
        poses.json /frames/3/heading_rad 1e308
        poses.json /frames/3/length_px -1.0
        poses.json /frames/3/box_px [4294967295,0,4294967295,1]
        poses.json /frames/3/forward/0 2.0
        poses.json /frames/3/midline_px [[0.0,0.0]]
        library.json /clip_frames 1152921504606846976
        library.json /clip_frames 0
        library.json /epsilon 18446744073709551615
        library.json /component/1 0
        library.json /playback/0 [0,4294967295,1]
        library.json /transitions/0/to 600
        library.json /patches/0/next/0 7
        library.json /sprite_size_px [16384,16384]
        library.json /stats/length_px 1e308
        library.json /stats/speed_bl_per_s/1 1e308
        library.json /params/kappa 1e308"#;

    #[test]
    fn numbers_beyond_any_footage_are_refused_by_name() {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let folder = folder.path();
        let mut library = synthetic::library(View::Side);
        // Jumps of measured libraries lie within the component.
        let Playback { jumps, component } = &mut library.playback;
        jumps.retain(|jump| component.contains(&jump.from) && component.contains(&jump.to));
        let footage = FootageSummary {
            sha256: "ab".into(),
            n_bytes: 9,
        };
        write(folder, &library, &Params::default(), &footage).expect("written");
        assert_eq!(refusal(folder, "poses.json", "/fps", &30.0.into()), "");
        for line in BEYOND.trim().lines() {
            let mut parts = line.split_whitespace();
            let mut part = || parts.next().expect(line);
            let (file, pointer, value) = (part(), part(), part());
            let value = serde_json::from_str(value).expect(line);
            let sentence = refusal(folder, file, pointer, &value);
            let name = pointer.split('/').nth(1).expect(line);
            let start = format!("out of range: {name}");
            assert!(sentence.starts_with(&start), "{line}: {sentence}");
        }
    }
}
