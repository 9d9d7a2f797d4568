//! trajectory.svg: the path of the animal in the picture, colored by time, with its start, its end and a
//! scale. Frames without the animal are bridged by a dashed line.

use super::axis::round_step;
use super::{RIGHT, Sheet, WIDTH, fill, rimmed, runs};
use crate::library::Poses;

/// Colors from the first to the last frame, readable on light and dark pages.
const TIME_COLORS: [[f64; 3]; 5] = [
    [42.0, 128.0, 160.0],
    [70.0, 165.0, 120.0],
    [205.0, 165.0, 40.0],
    [222.0, 112.0, 48.0],
    [190.0, 50.0, 110.0],
];
/// Number of colors of the path.
const N_COLORS: usize = 96;
/// Margins above and below the picture.
const MARGINS: [f64; 2] = [44.0, 56.0];
const SIDE: f64 = 16.0;
/// Maximum height of the picture.
const MAX_HEIGHT: f64 = 900.0;

/// Returns the path of the animal as an SVG picture, 960 wide, in the proportions of the footage.
pub fn trajectory(poses: &Poses) -> String {
    let [width_px, height_px] = poses.image_size_px.map(|side| f64::from(side.max(1)));
    let zoom = ((RIGHT - SIDE) / width_px).min(MAX_HEIGHT / height_px);
    let left = (WIDTH - zoom * width_px) / 2.0;
    let height = MARGINS[0] + zoom * height_px + MARGINS[1];
    let seen = poses.frames.iter().filter(|pose| pose.detected()).count();
    let mut sheet = Sheet::new(
        height,
        "Path of the animal",
        &format!(
            "The path of the animal's centroid over a picture of {width_px} by {height_px} pixels, colored by \
             time; seen in {seen} of {} frames.",
            poses.frames.len()
        ),
    );
    sheet.text("ink", "start", [left, 26.0], "Path of the animal");
    sheet.rect(
        "sunken",
        [left, MARGINS[0], zoom * width_px, zoom * height_px],
    );
    let place = |[x, y]: [f64; 2]| [left + zoom * x, MARGINS[0] + zoom * y];
    draw_path(&mut sheet, poses, place);
    let below = MARGINS[0] + zoom * height_px + 24.0;
    scale_bar(&mut sheet, poses, [left, below], zoom);
    time_key(&mut sheet, poses, [left + zoom * width_px, below]);
    sheet.finish()
}

fn draw_path(sheet: &mut Sheet, poses: &Poses, place: impl Fn([f64; 2]) -> [f64; 2]) {
    let n_frames = poses.frames.len();
    let point = |k: usize| poses.frames[k].centroid_px.map(&place);
    let spans = runs(n_frames, |k| poses.frames[k].detected());
    for pair in spans.windows(2) {
        if let (Some([x0, y0]), Some([x1, y1])) = (point(pair[0][1] - 1), point(pair[1][0])) {
            let gap = format!("M{x0:.1} {y0:.1}L{x1:.1} {y1:.1}");
            sheet.stroke(
                "soft",
                &gap,
                "stroke-dasharray=\"2 5\" stroke-linecap=\"round\"",
            );
        }
    }
    let per_color = n_frames.div_ceil(N_COLORS).max(1);
    // More points per color would not be distinguishable.
    let stride = per_color.div_ceil(64);
    for [from, to] in &spans {
        let mut at = *from;
        while at + 1 < *to {
            let end = ((at / per_color + 1) * per_color).min(to - 1);
            let ks = (at..end).step_by(stride).chain([end]);
            let path: Vec<String> = ks
                .filter_map(point)
                .map(|[x, y]| format!("{x:.1} {y:.1}"))
                .collect();
            let color = color_at(at as f64 / n_frames as f64);
            sheet.write(format_args!(
                "<path fill=\"none\" stroke=\"{color}\" stroke-width=\"2.4\" stroke-linecap=\"round\" \
                 stroke-linejoin=\"round\" d=\"M{}\"/>\n",
                path.join("L")
            ));
            at = end;
        }
    }
    draw_ends(sheet, &spans, point);
}

/// Draws a ring at the start of the path and a disc at its end.
fn draw_ends(sheet: &mut Sheet, spans: &[[usize; 2]], point: impl Fn(usize) -> Option<[f64; 2]>) {
    let (Some(first), Some(last)) = (spans.first(), spans.last()) else {
        return;
    };
    for (k, word, share) in [(first[0], "start", 0.0), (last[1] - 1, "end", 1.0)] {
        let Some([x, y]) = point(k) else { continue };
        let (color, radius) = (color_at(share), 6.5);
        let inside = if share == 0.0 {
            fill("paper")
        } else {
            format!("fill=\"{color}\"")
        };
        sheet.write(format_args!(
            "<circle {inside} stroke=\"{color}\" stroke-width=\"2.5\" cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"{radius}\"/>\n"
        ));
        let (anchor, offset) = if x > WIDTH / 2.0 {
            ("end", -12.0)
        } else {
            ("start", 12.0)
        };
        sheet.write(format_args!(
            "<text {} stroke-width=\"3\" paint-order=\"stroke\" text-anchor=\"{anchor}\" x=\"{:.1}\" \
             y=\"{:.1}\">{word}</text>\n",
            rimmed("ink", "sunken"),
            x + offset,
            y + 4.5
        ));
    }
}

