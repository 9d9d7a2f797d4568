//! confidence.svg: the confidence of each frame's measurement, as strips over a common time axis.

use std::fmt::Write;

use super::axis::Axis;
use super::{LEFT, RIGHT, Sheet, fill, rimmed, runs};
use crate::library::{Pose, Poses};

const TOP: f64 = 44.0;
/// Height of a strip and the gap below it.
const STRIP: [f64; 2] = [30.0, 10.0];

/// Returns the confidence over time as an SVG picture, 960 wide.
pub fn confidence(poses: &Poses) -> String {
    let axis = Axis::of_time(poses);
    let cut = poses.frames.iter().filter(|pose| pose.cut).count();
    let found = poses.frames.iter().filter(|pose| pose.detected()).count();
    let with_depth = poses
        .frames
        .iter()
        .any(|pose| pose.depth_sign_confidence.is_some());
    let n_strips = 4 + usize::from(with_depth) + usize::from(poses.tail_beat.is_some());
    let bottom = TOP + n_strips as f64 * (STRIP[0] + STRIP[1]) - STRIP[1];
    let mut sheet = Sheet::new(
        bottom + 32.0,
        "Confidence of the measurement",
        &format!(
            "Frame by frame over {:.1} seconds: the animal was found in {found} of {} frames, {cut} of them \
             at the border of the picture.",
            axis.end,
            poses.frames.len()
        ),
    );
    sheet.text(
        "ink",
        "start",
        [16.0, 26.0],
        "Confidence of the measurement",
    );
    axis.draw(&mut sheet, TOP, bottom);
    let mut rows = Rows {
        sheet: &mut sheet,
        poses,
        axis: &axis,
        y: TOP,
    };
    rows.spans("found", "water", Pose::detected);
    rows.spans("at border", "accent", |pose| pose.cut);
    rows.curve("animal", [0.5, 1.0], |pose| pose.confidence);
    rows.curve("head", [0.5, 1.0], |pose| pose.head_confidence);
    if with_depth {
        rows.curve("depth sign", [0.5, 1.0], |pose| pose.depth_sign_confidence);
    }
    rows.beats();
    sheet.finish()
}

struct Rows<'a> {
    sheet: &'a mut Sheet,
    poses: &'a Poses,
    axis: &'a Axis,
    y: f64,
}

impl Rows<'_> {
    fn label(&mut self, name: &str) {
        let middle = self.y + STRIP[0] / 2.0 + 4.5;
        self.sheet.text("soft", "end", [LEFT - 8.0, middle], name);
        let place = [LEFT, self.y, RIGHT - LEFT, STRIP[0]];
        self.sheet.rect("sunken", place);
    }

    fn span_x(&self, [from, to]: [usize; 2]) -> [f64; 2] {
        [from, to].map(|k| self.axis.x(k as f64 / self.poses.fps).min(RIGHT))
    }

    /// Draws a strip with a bar for each run of frames in which `holds` is true.
    fn spans(&mut self, name: &str, role: &str, holds: impl Fn(&Pose) -> bool) {
        self.label(name);
        let frames = &self.poses.frames;
        for run in runs(frames.len(), |k| holds(&frames[k])) {
            let [x0, x1] = self.span_x(run);
            let place = [x0, self.y, (x1 - x0).max(0.8), STRIP[0]];
            self.sheet.rect(role, place);
        }
        self.y += STRIP[0] + STRIP[1];
    }

    /// Draws a value between two bounds. Frames that share a position show their minimum, so that short drops
    /// stay visible.
    fn curve(&mut self, name: &str, [low, high]: [f64; 2], of: impl Fn(&Pose) -> Option<f64>) {
        self.label(name);
        let frames = &self.poses.frames;
        let per_place = frames.len().div_ceil(1800).max(1);
        let bottom = self.y + STRIP[0];
        let mut path = format!("M{LEFT} {bottom:.1}");
        for chunk in frames.chunks(per_place) {
            let least = chunk
                .iter()
                .map(|pose| of(pose).unwrap_or(low))
                .fold(high, f64::min);
            let share = ((least - low) / (high - low)).clamp(0.0, 1.0);
            let x = self.axis.x(chunk[0].time_s);
            write!(path, "L{x:.1} {:.1}", bottom - share * STRIP[0]).expect("memory");
        }
        self.sheet.write(format_args!(
            "<path {} d=\"{path}L{RIGHT} {bottom:.1}Z\"/>\n",
            fill("water")
        ));
        self.y = bottom + STRIP[1];
    }

    /// Draws the spans of measured tail beats with their frequency.
    fn beats(&mut self) {
        let Some(beat) = &self.poses.tail_beat else {
            return;
        };
        self.label("tail beat");
        for span in &beat.spans {
            let [x0, x1] = self.span_x(span.frames);
            self.sheet.write(format_args!(
                "<rect {} stroke-width=\"1\" x=\"{x0:.1}\" y=\"{:.1}\" width=\"{:.1}\" height=\"{}\"/>\n",
                rimmed("water", "paper"),
                self.y,
                x1 - x0,
                STRIP[0]
            ));
            let middle = [(x0 + x1) / 2.0, self.y + STRIP[0] / 2.0 + 4.5];
            let rate = format!("{:.1}", span.frequency_hz);
            match x1 - x0 {
                wide if wide > 48.0 => {
                    let label = format!("{rate} Hz");
                    self.sheet.text("paper", "middle", middle, &label);
                }
                wide if wide > 26.0 => self.sheet.text("paper", "middle", middle, &rate),
                _ => {}
            }
        }
        self.y += STRIP[0] + STRIP[1];
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::library::View;

    #[test]
    fn single_doubtful_frame_stays_visible() {
        let mut frames = vec![
            Pose {
                centroid_px: Some([1.0, 1.0]),
                confidence: Some(1.0),
                head_confidence: Some(1.0),
                ..Pose::default()
            };
            9000
        ];
        frames[4500].confidence = Some(0.5);
        for (k, pose) in frames.iter_mut().enumerate() {
            pose.time_s = k as f64 / 30.0;
        }
        let poses = Poses {
            fps: 30.0,
            image_size_px: [8, 8],
            view: View::Side,
            view_confidence: None,
            other_movers: Vec::new(),
            camera: None,
            animal: None,
            frames,
            tail_beat: None,
        };
        let svg = confidence(&poses);
        // Bottom of the strip: two strips above it, plus its own height.
        assert!(svg.contains(&format!(" {:.1}L", TOP + 2.0 * 40.0 + 30.0)));
        assert!(svg.contains("found in 9000 of 9000"));
    }
}
