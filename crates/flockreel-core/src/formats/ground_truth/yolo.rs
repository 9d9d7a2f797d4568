//! Labels of YOLO (ultralytics): a text file beside each picture, with a line for each visible animal, and
//! `data.yaml` (docs/reference/formats.md, "Data sets").
//!
//! All numbers are shares of the width or height of the picture.

use std::fmt::Write as _;

use crate::flock::composite::keypoints::{N_KEYPOINTS, NAMES};
use crate::flock::composite::truth::{FrameTruth, Seen};
use crate::geometry::Rect;
use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

/// Kind of labels. A folder of pictures has labels of one kind.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum Task {
    /// Boxes of the visible parts.
    Detect,
    /// Outlines of the visible parts.
    Segment,
    /// Boxes of the visible parts, and keypoints.
    Pose,
}

/// Returns the content of the label file of one picture.
pub fn labels(task: Task, truth: &FrameTruth) -> String {
    let mut text = String::new();
    for (id, seen) in truth.seen.iter().enumerate() {
        let Some(rect) = seen.visible_box else {
            continue;
        };
        let line = match task {
            Task::Detect => box_of(rect, truth.size_px),
            Task::Segment => outline(truth, id as u16 + 1, rect),
            Task::Pose => box_of(rect, truth.size_px) + &keypoints(seen, truth.size_px),
        };
        text += &format!("0{line}\n");
    }
    text
}

/// Returns `data.yaml`. `splits` are the names of those subsets that have pictures.
pub fn data_yaml(task: Task, splits: &[&str]) -> String {
    // Without a root, the loader takes the folder of the file.
    let mut text = String::from("# A data set made by flockreel.\n");
    // A loader needs both; a set without the one takes the other.
    for (key, name) in [("train", "train"), ("val", "val"), ("test", "test")] {
        let other = splits.first().copied().unwrap_or(name);
        match splits.contains(&name) {
            true => text += &format!("{key}: images/{name}\n"),
            false if key != "test" => text += &format!("{key}: images/{other}\n"),
            false => {}
        }
    }
    text += "names:\n  0: animal\n";
    if task == Task::Pose {
        // A mirrored picture exchanges no keypoints: all lie on the animal's middle line.
        let order: Vec<String> = (0..N_KEYPOINTS).map(|k| k.to_string()).collect();
        text += &format!(
            "kpt_shape: [{N_KEYPOINTS}, 3]\nflip_idx: [{}]\nkpt_names:\n  0: [{}]\n",
            order.join(", "),
            NAMES.join(", ")
        );
    }
    text
}

/// Returns the middle, width and height of a box, each after a space.
fn box_of(rect: Rect, [width, height]: [u32; 2]) -> String {
    let (w, h) = (f64::from(rect.w), f64::from(rect.h));
    let (x, y) = (f64::from(rect.x) + w / 2.0, f64::from(rect.y) + h / 2.0);
    let (width, height) = (f64::from(width), f64::from(height));
    format!(
        " {:.6} {:.6} {:.6} {:.6}",
        x / width,
        y / height,
        w / width,
        h / height
    )
}

/// Returns x, y and flag of the keypoints. A point outside of the picture counts as not measured, because YOLO
/// refuses it.
fn keypoints(seen: &Seen, size_px: [u32; 2]) -> String {
    let mut text = String::new();
    for point in &seen.keypoints {
        let place = point.map(|point| [0, 1].map(|k| point.px[k] / f64::from(size_px[k])));
        let inside = place.filter(|place| place.iter().all(|share| (0.0..=1.0).contains(share)));
        let [x, y] = inside.unwrap_or([0.0; 2]);
        let flag = inside.map_or(0, |_| super::flag(point));
        // Cannot fail: a string has room.
        write!(text, " {x:.6} {y:.6} {flag}").ok();
    }
    text
}

/// Returns the outline of the pixels of a label, in shares. Parts that lie apart are joined by a line of no width,
/// because YOLO has one polygon for each animal. Holes are filled.
fn outline(truth: &FrameTruth, label: u16, rect: Rect) -> String {
    let [width, height] = truth.size_px;
    let is_set = |x: i64, y: i64| {
        (0..i64::from(width)).contains(&x)
            && (0..i64::from(height)).contains(&y)
            && truth.labels[(y * i64::from(width) + x) as usize] == label
    };
    let parts = parts(rect, &is_set);
    let Some((first, others)) = parts.split_first() else {
        return String::new();
    };
    // The way out to each further part and back runs between their first corners.
    let mut corners = first.clone();
    for part in others {
        corners.push(first[0]);
        corners.extend(part);
        corners.push(part[0]);
    }
    if !others.is_empty() {
        corners.push(first[0]);
    }
    let mut text = String::new();
    for [x, y] in corners {
        let (x, y) = (x as f64 / f64::from(width), y as f64 / f64::from(height));
        // Cannot fail: a string has room.
        write!(text, " {x:.6} {y:.6}").ok();
    }
    text
}

