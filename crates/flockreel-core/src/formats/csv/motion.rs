//! motion.csv, motion.json, summary.csv and summary.json: places, speeds, lengths and areas in centimetres, and the
//! summary of a film (docs/reference/formats.md, "Motion"). They follow from poses.json and the scale of the
//! library. Without a scale, values in centimetres are null, or empty cells.

use crate::geometry::rounded;
use crate::library::motion::{speeds_px_per_s, step_px, summarize_motion};
use crate::library::{Pose, Poses, Scale, Zones};

/// Names and versions of the schemas.
const MOTION_SCHEMA: &str = "flockreel/motion@1";
const SUMMARY_SCHEMA: &str = "flockreel/summary@1";

/// A measured film with its sizes.
#[derive(Clone, Copy)]
pub struct Film<'a> {
    /// Poses of all frames.
    pub poses: &'a Poses,
    /// Body length, pixels; `None` if it is unknown.
    pub length_px: Option<f64>,
    /// Scale; `None` if nobody has set it.
    pub scale: Option<Scale>,
}

/// The columns of a table, in order, with the values of one row.
type Row = Vec<(&'static str, Option<f64>)>;

/// Returns summary.csv: a header, and one row for each film with its name. Each zone adds columns.
pub fn write_summaries(films: &[(&str, Film<'_>)], zones: &Zones) -> String {
    let mut text = String::new();
    for (name, film) in films {
        let row = film.summary(zones);
        if text.is_empty() {
            text = format!("library,{}\n", header(&row));
        }
        text += &format!("{},{}\n", quoted(name), cells(&row));
    }
    text
}

impl Film<'_> {
    /// Returns motion.csv: a header, and one row per frame.
    pub fn motion_csv(self) -> String {
        let rows = self.frames();
        let header = rows.first().map(|row| header(row)).unwrap_or_default();
        let lines = std::iter::once(header).chain(rows.iter().map(|row| cells(row)));
        lines.collect::<Vec<_>>().join("\n") + "\n"
    }

    /// Returns motion.json, one line per frame.
    pub fn motion_json(self) -> String {
        let rows: Vec<String> = self.frames().iter().map(|row| object(row)).collect();
        let fields = [vec![("fps", Some(self.poses.fps))], self.size()].concat();
        let head = json_with_header(MOTION_SCHEMA, &fields);
        let head = head.trim_end_matches('}');
        format!("{head},\"frames\":[\n{}\n]}}\n", rows.join(",\n"))
    }

    /// Returns summary.json. Each zone adds fields.
    pub fn summary_json(self, zones: &Zones) -> String {
        json_with_header(SUMMARY_SCHEMA, &self.summary(zones)) + "\n"
    }

    fn cm(self, px: Option<f64>) -> Option<f64> {
        Some(self.scale?.cm(px?))
    }

    /// Returns a length in body lengths.
    fn bl(self, px: Option<f64>) -> Option<f64> {
        Some(rounded(px? / self.length_px?, 4))
    }

    fn frames(self) -> Vec<Row> {
        let speeds = speeds_px_per_s(self.poses);
        let frames = self.poses.frames.iter().zip(speeds).enumerate();
        let rows = frames.map(|(frame, (pose, speed))| self.frame(frame, pose, speed));
        rows.collect()
    }

    fn frame(self, frame: usize, pose: &Pose, speed_px_per_s: Option<f64>) -> Row {
        let place = |axis: usize| self.cm(pose.centroid_px.map(|place| place[axis]));
        let area_cm2 = (self.scale.zip(pose.area_px)).map(|(scale, area)| scale.cm2(area));
        vec![
            ("frame", Some(frame as f64)),
            ("time_s", Some(rounded(pose.time_s, 6))),
            ("x_cm", place(0)),
            ("y_cm", place(1)),
            ("speed_bl_per_s", self.bl(speed_px_per_s)),
            ("speed_cm_per_s", self.cm(speed_px_per_s)),
            ("length_cm", self.cm(pose.length_px)),
            ("height_cm", self.cm(pose.height_px)),
            ("area_cm2", area_cm2),
        ]
    }

    /// Returns the scale and the body length.
    fn size(self) -> Row {
        vec![
            ("px_per_cm", self.scale.map(Scale::px_per_cm)),
            ("length_px", self.length_px.map(|length| rounded(length, 3))),
            ("length_cm", self.cm(self.length_px)),
        ]
    }

    fn summary(self, zones: &Zones) -> Vec<(String, Option<f64>)> {
        let motion = summarize_motion(self.poses, self.length_px);
        let distance_px = Some(motion.distance_px);
        let row = vec![
            ("seen_s", Some(rounded(motion.seen_s, 3))),
            ("distance_bl", self.bl(distance_px)),
            ("distance_cm", self.cm(distance_px)),
            ("mean_speed_bl_per_s", self.bl(motion.mean_speed_px_per_s)),
            ("mean_speed_cm_per_s", self.cm(motion.mean_speed_px_per_s)),
            (
                "median_speed_bl_per_s",
                self.bl(motion.median_speed_px_per_s),
            ),
            (
                "median_speed_cm_per_s",
                self.cm(motion.median_speed_px_per_s),
            ),
            ("peak_speed_bl_per_s", self.bl(motion.peak_speed_px_per_s)),
            ("peak_speed_cm_per_s", self.cm(motion.peak_speed_px_per_s)),
            ("rest_s", motion.rest.map(|rest| rounded(rest.time_s, 3))),
            ("n_rest_bouts", motion.rest.map(|rest| rest.n_bouts as f64)),
            (
                "turns_per_min",
                motion.turns_per_min.map(|turns| rounded(turns, 2)),
            ),
        ];
        let row = self.size().into_iter().chain(row);
        let row = row.map(|(name, value)| (name.to_owned(), value));
        row.chain(self.zones(zones, motion.seen_s)).collect()
    }

    /// Returns how the animal used each zone.
    fn zones(self, zones: &Zones, seen_s: f64) -> Vec<(String, Option<f64>)> {
        let columns = zones.iter().flat_map(|zone| {
            let used = zone.used(self.poses, step_px(self.length_px));
            let share = (seen_s > 0.0).then(|| rounded(used.time_s / seen_s, 4));
            let distance_px = Some(used.distance_px);
            let row: Row = vec![
                ("s", Some(rounded(used.time_s, 3))),
                ("share", share),
                ("visits", Some(used.n_visits as f64)),
                ("first_s", used.first_s.map(|s| rounded(s, 3))),
                ("distance_bl", self.bl(distance_px)),
                ("distance_cm", self.cm(distance_px)),
            ];
            let named = |(name, value): (_, _)| (format!("{}_{name}", zone.name), value);
            row.into_iter().map(named).collect::<Vec<_>>()
        });
        columns.collect()
    }
}

fn header<Name: AsRef<str>>(row: &[(Name, Option<f64>)]) -> String {
    let names: Vec<&str> = row.iter().map(|(name, _)| name.as_ref()).collect();
    names.join(",")
}

/// Returns the cells of a row, empty for null. Numbers need no quotes.
fn cells<Name>(row: &[(Name, Option<f64>)]) -> String {
    let cells = row
        .iter()
        .map(|(_, value)| text(*value).unwrap_or_default());
    cells.collect::<Vec<_>>().join(",")
}

/// Returns a row as a JSON object, with its fields in order.
fn object<Name: AsRef<str>>(row: &[(Name, Option<f64>)]) -> String {
    let fields = row.iter().map(|(name, value)| {
        let name = name.as_ref();
        let value = text(*value).unwrap_or_else(|| "null".into());
        format!("\"{name}\":{value}")
    });
    format!("{{{}}}", fields.collect::<Vec<_>>().join(","))
}

fn json_with_header<Name: AsRef<str>>(schema: &str, row: &[(Name, Option<f64>)]) -> String {
    let version = env!("CARGO_PKG_VERSION");
    let fields = object(row);
    let fields = fields.trim_start_matches('{');
    format!("{{\"schema\":\"{schema}\",\"version\":\"{version}\",{fields}")
}

/// Returns a number as text; JSON and CSV have the same.
fn text(value: Option<f64>) -> Option<String> {
    (value.filter(|value| value.is_finite())).map(|value| value.to_string())
}

/// Returns a name as a cell (RFC 4180).
fn quoted(name: &str) -> String {
    if name.contains([',', '"', '\n', '\r']) {
        format!("\"{}\"", name.replace('"', "\"\""))
    } else {
        name.to_owned()
    }
}

#[cfg(test)]
mod tests {
    use serde_json::{Value, json};

    use super::*;
    use crate::library::View;

    /// An animal 20 px long that swims 40 px in a second, then is lost.
    fn poses() -> Poses {
        let frame = |k: usize| Pose {
            time_s: k as f64 / 10.0,
            centroid_px: (k < 11).then_some([4.0 * k as f64, 8.0]),
            length_px: (k < 11).then_some(20.0),
            height_px: (k < 11).then_some(10.0),
            area_px: (k < 11).then_some(150.0),
            ..Pose::default()
        };
        Poses {
            tail_beat: None,
            fps: 10.0,
            image_size_px: [64, 16],
            view: View::Top,
            view_confidence: None,
            other_movers: Vec::new(),
            camera: None,
            animal: None,
            frames: (0..12).map(frame).collect(),
        }
    }

    fn film(poses: &Poses, scale: Option<Scale>) -> Film<'_> {
        Film {
            poses,
            length_px: Some(20.0),
            scale,
        }
    }

    fn scale() -> Option<Scale> {
        Scale::new(8.0).ok()
    }

    #[test]
    fn rows_of_motion_are_in_centimetres_with_a_scale() {
        let text = film(&poses(), scale()).motion_csv();
        let lines: Vec<&str> = text.lines().collect();
        assert_eq!(
            lines[0],
            "frame,time_s,x_cm,y_cm,speed_bl_per_s,speed_cm_per_s,length_cm,height_cm,area_cm2"
        );
        assert_eq!(lines[3], "2,0.2,1,1,2,5,2.5,1.25,2.34375");
        assert_eq!(lines[12], "11,1.1,,,,,,,");
        assert_eq!(lines.len(), 13);
    }

    #[test]
    fn without_a_scale_only_body_lengths_are_known() {
        let text = film(&poses(), None).motion_csv();
        assert_eq!(text.lines().nth(3), Some("2,0.2,,,2,,,,"));
        let summary = write_summaries(&[("film", film(&poses(), None))], &Zones::default());
        let row = summary.lines().nth(1);
        assert_eq!(row, Some("film,,20,,1.1,2,,1.8182,,2,,2,,0,0,"));
    }

    #[test]
    fn json_has_the_values_of_the_rows() {
        let file: Value =
            serde_json::from_str(&film(&poses(), scale()).motion_json()).expect("JSON");
        assert_eq!(
            (&file["px_per_cm"], &file["length_px"]),
            (&json!(8), &json!(20))
        );
        assert_eq!(file["frames"][2]["speed_cm_per_s"], json!(5));
        assert_eq!(file["frames"][11]["x_cm"], Value::Null);
        let summary: Value =
            serde_json::from_str(&film(&poses(), scale()).summary_json(&Zones::default()))
                .expect("JSON");
        assert_eq!(summary["schema"], json!(SUMMARY_SCHEMA));
        assert_eq!(summary["distance_cm"], json!(5));
        assert_eq!(summary["mean_speed_cm_per_s"], json!(4.5455));
    }

    #[test]
    fn each_film_is_a_row_of_the_summary() {
        let (one, two) = (poses(), poses());
        let zones: Zones = "right:rect:20,0,44,16".parse().unwrap();
        let text = write_summaries(
            &[("a, \"b\"", film(&one, scale())), ("c", film(&two, None))],
            &zones,
        );
        let lines: Vec<&str> = text.lines().collect();
        assert_eq!(lines.len(), 3);
        assert!(lines[0].starts_with("library,px_per_cm,length_px,length_cm,seen_s,distance_bl,"));
        assert!(
            lines[1].starts_with("\"a, \"\"b\"\"\",8,20,2.5,1.1,2,5,"),
            "{}",
            lines[1]
        );
        assert_eq!(lines[0].split(',').count(), lines[2].split(',').count());
        // From 20 to 40 px in 0.6 s.
        let columns =
            "right_s,right_share,right_visits,right_first_s,right_distance_bl,right_distance_cm";
        assert!(lines[0].ends_with(columns), "{}", lines[0]);
        assert!(
            lines[1].ends_with(",0.6,0.5455,1,0.5,1,2.5"),
            "{}",
            lines[1]
        );
        assert!(lines[2].ends_with(",0.6,0.5455,1,0.5,1,"), "{}", lines[2]);
    }
}
