//! poses.json: the measurements of every frame (docs/reference/formats.md, "poses.json").
//!
//! Numbers are rounded to their significant digits (`round`). Files stay readable, and equal measurements
//! give equal bytes.

pub(super) mod mover; // moving objects other than the animal

use serde::{Deserialize, Serialize};

use self::mover::MoverFile;
use crate::analysis::Params;
use crate::geometry::{Camera, Rect, rounded};
use crate::library::{
    Animal, BeatSpan, BodyPose, Pose, Poses, RawPose, TailBeat, TailBeatMethod, View,
};

/// Name and version of the schema.
pub const SCHEMA: &str = "flockreel/poses@2";

/// Returns the poses as JSON, one line per frame.
pub fn write(poses: &Poses, params: Option<&Params>) -> Vec<u8> {
    let file = PosesFile {
        schema: SCHEMA.into(),
        version: env!("CARGO_PKG_VERSION").into(),
        params: params.cloned(),
        fps: poses.fps,
        image_size_px: poses.image_size_px,
        view: poses.view,
        view_confidence: poses.view_confidence.map(|value| rounded(value, 3)),
        other_movers: poses.other_movers.iter().map(MoverFile::new).collect(),
        camera: poses.camera.map(CameraFile),
        animal: poses.animal.map(AnimalFile),
        tail_beat: poses.tail_beat.as_ref().map(TailBeatFile::new),
        frames: (), // written line by line below
    };
    let head = serde_json::to_string(&file).expect("plain values serialise");
    let mut bytes = head
        .strip_suffix("null}")
        .expect("frames come last")
        .as_bytes()
        .to_vec();
    bytes.extend(b"[\n");
    for (idx, pose) in poses.frames.iter().enumerate() {
        serde_json::to_writer(&mut bytes, &PoseFile::new(idx, pose))
            .expect("plain values serialise");
        bytes.extend(if idx + 1 < poses.frames.len() {
            &b",\n"[..]
        } else {
            b"\n"
        });
    }
    bytes.extend(b"]}\n");
    bytes
}

/// Returns one frame as JSON.
pub(super) fn frame(idx: usize, pose: &Pose) -> serde_json::Value {
    serde_json::to_value(PoseFile::new(idx, pose)).expect("plain values serialise")
}

/// Rounds a frequency as in the file.
pub(super) fn rounded_hz(frequency_hz: f64) -> f64 {
    rounded(frequency_hz, 3)
}

/// Parses the output of `write`.
pub fn read(bytes: &[u8]) -> Result<Poses, serde_json::Error> {
    let file: PosesFile<Vec<PoseFile>> = serde_json::from_slice(bytes)?;
    Ok(Poses {
        fps: file.fps,
        image_size_px: file.image_size_px,
        view: file.view,
        view_confidence: file.view_confidence,
        other_movers: file
            .other_movers
            .into_iter()
            .map(MoverFile::into_mover)
            .collect(),
        camera: file.camera.map(|camera| camera.0),
        animal: file.animal.map(|animal| animal.0),
        frames: file.frames.into_iter().map(PoseFile::into_pose).collect(),
        tail_beat: file.tail_beat.map(TailBeatFile::into_tail_beat),
    })
}

#[derive(Serialize, Deserialize)]
struct PosesFile<Frames> {
    schema: String,
    version: String,
    #[serde(default, deserialize_with = "super::params::of_any_version")]
    params: Option<Params>,
    fps: f64,
    image_size_px: [u32; 2],
    #[serde(with = "ViewName")]
    view: View,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    view_confidence: Option<f64>,
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    other_movers: Vec<MoverFile>,
    camera: Option<CameraFile>,
    animal: Option<AnimalFile>,
    #[serde(default)]
    tail_beat: Option<TailBeatFile>,
    frames: Frames,
}

#[derive(Serialize, Deserialize)]
#[serde(remote = "View", rename_all = "snake_case")]
enum ViewName {
    Side,
    Top,
}

