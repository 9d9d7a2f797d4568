//! Compares analyses of real recordings with manual labels (`bench/labels`). FLOCKREEL_FOOTAGE names the
//! folder of recordings, which are not in the repository. Whole clips are evaluated by `make accuracy`
//! (docs/measurements.md).

use std::path::Path;
use std::sync::Arc;

use flockreel::media::{Limits, Video};
use flockreel_core::analysis::{Error, Params, analyze};
use flockreel_core::cpu::Level;
use flockreel_core::footage::Part;
use flockreel_core::library::Library;
use flockreel_core::progress::Silent;
use flockreel_core::scratch::{InMemory, Scratch};
use serde_json::Value;

use crate::common::film::footage;

/// Length of the analyzed part of a clip, seconds: the large pictures of the goldfish take longest. Free choice.
fn seconds(clip: &str) -> f64 {
    if clip == "goldfish_black_water.mp4" {
        7.0
    } else {
        10.0
    }
}

/// Returns the labels of a clip.
fn labels(name: &str) -> Value {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("bench/labels/{name}.json"));
    let text = std::fs::read(path).expect("labels");
    serde_json::from_slice(&text).expect("JSON")
}

/// Analyzes the beginning of a clip. Returns `None` without FLOCKREEL_FOOTAGE.
fn measured(labels: &Value) -> Option<Result<Library, Error>> {
    let name = labels["clip"].as_str().expect("a name");
    let video = Video::open(&footage()?.join(name), &Limits::default()).expect("a film");
    let scratch: Arc<dyn Scratch> = Arc::new(InMemory::default());
    let part = Part::new(&video, None, Some(seconds(name)));
    let params = Params::default();
    Some(analyze(
        &part,
        None,
        &params,
        Level::detect(),
        &scratch,
        &Silent,
    ))
}

fn point(value: &Value) -> Option<[f64; 2]> {
    Some([value[0].as_f64()?, value[1].as_f64()?])
}

fn distance([ax, ay]: [f64; 2], [bx, by]: [f64; 2]) -> f64 {
    (ax - bx).hypot(ay - by)
}

/// Asserts that the animal is detected in 95 % of the labeled frames in which it is visible. Each centroid
/// must be within a quarter of the animal's length of its label, and the view must match.
fn check(name: &str) {
    check_but(name, 0);
}

/// Checks as [`check`] does, but lets `n_known` centroids be farther off.
fn check_but(name: &str, n_known: usize) {
    let labels = labels(name);
    let Some(library) = measured(&labels) else {
        return;
    };
    let library = library.unwrap_or_else(|error| panic!("{name}: {error}"));
    let rows = labels["frames"].as_array().expect("rows");
    let length = |row: &Value| {
        Some(distance(
            point(&row["nose_px"])?,
            point(&row["tail_base_px"])?,
        ))
    };
    let length_px = rows.iter().filter_map(length).fold(0.0, f64::max);
    let (mut n, mut n_found, mut far) = (0, 0, Vec::new());
    for row in rows.iter().filter(|row| row["visible"] == true) {
        let frame = row["frame"].as_u64().expect("a number") as usize;
        let Some(pose) = library.poses.frames.get(frame) else {
            continue;
        };
        n += 1;
        n_found += usize::from(pose.detected());
        if let Some((found, truth)) = pose.centroid_px.zip(point(&row["centroid_px"])) {
            let off = distance(found, truth) / length_px;
            if off >= 0.25 {
                far.push((frame, off));
            }
        }
    }
    assert!(far.len() <= n_known, "{name}, lengths off: {far:?}");
    assert!(n >= 6 && 20 * n_found >= 19 * n, "{name}: {n_found} of {n}");
    assert_eq!(
        format!("{:?}", library.poses.view).to_lowercase(),
        labels["view"],
        "{name}"
    );
}

#[test]
fn goldfish_from_the_side() {
    check("goldfish_black_water");
}

#[test]
fn mice_from_above() {
    check("mouse_openfield");
    check("mouse_round_arena");
}

#[test]
fn finch_behind_wires() {
    check("zebra_finch_cage");
}

#[test]
fn fish_from_above() {
    check("zebrafish_larva_single");
    check("zebrafish_juvenile_single");
}

#[test]
fn dog_beside_an_arm() {
    // In three frames the arm, which has the dog's color, is measured with it (docs/explanation/limits.md).
    check_but("dog_side_with_hand", 3);
}

#[test]
fn two_flies_are_refused() {
    if let Some(library) = measured(&labels("flies_pair")) {
        assert!(matches!(library, Err(Error::SeveralAnimals { .. })));
    }
}
