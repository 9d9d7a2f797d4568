//! Horizontal axis of a chart: seconds of the footage or frames, with ticks at round numbers.

use super::{LEFT, RIGHT, Sheet};
use crate::library::Poses;

/// A range from 0 to `end`, drawn from `left` to `right`.
pub(super) struct Axis {
    pub(super) left: f64,
    pub(super) right: f64,
    pub(super) end: f64,
    /// Unit, shown at the first tick.
    unit: &'static str,
}

impl Axis {
    /// Returns the time axis of a footage, over the whole width.
    pub(super) fn of_time(poses: &Poses) -> Axis {
        let end_s = poses.frames.last().map_or(1.0, |pose| pose.time_s);
        Axis {
            left: LEFT,
            right: RIGHT,
            end: end_s.max(1e-3),
            unit: "s",
        }
    }

    /// Returns an axis of `n_frames` frames between two positions.
    pub(super) fn of_frames(n_frames: usize, [left, right]: [f64; 2]) -> Axis {
        Axis {
            left,
            right,
            end: n_frames.max(1) as f64,
            unit: "frame",
        }
    }

    pub(super) fn x(&self, at: f64) -> f64 {
        self.left + at / self.end * (self.right - self.left)
    }

    /// Draws the tick lines through a plot from `top` to `bottom`, with labels below.
    pub(super) fn draw(&self, sheet: &mut Sheet, top: f64, bottom: f64) {
        self.draw_lines(sheet, top, bottom + 5.0);
        let step = self.step();
        for tick in 0..=self.n_steps() {
            let at = f64::from(tick) * step;
            let label = match (at * 1000.0).round() / 1000.0 {
                0.0 if self.unit == "s" => "0 s".to_owned(),
                0.0 => format!("{} 0", self.unit),
                label => format!("{label}"),
            };
            // The last label stays inside the picture.
            let half = 4.2 * label.chars().count() as f64;
            let x = self.x(at).min(super::WIDTH - half - 2.0);
            sheet.text("soft", "middle", [x, bottom + 20.0], &label);
        }
    }

    /// Draws only the tick lines.
    pub(super) fn draw_lines(&self, sheet: &mut Sheet, top: f64, bottom: f64) {
        for tick in 0..=self.n_steps() {
            let x = self.x(f64::from(tick) * self.step());
            sheet.stroke("line", &format!("M{x:.1} {top:.1}V{bottom:.1}"), "");
        }
    }

    /// Returns the tick interval, for about one tick per 100 pixels.
    fn step(&self) -> f64 {
        let n_ticks = ((self.right - self.left) / 96.0).round().max(2.0);
        let step = round_step(self.end / n_ticks);
        match self.unit {
            "frame" => step.max(1.0),
            _ => step,
        }
    }

    fn n_steps(&self) -> u32 {
        (self.end / self.step() * (1.0 + 1e-9)) as u32
    }
}

/// Returns the smallest of 1, 2 and 5 times a power of ten that is at least `least`.
pub(super) fn round_step(least: f64) -> f64 {
    let power = libm::pow(10.0, libm::log10(least.max(1e-9)).floor());
    [1.0, 2.0, 5.0]
        .into_iter()
        .map(|n| n * power)
        .find(|step| *step >= least * (1.0 - 1e-9))
        .unwrap_or(10.0 * power)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn steps_are_round_numbers() {
        assert_eq!(round_step(0.3), 0.5);
        assert_eq!(round_step(5.0), 5.0);
        assert_eq!(round_step(70.0), 100.0);
    }

    #[test]
    fn frame_axis_has_no_fractional_steps() {
        let axis = Axis::of_frames(3, [0.0, 960.0]);
        assert_eq!((axis.step(), axis.n_steps()), (1.0, 3));
    }
}
