//! Tests of the midline on synthetic tapered bodies with a known bend.

use super::*;
use crate::analysis::pose::moments::moments;
use crate::analysis::track::Tracked;
use crate::geometry::Rect;
use crate::raster::RgbaImage;
use crate::scratch::{InMemory, Scratch};
use proptest::prelude::*;
use std::sync::Arc;

/// A fish in top view: a circular arc of length 80 that turns by `turn` over its length.
///
/// The body is thick in front and tapers to the tail. The head is at `start`; the body extends from there in
/// direction `away`.
struct BentFish {
    turn: f64,
    start: [f64; 2],
    away: f64,
}

const LENGTH: f64 = 80.0;

impl BentFish {
    fn at(&self, s: f64) -> [f64; 2] {
        let n = 200;
        let (mut p, ds) = (self.start, s * LENGTH / f64::from(n));
        for k in 0..n {
            let angle = self.away + self.turn * s * (f64::from(k) + 0.5) / f64::from(n);
            p = [p[0] + ds * angle.cos(), p[1] + ds * angle.sin()];
        }
        p
    }

    /// Half the thickness at share `s` of the length: round in front, thin behind.
    fn radius(s: f64) -> f64 {
        8.0 * (1.0 - s).powf(0.7) * (1.0 - (1.0 - s / 0.15).clamp(0.0, 1.0).powi(2)).sqrt() + 0.9
    }

    fn sighting(&self) -> (Sighting, RgbaImage) {
        let rect = Rect {
            x: 20,
            y: 10,
            w: 200,
            h: 200,
        };
        let spine: Vec<([f64; 2], f64)> = (0..=160)
            .map(|k| f64::from(k) / 160.0)
            .map(|s| (self.at(s), BentFish::radius(s)))
            .collect();
        let mut image = RgbaImage::new(rect.w, rect.h);
        for (k, pixel) in image.pixels.chunks_exact_mut(4).enumerate() {
            let p = [
                20.5 + (k % rect.w as usize) as f64,
                10.5 + (k / rect.w as usize) as f64,
            ];
            let depth = spine
                .iter()
                .map(|(q, radius)| radius - distance(p, *q))
                .fold(f64::NEG_INFINITY, f64::max);
            pixel[3] = (255.0 * (depth + 0.5).clamp(0.0, 1.0)) as u8;
        }
        let alpha: Vec<u8> = image.pixels.chunks_exact(4).map(|p| p[3]).collect();
        let sighting = Sighting {
            moments: moments(rect, &alpha).expect("it is opaque"),
            rect,
            at: 0,
            reach_px: [0.0; 3],
            edge_share: None,
            confidence: 1.0,
            asymmetry: None,
            body_rad: None,
            body_extent_px: [LENGTH, 16.0],
            extent_px: [LENGTH, 16.0],
            upright_px: f64::from(rect.h),
            box_px: rect,
            cut: false,
            seen: None,
            surroundings: None,
        };
        (sighting, image)
    }

    /// Returns the pose as the analysis would measure it, with the heading along the major axis.
    fn pose(&self) -> Pose {
        let axis = self.sighting().0.moments.major_rad.expect("it is long");
        let (head, tail) = (self.at(0.0), self.at(1.0));
        let lead = (head[0] - tail[0]) * axis.cos() + (head[1] - tail[1]) * axis.sin();
        Pose {
            heading_rad: Some(if lead >= 0.0 {
                axis
            } else {
                wrap_rad(axis + std::f64::consts::PI)
            }),
            length_px: Some(distance(head, tail)),
            height_px: Some(16.0),
            ..Pose::default()
        }
    }

    fn midline(&self) -> Vec<[f64; 2]> {
        let (sighting, image) = self.sighting();
        extract(&sighting, &image, &self.pose())
            .expect("it has an outline")
            .points
    }

    /// Returns the root mean square distance of the points from the true curve, extended to the surface.
    fn error_px(&self, found: &[[f64; 2]]) -> f64 {
        let truth: Vec<[f64; 2]> = (-20..=410).map(|k| self.at(f64::from(k) / 400.0)).collect();
        let off = |p: &[f64; 2]| {
            truth
                .iter()
                .map(|q| distance(*p, *q))
                .fold(f64::INFINITY, f64::min)
        };
        (found.iter().map(|p| off(p).powi(2)).sum::<f64>() / found.len() as f64).sqrt()
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(24))]
    #[test]
    fn the_midline_of_a_bent_fish_is_within_one_pixel(
        turn in -2.2f64..2.2, away in -3.1f64..3.1, dx in 0.0f64..1.0, dy in 0.0f64..1.0,
    ) {
        let fish = BentFish { turn, start: [120.0 + dx, 110.0 + dy], away };
        let found = fish.midline();
        prop_assert!(fish.error_px(&found) < 1.0, "{} px", fish.error_px(&found));
        prop_assert!(distance(found[0], fish.at(-0.04)) < 4.0, "head first: {:?}", found[0]);
        prop_assert!(distance(found[10], fish.at(1.0)) < 3.5, "tail last: {:?}", found[10]);
        // The centers of the outer thirds are two thirds of the length apart.
        prop_assert!((bend_rad(&found) - turn * 2.0 / 3.0).abs() < 0.12, "{}", bend_rad(&found));
    }
}