/// Returns the outer outlines of the connected parts within a box, each as corners of pixels in clockwise order.
fn parts(rect: Rect, is_set: &impl Fn(i64, i64) -> bool) -> Vec<Vec<[i64; 2]>> {
    let mut outlines = Vec::new();
    let mut is_done = vec![false; rect.area() as usize];
    for y in rect.y..rect.bottom() {
        for x in rect.x..rect.right() {
            let at = |x: u32, y: u32| ((y - rect.y) * rect.w + x - rect.x) as usize;
            if is_done[at(x, y)] || !is_set(i64::from(x), i64::from(y)) {
                continue;
            }
            let mut open = vec![[x, y]];
            is_done[at(x, y)] = true;
            while let Some([x, y]) = open.pop() {
                let near = [
                    [x + 1, y],
                    [x.wrapping_sub(1), y],
                    [x, y + 1],
                    [x, y.wrapping_sub(1)],
                ];
                for [x, y] in near {
                    if rect.contains(x, y)
                        && !is_done[at(x, y)]
                        && is_set(i64::from(x), i64::from(y))
                    {
                        is_done[at(x, y)] = true;
                        open.push([x, y]);
                    }
                }
            }
            outlines.push(outer(i64::from(x), i64::from(y), is_set));
        }
    }
    outlines
}

/// Follows the outline of a part clockwise from its topmost, then leftmost pixel. Pixels that touch only at a
/// corner belong to different parts.
fn outer(left: i64, top: i64, is_set: &impl Fn(i64, i64) -> bool) -> Vec<[i64; 2]> {
    let (mut at, mut step) = ([left, top], [1, 0]);
    let mut corners = Vec::new();
    loop {
        corners.push(at);
        // Straight on as long as the pixel to the right of the edge is set and the one to its left is not.
        loop {
            at = [at[0] + step[0], at[1] + step[1]];
            let pixel = |side: i64| {
                // The pixel ahead, on the right (1) or left (-1) of the direction.
                let x = 2 * at[0] + step[0] - side * step[1];
                let y = 2 * at[1] + step[1] + side * step[0];
                is_set(x.div_euclid(2), y.div_euclid(2))
            };
            if !pixel(1) {
                step = [-step[1], step[0]]; // right turn
                break;
            }
            if pixel(-1) {
                step = [step[1], -step[0]]; // left turn
                break;
            }
        }
        if at == [left, top] {
            return corners;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Returns the truth of one animal whose pixels are `#`.
    fn truth(rows: &[&str]) -> FrameTruth {
        let size_px = [rows[0].len() as u32, rows.len() as u32];
        let labels: Vec<u16> = rows
            .concat()
            .bytes()
            .map(|b| u16::from(b == b'#'))
            .collect();
        let seen = Seen {
            visible_box: Some(Rect::of_size(size_px[0], size_px[1])),
            ..Seen::default()
        };
        FrameTruth {
            size_px,
            labels,
            seen: vec![seen],
            shadow: Vec::new(),
        }
    }

    /// Returns whether a point is inside of a polygon, by the even-odd rule.
    fn is_inside(polygon: &[[f64; 2]], [x, y]: [f64; 2]) -> bool {
        let edges = polygon.iter().zip(polygon.iter().cycle().skip(1));
        let n_left = edges.filter(|(a, b)| {
            (a[1] > y) != (b[1] > y) && a[0] + (y - a[1]) / (b[1] - a[1]) * (b[0] - a[0]) < x
        });
        n_left.count() % 2 == 1
    }

    #[test]
    fn outline_of_a_square_has_its_four_corners() {
        let text = labels(Task::Segment, &truth(&["....", ".##.", ".##.", "...."]));
        let corners = "0.250000 0.250000 0.750000 0.250000 0.750000 0.750000 0.250000 0.750000";
        assert_eq!(text, format!("0 {corners}\n"));
    }

    #[test]
    fn outline_encloses_the_pixels_of_all_parts_and_no_others() {
        let rows = [
            "#.......", ".##..#..", ".###.##.", "...#..#.", "##.##...", ".#..####", "....#..#",
            "#...####",
        ];
        let text = labels(Task::Segment, &truth(&rows));
        let numbers: Vec<f64> = (text.split_whitespace().skip(1))
            .map(|word| word.parse().expect("a number"))
            .collect();
        let polygon: Vec<[f64; 2]> = numbers
            .chunks(2)
            .map(|p| [8.0 * p[0], 8.0 * p[1]])
            .collect();
        for (y, row) in rows.iter().enumerate() {
            for (x, pixel) in row.bytes().enumerate() {
                let is_hole = y == 6 && (x == 5 || x == 6);
                let found = is_inside(&polygon, [x as f64 + 0.47, y as f64 + 0.53]);
                assert_eq!(found, pixel == b'#' || is_hole, "{x} {y}");
            }
        }
    }
}
