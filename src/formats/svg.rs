//! headings.svg: the heading over time (O's figure 5), as degrees on the page.
//!
//! Where the heading passes from +180 to -180 degrees the line leaves at one edge and comes back at
//! the other: a wrap is drawn as a wrap, not as a stroke through the whole circle.

use std::f64::consts::PI;
use std::fmt::Write;

use crate::library::Poses;

const WIDTH: f64 = 960.0;
const HEIGHT: f64 = 260.0;
const LEFT: f64 = 56.0;
const TOP: f64 = 12.0;
const BOTTOM: f64 = 34.0;
const RIGHT: f64 = 12.0;

/// The heading over time as an SVG picture of 960 by 260.
pub fn headings(poses: &Poses) -> String {
    let end_s = poses
        .frames
        .last()
        .map_or(1.0, |pose| pose.time_s)
        .max(1e-3);
    let x = |time_s: f64| LEFT + time_s / end_s * (WIDTH - LEFT - RIGHT);
    let y = |heading: f64| TOP + (PI - heading) / (2.0 * PI) * (HEIGHT - TOP - BOTTOM);
    let mut svg = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {WIDTH} {HEIGHT}\" \
         font-family=\"sans-serif\" font-size=\"12\" role=\"img\">\
         <title>Heading over time, degrees</title>\
         <rect width=\"{WIDTH}\" height=\"{HEIGHT}\" fill=\"#fff\"/>"
    );
    for degrees in [-180, -90, 0, 90, 180] {
        let at = y(f64::from(degrees).to_radians());
        write!(
            svg,
            "<path d=\"M{LEFT} {at:.1}H{:.1}\" stroke=\"#ddd\"/>\
             <text x=\"{:.1}\" y=\"{:.1}\" text-anchor=\"end\" fill=\"#444\">{degrees}°</text>",
            WIDTH - RIGHT,
            LEFT - 6.0,
            at + 4.0
        )
        .expect("memory");
    }
    let step_s = [0.1, 0.2, 0.5, 1.0, 2.0, 5.0, 10.0, 30.0, 60.0, 300.0, 600.0];
    let step_s = step_s
        .into_iter()
        .find(|s| end_s / s <= 10.0)
        .unwrap_or(1200.0);
    for tick in 0..=(end_s / step_s) as u32 {
        let time_s = f64::from(tick) * step_s;
        let label = (time_s * 10.0).round() / 10.0;
        write!(
            svg,
            "<text x=\"{:.1}\" y=\"{:.1}\" text-anchor=\"middle\" fill=\"#444\">{label} s</text>",
            x(time_s),
            HEIGHT - 12.0
        )
        .expect("memory");
    }
    writeln!(
        svg,
        "<path fill=\"none\" stroke=\"#b4501e\" stroke-width=\"1.5\" d=\"{}\"/></svg>",
        line(poses, x, y)
    )
    .expect("memory");
    svg
}

/// The line as path data: broken where the heading is not known, wrapped at +-180 degrees.
fn line(poses: &Poses, x: impl Fn(f64) -> f64, y: impl Fn(f64) -> f64) -> String {
    let mut path = String::new();
    let mut last: Option<(f64, f64)> = None;
    for pose in &poses.frames {
        let Some(heading) = pose.heading_rad else {
            last = None;
            continue;
        };
        let to = x(pose.time_s);
        match last {
            None => write!(path, "M{to:.1} {:.1}", y(heading)),
            Some((_, before)) if (heading - before).abs() <= PI => {
                write!(path, "L{to:.1} {:.1}", y(heading))
            }
            Some((from, before)) => {
                let (over, edge) = ((from + to) / 2.0, PI * before.signum());
                let (leave, enter) = (y(edge), y(-edge));
                write!(
                    path,
                    "L{over:.1} {leave:.1}M{over:.1} {enter:.1}L{to:.1} {:.1}",
                    y(heading)
                )
            }
        }
        .expect("memory");
        last = Some((to, heading));
    }
    path
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
            camera: None,
            animal: None,
            frames,
        }
    }

    #[test]
    fn a_wrap_lifts_the_pen_and_an_ordinary_turn_does_not() {
        let strokes =
            |headings: &[Option<f64>]| line(&poses(headings), |t| t, |h| h).matches('M').count();
        assert_eq!(strokes(&[Some(0.1), Some(0.5), Some(2.0)]), 1);
        assert_eq!(strokes(&[Some(3.0), Some(-3.0)]), 2);
        assert_eq!(strokes(&[Some(0.0), None, Some(0.0)]), 2);
    }
}
