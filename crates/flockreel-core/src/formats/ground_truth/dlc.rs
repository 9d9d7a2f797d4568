//! Keypoints in the CSV layout of DeepLabCut with several individuals (docs/reference/formats.md, "Ground truth").
//!
//! The predictions (`tracks_dlc.csv`) have x, y and likelihood, and are read by DeepLabCut, movement and sleap-io.
//! The labels (`CollectedData_flockreel.csv`) have x and y of pictures, as DeepLabCut's training reads them.
//! Coordinates count the center of the first pixel as (0.5, 0.5), as in all files of the ground truth.

use std::io::{self, Write};

use crate::flock::composite::keypoints::{N_KEYPOINTS, NAMES};
use crate::flock::composite::truth::{FrameTruth, Keypoint};
use crate::geometry::rounded;

/// Name of the labeler in the first line.
const SCORER: &str = "flockreel";

/// The two layouts.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Layout {
    /// x, y and likelihood of every frame of a video: 1 visible, 0.5 hidden.
    Predictions,
    /// x and y of pictures. Only visible keypoints have values.
    Labels,
}

impl Layout {
    fn coordinates(self) -> &'static [&'static str] {
        match self {
            Layout::Predictions => &["x", "y", "likelihood"],
            Layout::Labels => &["x", "y"],
        }
    }
}

/// Writes the four header lines for individuals with the ids 0 to `count` - 1.
pub fn write_header(out: &mut impl Write, layout: Layout, count: usize) -> io::Result<()> {
    // A label names its picture in three columns: folder, folder, file.
    let index = if layout == Layout::Labels { ",," } else { "" };
    let line = |title: &str, cell: &dyn Fn(usize, &str, &str) -> String| {
        let mut line = format!("{title}{index}");
        for id in 0..count {
            for name in NAMES {
                for coordinate in layout.coordinates() {
                    line.push(',');
                    line.push_str(&cell(id, name, coordinate));
                }
            }
        }
        line + "\n"
    };
    out.write_all(line("scorer", &|_, _, _| SCORER.into()).as_bytes())?;
    out.write_all(line("individuals", &|id, _, _| format!("animal_{id}")).as_bytes())?;
    out.write_all(line("bodyparts", &|_, name, _| name.into()).as_bytes())?;
    out.write_all(line("coords", &|_, _, coordinate| coordinate.into()).as_bytes())
}

/// Writes the line of one frame. `name` is its number, or folder, folder and file of a picture.
pub fn write_frame(
    out: &mut impl Write,
    layout: Layout,
    name: &str,
    truth: &FrameTruth,
) -> io::Result<()> {
    out.write_all(name.as_bytes())?;
    for seen in &truth.seen {
        for point in &seen.keypoints {
            out.write_all(cells(layout, point).as_bytes())?;
        }
    }
    writeln!(out)
}

/// Returns the cells of a keypoint, each after a comma.
fn cells(layout: Layout, point: &Option<Keypoint>) -> String {
    let shown = point.filter(|point| layout == Layout::Predictions || point.is_visible);
    let Some(Keypoint { px, is_visible }) = shown else {
        return ",".repeat(layout.coordinates().len());
    };
    let [x, y] = px.map(|px| rounded(px, 3));
    match layout {
        Layout::Predictions => format!(",{x},{y},{}", if is_visible { 1.0 } else { 0.5 }),
        Layout::Labels => format!(",{x},{y}"),
    }
}

/// Writes the keypoints of one animal in the single-animal layout of predictions: a header of three lines, then a
/// line for each frame. `confidence` of a frame stands for all its points.
pub fn write_single(
    out: &mut impl Write,
    frames: impl Iterator<Item = ([Option<[f64; 2]>; N_KEYPOINTS], f64)>,
) -> io::Result<()> {
    let header = |title: &str, cell: &dyn Fn(&str, &str) -> String| {
        let cells = NAMES.iter().flat_map(|name| {
            let coordinates = Layout::Predictions.coordinates().iter();
            coordinates.map(|coordinate| format!(",{}", cell(name, coordinate)))
        });
        format!("{title}{}\n", cells.collect::<String>())
    };
    out.write_all(header("scorer", &|_, _| SCORER.into()).as_bytes())?;
    out.write_all(header("bodyparts", &|name, _| name.into()).as_bytes())?;
    out.write_all(header("coords", &|_, coordinate| coordinate.into()).as_bytes())?;
    for (frame, (points, confidence)) in frames.enumerate() {
        write!(out, "{frame}")?;
        for point in points {
            match point.map(|px| px.map(|px| rounded(px, 3))) {
                Some([x, y]) => write!(out, ",{x},{y},{}", rounded(confidence, 4))?,
                None => out.write_all(b",,,")?,
            }
        }
        writeln!(out)?;
    }
    Ok(())
}
