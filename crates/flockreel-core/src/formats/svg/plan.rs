//! plan.svg: the heading of each boid and the heading displayed, over the frames of the flock, with the jumps
//! (Okabe et al., figure 8). In a large flock only the first individuals are drawn, as the chart notes.

use std::f64::consts::{PI, TAU};
use std::fmt::Write;

use super::axis::Axis;
use super::curve::{CurvePoint, wrapped};
use super::{LEFT, RIGHT, Sheet, stroke};
use crate::flock::placement::is_jump;
use crate::flock::{Flock, Individual};
use crate::geometry::wrap_rad;

/// Maximum number of drawn individuals. Free choice.
const MAX_DRAWN: usize = 20;
const TOP: f64 = 92.0;
/// Height of the label above a plot and of the gap below it.
const PLOT_MARGINS: [f64; 2] = [20.0, 14.0];
/// Rotation of headings before drawing, radians. It places the wrap of the angle at straight down, because
/// most animals head left or right.
const UP: f64 = PI / 2.0;
const BOID: &str = "stroke-width=\"4\" stroke-opacity=\"0.5\" stroke-linejoin=\"round\"";
const SHOWN: &str = "stroke-width=\"1.3\" stroke-linejoin=\"round\"";
const JUMP: &str = "stroke-width=\"1.4\"";

/// Returns the plan of a flock as an SVG picture, 960 wide.
pub fn plan(flock: &Flock) -> String {
    let drawn = &flock.individuals[..flock.individuals.len().min(MAX_DRAWN)];
    let n_columns = if drawn.len() > 3 { 2 } else { 1 };
    let n_rows = drawn.len().div_ceil(n_columns).max(1);
    let plot_height = if n_columns == 1 { 190.0 } else { 84.0 };
    let row_height = PLOT_MARGINS[0] + plot_height + PLOT_MARGINS[1];
    let bottom = TOP + n_rows as f64 * row_height;
    let description = summary(flock, drawn.len());
    let title = "Headings of boids and of the frames shown, degrees";
    let mut sheet = Sheet::new(bottom + 26.0, title, &description);
    sheet.text("ink", "start", [16.0, 26.0], title);
    sheet.text("soft", "start", [16.0, 46.0], &description);
    key(&mut sheet, 68.0);
    let n_frames = drawn.first().map_or(1, |one| one.heading_rad.len());
    let width = (RIGHT - LEFT - 20.0 * (n_columns - 1) as f64) / n_columns as f64;
    for (idx, individual) in drawn.iter().enumerate() {
        let (column, row) = (idx % n_columns, idx / n_columns);
        let left = LEFT + column as f64 * (width + 20.0);
        let top = TOP + row as f64 * row_height + PLOT_MARGINS[0];
        let panel = Panel {
            axis: Axis::of_frames(n_frames.saturating_sub(1), [left, left + width]),
            span: [top, top + plot_height],
        };
        let is_last = idx + n_columns >= drawn.len();
        panel.draw(&mut sheet, individual, column == 0, is_last);
    }
    sheet.finish()
}

fn summary(flock: &Flock, n_drawn: usize) -> String {
    let n_all = flock.individuals.len();
    let subject = if n_drawn < n_all {
        format!("The first {n_drawn} of {n_all} individuals")
    } else if n_all == 1 {
        "The only individual".to_owned()
    } else {
        format!("All {n_all} individuals")
    };
    format!(
        "{subject}. Over all individuals, half of the shown headings are within {:.1}° of the boid's, 90 % within {:.1}°; \
         {:.1} jumps per 100 frames.",
        flock.stats.heading_error_median_rad.to_degrees(),
        flock.stats.heading_error_p90_rad.to_degrees(),
        flock.stats.jumps_per_100_frames
    )
}

fn key(sheet: &mut Sheet, y: f64) {
    for (role, pen, path, x, label) in [
        ("water", BOID, "h30", 16.0, "the boid's heading"),
        ("accent", SHOWN, "h30", 206.0, "the heading shown"),
        ("ink", JUMP, "m15 -5v10", 396.0, "a jump in the footage"),
    ] {
        sheet.write(format_args!(
            "<path {} fill=\"none\" {pen} d=\"M{x} {}{path}\"/>\n",
            stroke(role),
            y - 4.5
        ));
        sheet.text("soft", "start", [x + 38.0, y], label);
    }
}

/// The plot of one individual.
struct Panel {
    axis: Axis,
    /// Top and bottom.
    span: [f64; 2],
}

