//! The poses drawn over the footage (Okabe et al., figure 10): bounding box, centroid, heading arrow, path of
//! the last two seconds and midline. A label shows frame number and time.
//!
//! Every stroke has a dark outline, so that it is visible on light and dark pictures.

use crate::geometry::Rect;
use crate::library::{Pose, Poses};
use crate::raster::{Frame, Pen};

/// Length of the drawn path, seconds. Free choice.
const TRACE_S: f64 = 2.0;
pub(super) const RIM: [u8; 3] = [16, 24, 28];
const BOX: [u8; 3] = [236, 240, 238];
const TRACE: [u8; 3] = [84, 214, 230];
pub(super) const HEADING: [u8; 3] = [255, 132, 60];
const MIDLINE: [u8; 3] = [255, 226, 92];

/// Draws poses over the frames of one footage.
pub struct Overlay<'a> {
    poses: &'a Poses,
    pen: Pen,
    /// Unit of stroke widths, pixels; grows with the picture size.
    unit_px: f64,
    /// Length of the heading arrow, pixels.
    reach_px: f64,
}

impl<'a> Overlay<'a> {
    /// Makes an overlay for the poses of a footage.
    pub fn new(poses: &'a Poses) -> Overlay<'a> {
        let [width, height] = poses.image_size_px;
        let unit_px = unit_px(width, height);
        let mut lengths: Vec<f64> = poses.frames.iter().filter_map(|p| p.length_px).collect();
        lengths.sort_by(f64::total_cmp);
        let length_px = lengths.get(lengths.len() / 2).copied().unwrap_or(0.0);
        Overlay {
            poses,
            pen: Pen::new(width, height),
            unit_px,
            reach_px: (0.8 * length_px).max(18.0 * unit_px),
        }
    }

    /// Draws the pose of frame `frame_idx` over the frame. A frame after the last pose stays unchanged.
    /// Panics if the frame and the footage differ in size.
    pub fn draw(&mut self, frame_idx: usize, frame: &mut Frame) {
        let Some(pose) = self.poses.frames.get(frame_idx) else {
            return;
        };
        let (poses, unit) = (self.poses, self.unit_px);
        self.trace(frame_idx, frame);
        if let Some(rect) = pose.box_px {
            self.stroke(frame, &outline(&rect), 0.5 * unit, BOX);
        }
        if let Some(midline) = &pose.midline_px {
            self.stroke(frame, midline, 0.9 * unit, MIDLINE);
        }
        self.heading(pose, frame);
        let label = format!("{frame_idx:06}  {:.2} s", pose.time_s);
        let [dot, n_dots] = [1.6 * unit, 6.0 * label.len() as f64];
        // On a small picture the label would hide the animal.
        if n_dots * dot < 0.6 * f64::from(poses.image_size_px[0]) {
            self.label(frame, &label, dot);
        }
    }

    /// Draws the path of the last seconds, fading with age.
    fn trace(&mut self, frame_idx: usize, frame: &mut Frame) {
        let n_frames = ((TRACE_S * self.poses.fps).round() as usize).max(1);
        let first = frame_idx.saturating_sub(n_frames);
        let centers: Vec<Option<[f64; 2]>> = self.poses.frames[first..=frame_idx]
            .iter()
            .map(|pose| pose.centroid_px)
            .collect();
        for (rgb, rim_px, most) in [(RIM, 0.9 * self.unit_px, 0.45), (TRACE, 0.0, 0.95)] {
            for (k, pair) in centers.windows(2).enumerate() {
                if let (Some(from), Some(to)) = (pair[0], pair[1]) {
                    let age = (centers.len() - 2 - k) as f64 / n_frames as f64;
                    let alpha = most * (1.0 - age).clamp(0.0, 1.0);
                    self.pen.line(from, to, 0.9 * self.unit_px + rim_px, alpha);
                }
            }
            self.pen.draw(frame, rgb);
        }
    }

    /// Draws an arrow from the centroid toward the head; only the centroid if the heading is unknown.
    fn heading(&mut self, pose: &Pose, frame: &mut Frame) {
        let Some(center) = pose.centroid_px else {
            return;
        };
        let unit = self.unit_px;
        if let Some(heading) = pose.heading_rad {
            let arrow = arrow(center, heading, self.reach_px, 7.0 * unit);
            self.stroke(frame, &arrow, 1.1 * unit, HEADING);
        }
        self.stroke(frame, &[center, center], 2.6 * unit, HEADING);
    }

    fn label(&mut self, frame: &mut Frame, label: &str, dot_px: f64) {
        let at = [6.0 * dot_px, 5.0 * dot_px];
        write_rim(&mut self.pen, frame, label, at, dot_px, 0.6 * dot_px);
        self.pen.text(label, at, dot_px);
        self.pen.draw(frame, BOX);
    }

    fn stroke(&mut self, frame: &mut Frame, points: &[[f64; 2]], radius_px: f64, rgb: [u8; 3]) {
        stroke(&mut self.pen, frame, points, radius_px, self.unit_px, rgb);
    }
}

/// Draws a line in one color with a dark outline. `radius_px` is its half-width, `unit_px` the unit of stroke
/// widths.
pub(super) fn stroke(
    pen: &mut Pen,
    frame: &mut Frame,
    points: &[[f64; 2]],
    radius_px: f64,
    unit_px: f64,
    rgb: [u8; 3],
) {
    pen.polyline(points, radius_px + 0.9 * unit_px, 0.55);
    pen.draw(frame, RIM);
    pen.polyline(points, radius_px, 1.0);
    pen.draw(frame, rgb);
}

/// Draws the dark outline of a text: copies of the text, shifted by `rim_px` in four directions.
pub(super) fn write_rim(
    pen: &mut Pen,
    frame: &mut Frame,
    text: &str,
    [x, y]: [f64; 2],
    dot_px: f64,
    rim_px: f64,
) {
    for (dx, dy) in [(-rim_px, 0.0), (rim_px, 0.0), (0.0, -rim_px), (0.0, rim_px)] {
        pen.text(text, [x + dx, y + dy], dot_px);
    }
    pen.draw(frame, RIM);
}

/// Returns an arrow of length `reach_px` with two barbs of length `barb_px` as one line.
pub(super) fn arrow(
    from: [f64; 2],
    heading_rad: f64,
    reach_px: f64,
    barb_px: f64,
) -> [[f64; 2]; 5] {
    let toward = |turn_rad: f64, reach_px: f64, [x, y]: [f64; 2]| {
        let angle_rad = heading_rad + turn_rad;
        [
            x + reach_px * libm::cos(angle_rad),
            y + reach_px * libm::sin(angle_rad),
        ]
    };
    let tip = toward(0.0, reach_px, from);
    let [left, right] = [2.6, -2.6].map(|turn_rad| toward(turn_rad, barb_px, tip));
    [from, tip, left, tip, right]
}

/// Returns the unit of stroke widths for a picture size, pixels.
pub(super) fn unit_px(width: u32, height: u32) -> f64 {
    (f64::from(width.max(height)) / 640.0).clamp(0.5, 4.0)
}

/// Returns the outline of a box as a closed line, pixels.
pub(super) fn outline(rect: &Rect) -> [[f64; 2]; 5] {
    let [x, y] = [f64::from(rect.x), f64::from(rect.y)];
    let [right, bottom] = [f64::from(rect.right()), f64::from(rect.bottom())];
    [[x, y], [right, y], [right, bottom], [x, bottom], [x, y]]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::library::View;
    use crate::raster::ColorSpec;

    fn poses() -> Poses {
        let pose = Pose {
            centroid_px: Some([60.0, 60.0]),
            box_px: Some(Rect {
                x: 40,
                y: 50,
                w: 40,
                h: 20,
            }),
            heading_rad: Some(0.0),
            length_px: Some(40.0),
            ..Pose::default()
        };
        Poses {
            fps: 30.0,
            image_size_px: [640, 120],
            view: View::Side,
            view_confidence: None,
            other_movers: Vec::new(),
            camera: None,
            animal: None,
            frames: vec![pose, Pose::default()],
            tail_beat: None,
        }
    }

    fn drawn(frame_idx: usize, level: u8) -> Frame {
        let mut frame = Frame::new(640, 120, ColorSpec::default());
        frame.planes.fill(level);
        frame.planes[640 * 120..].fill(128);
        Overlay::new(&poses()).draw(frame_idx, &mut frame);
        frame
    }

    #[test]
    fn arrow_is_visible_on_light_and_dark_pictures() {
        for level in [16, 235] {
            let frame = drawn(0, level).to_rgb();
            let [r, _, b] = frame.pixel(86, 59);
            assert!(r > b + 80, "ahead of the centroid: {r} {b}");
            let [r, g, b] = frame.pixel(34, 59);
            assert!(r == g && g == b, "nothing behind the box: {r} {g} {b}");
        }
    }

    #[test]
    fn frame_without_the_animal_has_only_its_label() {
        let frame = drawn(1, 16);
        let below_label = &frame.luma()[640 * 40..];
        assert!(below_label.iter().all(|&y| y == 16));
        assert!(frame.luma()[..640 * 40].iter().any(|&y| y > 150));
    }

    #[test]
    fn frame_after_the_last_pose_is_unchanged() {
        assert!(drawn(2, 16).luma().iter().all(|&y| y == 16));
    }
}
