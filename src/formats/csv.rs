//! poses.csv: one row per frame with the scalars of poses.json, empty if null (docs/reference/formats.md,
//! "CSV files").

use std::fmt::Write;

use crate::geometry::rounded;
use crate::library::{Pose, Poses};

const COLUMNS: &str = "frame,time_s,detected,cut,confidence,head_confidence,depth_sign_confidence,\
centroid_x_px,centroid_y_px,box_x_px,box_y_px,box_w_px,box_h_px,area_px,axis_rad,heading_rad,\
length_px,height_px,skew,bend_rad,x_m,y_m,z_m,forward_x,forward_y,forward_z,yaw_rad,pitch_rad,\
gamma_rad,\
raw_heading_rad,raw_x_m,raw_y_m,raw_z_m,raw_forward_x,raw_forward_y,raw_forward_z,raw_gamma_rad,\
tail_beat_hz\n";

/// Returns the poses as comma-separated values, with a header line.
pub fn write_poses(poses: &Poses) -> String {
    let mut text = String::from(COLUMNS);
    for (idx, pose) in poses.frames.iter().enumerate() {
        let (detected, cut) = (u8::from(pose.detected()), u8::from(pose.cut));
        write!(text, "{idx},{},{detected},{cut}", rounded(pose.time_s, 6)).expect("memory");
        for value in scalars(pose).into_iter().chain([poses.tail_beat_hz(idx)]) {
            text.push(',');
            if let Some(value) = value {
                write!(text, "{}", rounded(value, 6)).expect("memory");
            }
        }
        text.push('\n');
    }
    text
}

/// Returns the scalars after `cut`, in the order of the header.
fn scalars(pose: &Pose) -> Vec<Option<f64>> {
    let at = |values: Option<[f64; 3]>, k: usize| values.map(|v| v[k]);
    let centroid = |k: usize| pose.centroid_px.map(|c| c[k]);
    let raw = pose.raw.unwrap_or_default();
    let rect = pose.box_px.map(|r| [r.x, r.y, r.w, r.h].map(f64::from));
    vec![
        pose.confidence,
        pose.head_confidence,
        pose.depth_sign_confidence,
        centroid(0),
        centroid(1),
        rect.map(|r| r[0]),
        rect.map(|r| r[1]),
        rect.map(|r| r[2]),
        rect.map(|r| r[3]),
        pose.area_px,
        pose.axis_rad,
        pose.heading_rad,
        pose.length_px,
        pose.height_px,
        pose.skew,
        pose.bend_rad,
        at(pose.position_m, 0),
        at(pose.position_m, 1),
        at(pose.position_m, 2),
        at(pose.forward, 0),
        at(pose.forward, 1),
        at(pose.forward, 2),
        pose.yaw_rad,
        pose.pitch_rad,
        pose.gamma_rad,
        raw.heading_rad,
        at(raw.position_m, 0),
        at(raw.position_m, 1),
        at(raw.position_m, 2),
        at(raw.forward, 0),
        at(raw.forward, 1),
        at(raw.forward, 2),
        raw.gamma_rad,
    ]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::library::View;

    #[test]
    fn every_row_has_as_many_cells_as_the_header() {
        let poses = Poses {
            tail_beat: None,
            fps: 30.0,
            image_size_px: [8, 8],
            view: View::Side,
            view_confidence: None,
            other_movers: Vec::new(),
            camera: None,
            animal: None,
            frames: vec![
                Pose::default(),
                Pose {
                    heading_rad: Some(1.0),
                    ..Pose::default()
                },
            ],
        };
        let text = write_poses(&poses);
        let counts: Vec<usize> = text.lines().map(|line| line.split(',').count()).collect();
        assert_eq!(counts, [38, 38, 38]);
        let heading = text.lines().nth(2).and_then(|line| line.split(',').nth(15));
        assert_eq!(heading, Some("1"));
    }
}