impl Panel {
    fn draw(&self, sheet: &mut Sheet, individual: &Individual, named: bool, is_last: bool) {
        let [top, bottom] = self.span;
        let [left, right] = [self.axis.left, self.axis.right];
        if is_last {
            self.axis.draw(sheet, top, bottom)
        } else {
            self.axis.draw_lines(sheet, top, bottom)
        }
        for (degrees, label) in [
            (-270, "down"),
            (-180, "left 180°"),
            (-90, "up -90°"),
            (0, "right 0°"),
            (90, "down 90°"),
        ] {
            let y = self.y(f64::from(degrees).to_radians() + UP);
            sheet.stroke("line", &format!("M{left:.1} {y:.1}H{right:.1}"), "");
            if named {
                sheet.text("soft", "end", [left - 8.0, y + 4.0], label);
            }
        }
        let jumps = jumps(individual);
        let summary = individual_summary(individual, jumps.len());
        let label = format!("individual {} · {summary}", individual.id);
        sheet.text("ink", "start", [left, top - 6.0], &label);
        let boid = self.curve(&individual.boid.heading_rad);
        sheet.stroke("water", &boid, BOID);
        let mut ticks = String::new();
        for frame in jumps {
            let x = self.axis.x(frame as f64);
            write!(ticks, "M{x:.1} {:.1}v9", bottom - 4.5).expect("memory");
        }
        sheet.stroke("accent", &self.curve(&individual.heading_rad), SHOWN);
        sheet.stroke("ink", &ticks, JUMP);
    }

    /// Returns the y coordinate of an angle relative to straight up.
    fn y(&self, from_up_rad: f64) -> f64 {
        self.span[0] + (from_up_rad + PI) / TAU * (self.span[1] - self.span[0])
    }

    /// Returns the curve of the headings, with at most about two frames per pixel.
    fn curve(&self, headings_rad: &[f64]) -> String {
        let stride = headings_rad.len().div_ceil(2000).max(1);
        let places = headings_rad.iter().enumerate().step_by(stride);
        let place = |(frame, &heading_rad): (usize, &f64)| CurvePoint {
            x: self.axis.x(frame as f64),
            heading_rad: Some(wrap_rad(heading_rad + UP)),
            is_drawn: true,
        };
        wrapped(places.map(place), |from_up_rad| self.y(from_up_rad))
    }
}

/// Returns the frames that do not continue the previous one.
fn jumps(individual: &Individual) -> Vec<usize> {
    let shown = |t: usize| (individual.source_frame[t], individual.mirrored[t]);
    let frames = 1..individual.source_frame.len();
    frames
        .filter(|&t| is_jump(shown(t - 1), shown(t)))
        .collect()
}

fn individual_summary(individual: &Individual, n_jumps: usize) -> String {
    let wanted = individual.boid.heading_rad.iter();
    let mut off_rad: Vec<f64> = (individual.heading_rad.iter().zip(wanted))
        .map(|(shown, wanted)| wrap_rad(shown - wanted).abs())
        .collect();
    off_rad.sort_by(f64::total_cmp);
    let median = off_rad.get(off_rad.len() / 2).copied().unwrap_or(0.0);
    let jumps = if n_jumps == 1 { "jump" } else { "jumps" };
    format!(
        "{n_jumps} {jumps} · {:.1}° off (median)",
        median.to_degrees()
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::flock::{Params, plan_flock, synthetic};
    use crate::library::View;
    use crate::progress::Silent;

    fn flock(count: u32) -> Flock {
        let params = Params {
            count: Some(count),
            frames: 60,
            ..Params::default()
        };
        plan_flock(&synthetic::library(View::Side), &params, &Silent).expect("a good library")
    }

    #[test]
    fn large_flock_shows_its_first_individuals() {
        let svg = plan(&flock(23));
        assert!(svg.contains("The first 20 of 23 individuals"));
        assert!(svg.contains(">individual 19 ·") && !svg.contains(">individual 20 ·"));
        assert!(plan(&flock(2)).contains("All 2 individuals"));
    }

    #[test]
    fn jumps_are_marked_and_wraps_break_the_curve() {
        let mut flock = flock(1);
        let one = &mut flock.individuals[0];
        one.source_frame = (100..160).collect();
        one.mirrored = vec![false; 60];
        one.source_frame[30..]
            .iter_mut()
            .for_each(|frame| *frame += 7);
        one.mirrored[50..].fill(true);
        let down = UP;
        one.heading_rad = (0..60)
            .map(|t| if t < 20 { down - 0.1 } else { down + 0.1 })
            .collect();
        let svg = plan(&flock);
        assert!(svg.contains("individual 0 · 2 jumps"));
        let line = |pen: &str| {
            let mut lines = svg.lines().filter(|l| l.contains(pen));
            lines.next_back().expect("drawn").to_owned()
        };
        assert_eq!(line(JUMP).matches("v9").count(), 2);
        assert_eq!(
            line(SHOWN).matches('M').count(),
            2,
            "the pen is lifted once"
        );
    }
}
