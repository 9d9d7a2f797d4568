//! poses.csv: one row per frame with the scalars of poses.json, empty if null (docs/reference/formats.md,
//! "CSV files"). Cells are numbers, `true` or `false`, so nothing needs quotes and no crate for CSV.

pub mod motion; // motion.csv, summary.csv, and the same as JSON

use serde_json::Value;

use super::poses_json;
use crate::library::Poses;

/// Columns, each with the JSON pointer of its value in a frame of poses.json. The tail beat follows them.
const COLUMNS: [(&str, &str); 37] = [
    ("frame", "/frame"),
    ("time_s", "/time_s"),
    ("detected", "/detected"),
    ("cut", "/cut"),
    ("confidence", "/confidence"),
    ("head_confidence", "/head_confidence"),
    ("depth_sign_confidence", "/depth_sign_confidence"),
    ("centroid_x_px", "/centroid_px/0"),
    ("centroid_y_px", "/centroid_px/1"),
    ("box_x_px", "/box_px/0"),
    ("box_y_px", "/box_px/1"),
    ("box_w_px", "/box_px/2"),
    ("box_h_px", "/box_px/3"),
    ("area_px", "/area_px"),
    ("axis_rad", "/axis_rad"),
    ("heading_rad", "/heading_rad"),
    ("length_px", "/length_px"),
    ("height_px", "/height_px"),
    ("skew", "/skew"),
    ("bend_rad", "/bend_rad"),
    ("x_m", "/position_m/0"),
    ("y_m", "/position_m/1"),
    ("z_m", "/position_m/2"),
    ("forward_x", "/forward/0"),
    ("forward_y", "/forward/1"),
    ("forward_z", "/forward/2"),
    ("yaw_rad", "/yaw_rad"),
    ("pitch_rad", "/pitch_rad"),
    ("gamma_rad", "/gamma_rad"),
    ("raw_heading_rad", "/raw/heading_rad"),
    ("raw_x_m", "/raw/position_m/0"),
    ("raw_y_m", "/raw/position_m/1"),
    ("raw_z_m", "/raw/position_m/2"),
    ("raw_forward_x", "/raw/forward/0"),
    ("raw_forward_y", "/raw/forward/1"),
    ("raw_forward_z", "/raw/forward/2"),
    ("raw_gamma_rad", "/raw/gamma_rad"),
];

/// Returns the poses as comma-separated values, with a header line.
pub fn write_poses(poses: &Poses) -> String {
    let names = COLUMNS.map(|(name, _)| name).join(",");
    let mut text = format!("{names},tail_beat_hz\n");
    for (idx, pose) in poses.frames.iter().enumerate() {
        let frame = poses_json::frame(idx, pose);
        let cells =
            COLUMNS.map(|(_, pointer)| frame.pointer(pointer).map_or_else(String::new, cell));
        let tail_beat_hz = poses.tail_beat_hz(idx).map(poses_json::rounded_hz);
        let last = tail_beat_hz.map_or_else(String::new, |hz| hz.to_string());
        text += &format!("{},{last}\n", cells.join(","));
    }
    text
}

/// Returns a cell: a number, 0 or 1 for a bool, empty for null.
fn cell(value: &Value) -> String {
    match value {
        Value::Bool(is_true) => u8::from(*is_true).to_string(),
        value => value
            .as_f64()
            .map_or_else(String::new, |number| number.to_string()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::library::{BeatSpan, Pose, RawPose, TailBeat, TailBeatMethod, View};

    fn poses(frames: Vec<Pose>) -> Poses {
        Poses {
            tail_beat: None,
            fps: 30.0,
            image_size_px: [8, 8],
            view: View::Side,
            view_confidence: None,
            other_movers: Vec::new(),
            camera: None,
            animal: None,
            frames,
        }
    }

    #[test]
    fn every_row_has_as_many_cells_as_the_header() {
        let pose = Pose {
            heading_rad: Some(1.0),
            ..Pose::default()
        };
        let text = write_poses(&poses(vec![Pose::default(), pose]));
        let counts: Vec<usize> = text.lines().map(|line| line.split(',').count()).collect();
        assert_eq!(counts, [38, 38, 38]);
        let heading = text.lines().nth(2).and_then(|line| line.split(',').nth(15));
        assert_eq!(heading, Some("1"));
    }

    #[test]
    fn numbers_have_as_many_decimals_as_in_poses_json() {
        let third = 1.0 / 3.0;
        let pose = Pose {
            time_s: third,
            confidence: Some(third),
            centroid_px: Some([third; 2]),
            area_px: Some(third),
            heading_rad: Some(third),
            length_px: Some(third),
            position_m: Some([third; 3]),
            raw: Some(RawPose {
                forward: Some([third; 3]),
                ..RawPose::default()
            }),
            ..Pose::default()
        };
        let mut poses = poses(vec![pose]);
        poses.tail_beat = Some(TailBeat {
            method: TailBeatMethod::Bend,
            spans: vec![BeatSpan {
                frames: [0, 1],
                start_s: 0.0,
                end_s: third,
                frequency_hz: third,
                amplitude: third,
                confidence: third,
            }],
        });
        let text = write_poses(&poses);
        let row = "0,0.333333,1,0,0.3333,,,0.333,0.333,,,,,0.33,,0.33333,0.333,,,,\
            0.33333,0.33333,0.33333,,,,,,,,,,,0.33333,0.33333,0.33333,,0.333";
        assert_eq!(text.lines().nth(1), Some(row));
    }
}