fn poses(view: View, pose: Pose) -> Poses {
    Poses {
        tail_beat: None,
        fps: 30.0,
        image_size_px: [240, 220],
        view,
        view_confidence: None,
        other_movers: Vec::new(),
        camera: None,
        animal: None,
        frames: vec![pose],
    }
}

fn track(fish: &BentFish) -> Track {
    let (mut sighting, image) = fish.sighting();
    let scratch = Arc::new(InMemory::default());
    sighting.at = scratch.put(&image.pixels).expect("memory has room");
    let sighting = Some(sighting);
    let frames = vec![Tracked {
        time_s: 0.0,
        background_idx: Some(0),
        sighting,
    }];
    Track {
        frames,
        movers: Vec::new(),
        disturbances: Vec::new(),
        scratch,
    }
}

const BENT: BentFish = BentFish {
    turn: 1.0,
    start: [80.0, 80.0],
    away: 0.4,
};

#[test]
fn in_side_view_only_elongated_animals_have_a_midline() {
    let high = Pose {
        height_px: Some(40.0),
        ..BENT.pose()
    };
    for (pose, has_one) in [(high, false), (BENT.pose(), true)] {
        let mut poses = poses(View::Side, pose);
        trace(&mut poses, &track(&BENT));
        assert_eq!(poses.frames[0].midline_px.is_some(), has_one);
        assert_eq!(poses.frames[0].bend_rad.is_some(), has_one);
    }
}

#[test]
fn an_unknown_heading_leaves_the_midline_unknown() {
    let pose = Pose {
        heading_rad: None,
        ..BENT.pose()
    };
    let mut poses = poses(View::Top, pose);
    trace(&mut poses, &track(&BENT));
    assert_eq!(poses.frames[0].midline_px, None);
}

#[test]
fn implausible_midlines_are_replaced_by_cross_sections() {
    // The measured length of 1000 makes every midline from the outline look too short.
    let pose = Pose {
        length_px: Some(1000.0),
        ..BENT.pose()
    };
    let (sighting, image) = BENT.sighting();
    let found = extract(&sighting, &image, &pose).expect("it has sections");
    assert_eq!(found.points.len(), N_POINTS);
    assert!(BENT.error_px(&found.points) < 3.0);
    assert!(distance(found.points[0], BENT.at(0.0)) < 10.0, "head first");
}

#[test]
fn bend_of_a_right_angle_is_a_quarter_circle() {
    let straight: Vec<[f64; 2]> = (0..N_POINTS).map(|k| [-(k as f64), 3.0]).collect();
    assert_eq!(bend_rad(&straight), 0.0);
    let corner = [[0.0, 0.0], [-3.0, 0.0], [-3.0, 3.0]];
    assert!((bend_rad(&corner).abs() - std::f64::consts::FRAC_PI_2).abs() < 1e-9);
}

#[test]
fn the_midline_of_a_broad_head_begins_between_its_eyes() {
    // A hammer-shaped head with an eye at each corner, and a long thin tail.
    let rect = Rect::of_size(120, 60);
    let mut image = RgbaImage::new(rect.w, rect.h);
    for (k, pixel) in image.pixels.chunks_exact_mut(4).enumerate() {
        let p = [(k % 120) as f64 + 0.5, (k / 120) as f64 + 0.5];
        let eyes = [22.0, 38.0].map(|y| 5.0 - distance(p, [98.0, y]));
        let head = 5.0 - (p[1] - 30.0).abs().max((p[0] - 94.0).abs() - 3.0);
        let tail = 1.6 - (p[1] - 30.0).abs().max((p[0] - 50.0).abs() - 42.0);
        let depth = eyes[0].max(eyes[1]).max(head).max(tail);
        pixel[3] = (255.0 * (depth + 0.5).clamp(0.0, 1.0)) as u8;
    }
    let (mut sighting, _) = BENT.sighting();
    sighting.rect = rect;
    let pose = Pose {
        heading_rad: Some(0.0),
        length_px: Some(95.0),
        ..Pose::default()
    };
    let found = extract(&sighting, &image, &pose);
    let found = found.expect("it has an outline").points;
    assert!((found[0][1] - 30.0).abs() < 2.0, "head: {:?}", found[0]);
    assert!(
        distance(found[10], [7.0, 30.0]) < 3.0,
        "tail: {:?}",
        found[10]
    );
}
