//! Curve of a heading over time. At the step from +180 to -180 degrees the line leaves at one edge and
//! continues at the opposite one, instead of crossing the plot.

use std::f64::consts::PI;
use std::fmt::Write;

/// One point of a curve.
#[derive(Clone, Copy)]
pub(super) struct CurvePoint {
    pub(super) x: f64,
    /// Heading in (-pi, pi]; `None` breaks the curve.
    pub(super) heading_rad: Option<f64>,
    /// Whether to draw the line to this point.
    pub(super) is_drawn: bool,
}

/// Returns the curve as SVG path data; `y` converts a heading to a coordinate.
pub(super) fn wrapped(points: impl Iterator<Item = CurvePoint>, y: impl Fn(f64) -> f64) -> String {
    let mut path = String::new();
    let mut last: Option<(f64, f64)> = None;
    let mut pen_down = false;
    for point in points {
        let Some(heading) = point.heading_rad else {
            (last, pen_down) = (None, false);
            continue;
        };
        let to = point.x;
        if !point.is_drawn {
            (last, pen_down) = (Some((to, heading)), false);
            continue;
        }
        let (from, before) = last.unwrap_or((to, heading));
        if !pen_down {
            write!(path, "M{from:.1} {:.1}", y(before)).expect("memory");
        }
        if (heading - before).abs() > PI {
            let (over, edge) = ((from + to) / 2.0, PI * before.signum());
            let (leave, enter) = (y(edge), y(-edge));
            write!(path, "L{over:.1} {leave:.1}M{over:.1} {enter:.1}").expect("memory");
        }
        write!(path, "L{to:.1} {:.1}", y(heading)).expect("memory");
        (last, pen_down) = (Some((to, heading)), true);
    }
    path
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn wrap_breaks_the_curve_and_ordinary_turn_does_not() {
        let strokes = |headings: &[Option<f64>]| {
            let points = headings.iter().map(|&heading_rad| CurvePoint {
                x: 0.0,
                heading_rad,
                is_drawn: true,
            });
            wrapped(points, |heading| heading).matches('M').count()
        };
        assert_eq!(strokes(&[Some(0.1), Some(0.5), Some(2.0)]), 1);
        assert_eq!(strokes(&[Some(3.0), Some(-3.0)]), 2);
        assert_eq!(strokes(&[Some(0.0), None, Some(0.0)]), 2);
    }
}