/// Draws a scale bar about an eighth of the picture wide: in metres at the animal's median depth, otherwise
/// in pixels.
fn scale_bar(sheet: &mut Sheet, poses: &Poses, [x, y]: [f64; 2], zoom: f64) {
    let mut depths_m: Vec<f64> = (poses.frames.iter())
        .filter_map(|pose| pose.position_m.map(|p| p[2]))
        .collect();
    depths_m.sort_by(f64::total_cmp);
    let depth_m = depths_m.get(depths_m.len() / 2);
    let px_per_m = poses
        .camera
        .zip(depth_m)
        .map(|(camera, depth_m)| {
            let [at_0, at_1] = [0.0, 1e-3].map(|x| camera.image_from_camera([x, 0.0, *depth_m])[0]);
            (at_1 - at_0) / 1e-3
        })
        .filter(|scale| *scale > 0.0);
    let wanted_px = 0.12 * f64::from(poses.image_size_px[0]);
    let (length_px, label) = match px_per_m {
        Some(px_per_m) => {
            let length_m = round_step(wanted_px / px_per_m);
            let label = if length_m < 1.0 {
                format!("{} cm", (length_m * 1e4).round() / 1e2)
            } else {
                format!("{length_m} m")
            };
            (length_m * px_per_m, format!("{label} at the median depth"))
        }
        None => {
            let length_px = round_step(wanted_px);
            (length_px, format!("{length_px} px"))
        }
    };
    let end = x + zoom * length_px;
    let bar = format!("M{x:.1} {:.1}v8M{x:.1} {y:.1}H{end:.1}m0 -4v8", y - 4.0);
    sheet.stroke("ink", &bar, "stroke-width=\"1.5\"");
    sheet.text("soft", "start", [end + 10.0, y + 4.5], &label);
}

/// Draws the key of the time colors.
fn time_key(sheet: &mut Sheet, poses: &Poses, [right, y]: [f64; 2]) {
    const KEY: f64 = 160.0;
    let end_s = poses.frames.last().map_or(0.0, |pose| pose.time_s);
    let label = format!("{:.1} s", end_s);
    let left = right - KEY - 60.0;
    sheet.text("soft", "end", [left - 8.0, y + 4.5], "0 s");
    sheet.text("soft", "start", [left + KEY + 8.0, y + 4.5], &label);
    for k in 0..40 {
        let share = f64::from(k) / 40.0;
        sheet.write(format_args!(
            "<rect fill=\"{}\" x=\"{:.1}\" y=\"{:.1}\" width=\"{:.1}\" height=\"8\"/>\n",
            color_at(share),
            left + share * KEY,
            y - 4.0,
            KEY / 40.0 + 0.3
        ));
    }
}

fn color_at(share: f64) -> String {
    let at = share.clamp(0.0, 1.0) * (TIME_COLORS.len() - 1) as f64;
    let k = (at as usize).min(TIME_COLORS.len() - 2);
    let [r, g, b] = [0, 1, 2]
        .map(|c| TIME_COLORS[k][c] + (at - k as f64) * (TIME_COLORS[k + 1][c] - TIME_COLORS[k][c]));
    format!("#{:02x}{:02x}{:02x}", r as u8, g as u8, b as u8)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::library::{Pose, View};

    fn poses(seen: &[bool]) -> Poses {
        let pose = |(k, &seen): (usize, &bool)| Pose {
            time_s: k as f64,
            centroid_px: seen.then_some([k as f64, 4.0]),
            ..Pose::default()
        };
        Poses {
            fps: 1.0,
            image_size_px: [200, 100],
            view: View::Top,
            view_confidence: None,
            other_movers: Vec::new(),
            camera: None,
            animal: None,
            frames: seen.iter().enumerate().map(pose).collect(),
            tail_beat: None,
        }
    }

    #[test]
    fn gaps_are_dashed_and_ends_marked() {
        let svg = trajectory(&poses(&[true, true, false, false, true, true]));
        assert_eq!(svg.matches("stroke-dasharray").count(), 1);
        assert_eq!(svg.matches("<circle").count(), 2);
        assert!(svg.contains("seen in 4 of 6 frames"));
        assert!(
            svg.contains(">50 px<"),
            "without a camera the scale is in pixels"
        );
    }

    #[test]
    fn path_is_empty_without_detections() {
        let svg = trajectory(&poses(&[false; 4]));
        assert_eq!(
            svg.matches("<circle").count() + svg.matches("dasharray").count(),
            0
        );
    }
}
