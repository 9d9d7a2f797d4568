//! tracks.csv: one row for each frame and individual, in pixels of the video (docs/reference/formats.md,
//! "Ground truth"). Cells without a value are empty.

use std::io::{self, Write};

use super::{FilmShape, flag, with_truth};
use crate::flock::Flock;
use crate::flock::composite::keypoints::NAMES;
use crate::flock::composite::truth::FrameTruth;
use crate::geometry::rounded;

/// The columns before the keypoints.
const COLUMNS: &str = "frame,time_s,id,x_px,y_px,heading_rad,scale,depth_m,source_frame,mirrored,\
rotation_rad,visible_x_px,visible_y_px,visible_w_px,visible_h_px,visible_area_px,amodal_x_px,amodal_y_px,\
amodal_w_px,amodal_h_px,amodal_area_px,visibility,depth_rank,forward_x,forward_y,forward_z,keypoint_source";

/// Returns the header line.
pub fn header() -> String {
    let points = NAMES.map(|name| format!(",{name}_x_px,{name}_y_px,{name}_v"));
    format!("{COLUMNS}{}\n", points.concat())
}

/// Writes the rows of one frame.
pub fn write_frame(
    out: &mut impl Write,
    flock: &Flock,
    film: &FilmShape,
    frame_idx: usize,
    truth: &FrameTruth,
) -> io::Result<()> {
    let time_s = rounded(frame_idx as f64 / film.fps, 6);
    for (individual, seen) in with_truth(flock, truth) {
        let [x, y] = seen.centroid_px.map(|px| rounded(px, 3));
        let depth = individual.depth_m.as_ref().map(|depth| depth[frame_idx]);
        write!(
            out,
            "{frame_idx},{time_s},{},{x},{y},{},{},{},{},{},{},",
            individual.id,
            individual.heading_rad[frame_idx],
            rounded(seen.scale, 6),
            depth.map(|depth| depth.to_string()).unwrap_or_default(),
            individual.source_frame[frame_idx],
            u8::from(individual.mirrored[frame_idx]),
            individual.rotation_rad[frame_idx],
        )?;
        match seen.visible_box {
            Some(rect) => write!(out, "{},{},{},{},", rect.x, rect.y, rect.w, rect.h)?,
            None => out.write_all(b",,,,")?,
        }
        write!(out, "{},", seen.visible_area)?;
        match seen.amodal_box {
            Some([x, y, w, h]) => write!(out, "{x},{y},{w},{h},")?,
            None => out.write_all(b",,,,")?,
        }
        let visibility = rounded(seen.visibility, 4);
        write!(
            out,
            "{},{visibility},{},",
            seen.amodal_area, seen.depth_rank
        )?;
        match individual.forward.as_ref().map(|all| all[frame_idx]) {
            Some([x, y, z]) => write!(out, "{x},{y},{z},")?,
            None => out.write_all(b",,,")?,
        }
        out.write_all(seen.keypoint_source.name().as_bytes())?;
        for point in &seen.keypoints {
            match point.map(|point| point.px.map(|px| rounded(px, 3))) {
                Some([x, y]) => write!(out, ",{x},{y},{}", flag(point))?,
                None => out.write_all(b",,,0")?,
            }
        }
        writeln!(out)?;
    }
    Ok(())
}