#[derive(Serialize, Deserialize)]
#[serde(transparent)]
struct CameraFile(#[serde(with = "CameraFields")] Camera);

#[derive(Serialize, Deserialize)]
#[serde(remote = "Camera")]
struct CameraFields {
    z_min_m: f64,
    pane_px_per_m: f64,
    center_px: [f64; 2],
    medium_index: f64,
}

#[derive(Serialize, Deserialize)]
#[serde(transparent)]
struct AnimalFile(#[serde(with = "AnimalFields")] Animal);

#[derive(Serialize, Deserialize)]
#[serde(remote = "Animal")]
struct AnimalFields {
    length_m: f64,
    height_m: f64,
}

#[derive(Serialize, Deserialize)]
struct TailBeatFile {
    #[serde(with = "MethodName")]
    method: TailBeatMethod,
    spans: Vec<BeatSpanFile>,
}

#[derive(Serialize, Deserialize)]
#[serde(remote = "TailBeatMethod", rename_all = "snake_case")]
enum MethodName {
    Bend,
    LengthAndSkew,
}

#[derive(Serialize, Deserialize)]
#[serde(transparent)]
struct BeatSpanFile(#[serde(with = "BeatSpanFields")] BeatSpan);

#[derive(Serialize, Deserialize)]
#[serde(remote = "BeatSpan")]
struct BeatSpanFields {
    frames: [usize; 2],
    start_s: f64,
    end_s: f64,
    frequency_hz: f64,
    amplitude: f64,
    confidence: f64,
}

impl TailBeatFile {
    fn new(beat: &TailBeat) -> TailBeatFile {
        let span = |span: &BeatSpan| BeatSpan {
            frames: span.frames,
            start_s: rounded(span.start_s, 6),
            end_s: rounded(span.end_s, 6),
            frequency_hz: rounded_hz(span.frequency_hz),
            amplitude: rounded(span.amplitude, 5),
            confidence: rounded(span.confidence, 4),
        };
        TailBeatFile {
            method: beat.method,
            spans: beat.spans.iter().map(span).map(BeatSpanFile).collect(),
        }
    }

    fn into_tail_beat(self) -> TailBeat {
        TailBeat {
            method: self.method,
            spans: self.spans.into_iter().map(|span| span.0).collect(),
        }
    }
}

#[derive(Serialize, Deserialize)]
struct PoseFile {
    frame: usize,
    time_s: f64,
    detected: bool,
    cut: bool,
    confidence: Option<f64>,
    head_confidence: Option<f64>,
    depth_sign_confidence: Option<f64>,
    centroid_px: Option<[f64; 2]>,
    box_px: Option<[u32; 4]>,
    area_px: Option<f64>,
    axis_rad: Option<f64>,
    heading_rad: Option<f64>,
    length_px: Option<f64>,
    height_px: Option<f64>,
    skew: Option<f64>,
    midline_px: Option<Vec<[f64; 2]>>,
    bend_rad: Option<f64>,
    position_m: Option<[f64; 3]>,
    forward: Option<[f64; 3]>,
    yaw_rad: Option<f64>,
    pitch_rad: Option<f64>,
    gamma_rad: Option<f64>,
    raw: Option<RawFile>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    body: Option<BodyFile>,
}

#[derive(Serialize, Deserialize)]
#[serde(transparent)]
struct BodyFile(#[serde(with = "BodyFields")] BodyPose);

#[derive(Serialize, Deserialize)]
#[serde(remote = "BodyPose")]
struct BodyFields {
    joint_angles_rad: [f64; 8],
    tail_tip_rad: f64,
    fin_spread_rad: f64,
}

#[derive(Serialize, Deserialize)]
#[serde(transparent)]
struct RawFile(#[serde(with = "RawFields")] RawPose);

/// Estimates from one frame only, before all frames are combined.
#[derive(Serialize, Deserialize)]
#[serde(remote = "RawPose")]
struct RawFields {
    heading_rad: Option<f64>,
    position_m: Option<[f64; 3]>,
    forward: Option<[f64; 3]>,
    gamma_rad: Option<f64>,
}

impl PoseFile {
    fn new(frame: usize, pose: &Pose) -> PoseFile {
        let decimals = |n: i32| move |value: f64| rounded(value, n);
        PoseFile {
            frame,
            time_s: rounded(pose.time_s, 6),
            detected: pose.detected(),
            cut: pose.cut,
            confidence: pose.confidence.map(decimals(4)),
            head_confidence: pose.head_confidence.map(decimals(4)),
            depth_sign_confidence: pose.depth_sign_confidence.map(decimals(4)),
            centroid_px: pose.centroid_px.map(|p| p.map(decimals(3))),
            box_px: pose.box_px.map(|r| [r.x, r.y, r.w, r.h]),
            area_px: pose.area_px.map(decimals(2)),
            axis_rad: pose.axis_rad.map(decimals(5)),
            heading_rad: pose.heading_rad.map(decimals(5)),
            length_px: pose.length_px.map(decimals(3)),
            height_px: pose.height_px.map(decimals(3)),
            skew: pose.skew.map(decimals(5)),
            midline_px: pose
                .midline_px
                .as_ref()
                .map(|points| points.iter().map(|p| p.map(decimals(2))).collect()),
            bend_rad: pose.bend_rad.map(decimals(5)),
            position_m: pose.position_m.map(|p| p.map(decimals(5))),
            forward: pose.forward.map(|p| p.map(decimals(5))),
            yaw_rad: pose.yaw_rad.map(decimals(5)),
            pitch_rad: pose.pitch_rad.map(decimals(5)),
            gamma_rad: pose.gamma_rad.map(decimals(5)),
            raw: pose.raw.map(|raw| {
                RawFile(RawPose {
                    heading_rad: raw.heading_rad.map(decimals(5)),
                    position_m: raw.position_m.map(|p| p.map(decimals(5))),
                    forward: raw.forward.map(|p| p.map(decimals(5))),
                    gamma_rad: raw.gamma_rad.map(decimals(5)),
                })
            }),
            body: pose.body.map(|body| {
                BodyFile(BodyPose {
                    joint_angles_rad: body.joint_angles_rad.map(decimals(5)),
                    tail_tip_rad: rounded(body.tail_tip_rad, 5),
                    fin_spread_rad: rounded(body.fin_spread_rad, 5),
                })
            }),
        }
    }

    fn into_pose(self) -> Pose {
        Pose {
            time_s: self.time_s,
            cut: self.cut,
            confidence: self.confidence,
            head_confidence: self.head_confidence,
            depth_sign_confidence: self.depth_sign_confidence,
            centroid_px: self.centroid_px,
            box_px: self.box_px.map(|[x, y, w, h]| Rect { x, y, w, h }),
            area_px: self.area_px,
            axis_rad: self.axis_rad,
            heading_rad: self.heading_rad,
            length_px: self.length_px,
            height_px: self.height_px,
            skew: self.skew,
            midline_px: self.midline_px,
            bend_rad: self.bend_rad,
            position_m: self.position_m,
            forward: self.forward,
            yaw_rad: self.yaw_rad,
            pitch_rad: self.pitch_rad,
            gamma_rad: self.gamma_rad,
            raw: self.raw.map(|raw| raw.0),
            body: self.body.map(|body| body.0),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn poses_are_read_back_as_written() {
        let pose = Pose {
            time_s: 0.033,
            centroid_px: Some([12.25, 7.5]),
            box_px: Some(Rect {
                x: 3,
                y: 4,
                w: 5,
                h: 6,
            }),
            heading_rad: Some(-1.5),
            raw: Some(RawPose {
                heading_rad: Some(-1.25),
                forward: Some([0.6, 0.0, -0.8]),
                ..RawPose::default()
            }),
            body: Some(BodyPose {
                joint_angles_rad: [0.125; 8],
                tail_tip_rad: -0.25,
                fin_spread_rad: 1.5,
            }),
            ..Pose::default()
        };
        let poses = Poses {
            fps: 30.0,
            image_size_px: [64, 48],
            view: View::Top,
            view_confidence: None,
            other_movers: Vec::new(),
            camera: None,
            animal: Some(Animal {
                length_m: 0.1,
                height_m: 0.057,
            }),
            frames: vec![Pose::default(), pose],
            tail_beat: Some(TailBeat {
                method: TailBeatMethod::Bend,
                spans: vec![BeatSpan {
                    frames: [0, 2],
                    start_s: 0.0,
                    end_s: 0.066667,
                    frequency_hz: 3.25,
                    amplitude: 0.2,
                    confidence: 0.9,
                }],
            }),
        };
        assert_eq!(
            read(&write(&poses, Some(&Params::default()))).expect("our own file"),
            poses
        );
    }
}
