//! headings.svg: the heading over time in degrees (Okabe et al., figure 5). -90 degrees (up) is near the top.
//!
//! A strip below shows the confidence of the head. Frames without a heading are shaded.

use std::f64::consts::PI;
use std::fmt::Write;

use super::axis::Axis;
use super::curve::{CurvePoint, wrapped};
use super::{LEFT, RIGHT, Sheet, fill, runs};
use crate::library::{Pose, Poses};

const HEIGHT: f64 = 340.0;
const TOP: f64 = 40.0;
const BOTTOM: f64 = 262.0;
/// Top and bottom of the strip of head confidence.
const STRIP: [f64; 2] = [272.0, 298.0];
/// Confidence below which a heading is drawn with a thin line. Free choice.
const MIN_CONFIDENCE: f64 = 0.9;

/// Returns the heading over time as an SVG picture of 960 by 340.
pub fn headings(poses: &Poses) -> String {
    let n_known = poses
        .frames
        .iter()
        .filter(|pose| pose.heading_rad.is_some())
        .count();
    let axis = Axis::of_time(poses);
    let y = |heading: f64| TOP + (heading + PI) / (2.0 * PI) * (BOTTOM - TOP);
    let mut sheet = Sheet::new(
        HEIGHT,
        "Heading over time",
        &format!(
            "Where the head points in the picture, in degrees, over {:.1} seconds; known in {n_known} of \
             {} frames. 0 is right, 90 down, 180 left, -90 up.",
            axis.end,
            poses.frames.len()
        ),
    );
    sheet.text("ink", "start", [16.0, 24.0], "Heading, degrees");
    axis.draw(&mut sheet, TOP, STRIP[1]);
    grid(&mut sheet, poses, &axis, y);
    let pen = |is_confident: bool| {
        if is_confident {
            "stroke-width=\"1.8\""
        } else {
            "stroke-width=\"0.7\""
        }
    };
    for is_confident in [false, true] {
        let of =
            |pose: &Pose| (pose.head_confidence.unwrap_or(1.0) >= MIN_CONFIDENCE) == is_confident;
        let more = format!(
            "{} stroke-linejoin=\"round\" stroke-linecap=\"round\"",
            pen(is_confident)
        );
        let path = line(poses, of, |t| axis.x(t), y);
        sheet.stroke("accent", &path, &more);
    }
    strip(&mut sheet, poses, &axis);
    sheet.finish()
}

/// Draws the grid with the names of directions, and shades frames without a heading.
fn grid(sheet: &mut Sheet, poses: &Poses, axis: &Axis, y: impl Fn(f64) -> f64) {
    for [from, to] in runs(poses.frames.len(), |k| {
        poses.frames[k].heading_rad.is_none()
    }) {
        let (x0, x1) = (
            axis.x(from as f64 / poses.fps),
            axis.x(to as f64 / poses.fps),
        );
        sheet.rect(
            "sunken",
            [x0, TOP, (x1.min(RIGHT) - x0).max(0.5), BOTTOM - TOP],
        );
    }
    for (degrees, word) in [
        (-180, "left"),
        (-90, "up"),
        (0, "right"),
        (90, "down"),
        (180, "left"),
    ] {
        let at = y(f64::from(degrees) * PI / 180.0);
        sheet.stroke("line", &format!("M{LEFT} {at:.1}H{RIGHT}"), "");
        sheet.text(
            "soft",
            "end",
            [LEFT - 8.0, at + 4.0],
            &format!("{word} {degrees}°"),
        );
    }
}

/// Draws the confidence of the head, 0.5 at the bottom to 1 at the top.
fn strip(sheet: &mut Sheet, poses: &Poses, axis: &Axis) {
    sheet.text("soft", "end", [LEFT - 8.0, STRIP[1] - 8.0], "head sure");
    sheet.rect(
        "sunken",
        [LEFT, STRIP[0], RIGHT - LEFT, STRIP[1] - STRIP[0]],
    );
    let height = |pose: &Pose| {
        let confidence = pose.head_confidence;
        let share = confidence.map_or(0.0, |confidence| (2.0 * confidence - 1.0).clamp(0.0, 1.0));
        STRIP[1] - share * (STRIP[1] - STRIP[0])
    };
    let mut path = format!("M{LEFT} {}", STRIP[1]);
    for pose in poses.frames.iter().step_by(stride(poses)) {
        write!(path, "L{:.1} {:.1}", axis.x(pose.time_s), height(pose)).expect("memory");
    }
    sheet.write(format_args!(
        "<path {} d=\"{path}L{RIGHT} {}Z\"/>\n",
        fill("water"),
        STRIP[1]
    ));
}

/// Returns the step between drawn frames, which limits the number of points.
fn stride(poses: &Poses) -> usize {
    poses.frames.len().div_ceil(6000).max(1)
}

/// Returns the line as path data. It contains the chosen poses and the step to each.
fn line(
    poses: &Poses,
    is_chosen: impl Fn(&Pose) -> bool,
    x: impl Fn(f64) -> f64,
    y: impl Fn(f64) -> f64,
) -> String {
    let place = |pose: &Pose| CurvePoint {
        x: x(pose.time_s),
        heading_rad: pose.heading_rad,
        is_drawn: is_chosen(pose),
    };
    let poses = poses.frames.iter().step_by(stride(poses));
    wrapped(poses.map(place), y)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::library::{Pose, View};

    fn poses(headings: &[Option<f64>]) -> Poses {
        let pose = |(k, &heading_rad): (usize, &Option<f64>)| Pose {
            time_s: k as f64,
            heading_rad,
            ..Pose::default()
        };
        let frames = headings.iter().enumerate().map(pose).collect();
        Poses {
            tail_beat: None,
            fps: 1.0,
            image_size_px: [8, 8],
            view: View::Side,
            view_confidence: None,
            other_movers: Vec::new(),
            camera: None,
            animal: None,
            frames,
        }
    }

    #[test]
    fn unknown_heading_breaks_the_line() {
        let strokes = |headings: &[Option<f64>]| {
            let line = line(&poses(headings), |_| true, |t| t, |h| h);
            line.matches('M').count()
        };
        assert_eq!(strokes(&[Some(0.1), Some(0.5), Some(2.0)]), 1);
        assert_eq!(strokes(&[Some(0.0), None, Some(0.0)]), 2);
        let svg = headings(&poses(&[Some(3.0), Some(-3.0), None, Some(-2.0)]));
        assert!(svg.contains("known in 3 of 4 frames"));
    }
}
