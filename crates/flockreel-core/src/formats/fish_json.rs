//! fish.json: the motion of a virtual fish and the measured beat of its tail (docs/reference/formats.md, "Virtual fish").

use serde::Serialize;

use crate::fish::{Beat, Motion, Posture};
use crate::geometry::{Camera, rounded};

/// Name and version of the schema.
pub const SCHEMA: &str = "flockreel/fish@1";

/// Returns the motion as JSON, one line per frame.
pub fn write(motion: &Motion) -> Vec<u8> {
    let file = FishFile {
        schema: SCHEMA,
        version: env!("CARGO_PKG_VERSION"),
        fps: motion.fps,
        image_size_px: motion.image_size_px,
        length_m: motion.size.length_m,
        camera: CameraFile::new(&motion.camera),
        beat_hz: (motion.beat_hz > 0.0).then(|| rounded(motion.beat_hz, 2)),
        frames: (), // written line by line below
    };
    let head = serde_json::to_string(&file).expect("plain values serialise");
    let head = head.strip_suffix("null}").expect("frames come last");
    let mut text = format!("{head}[\n");
    for (frame, (posture, beat)) in motion.frames.iter().zip(&motion.beats).enumerate() {
        let line = FrameFile::new(frame, posture, beat.as_ref());
        text += if frame == 0 { "" } else { ",\n" };
        text += &serde_json::to_string(&line).expect("plain values serialise");
    }
    text += "\n]}\n";
    text.into_bytes()
}

#[derive(Serialize)]
struct FishFile {
    schema: &'static str,
    version: &'static str,
    fps: f64,
    image_size_px: [u32; 2],
    length_m: f64,
    camera: CameraFile,
    beat_hz: Option<f64>,
    frames: (),
}

#[derive(Serialize)]
struct CameraFile {
    focal_px: f64,
    center_px: [f64; 2],
    z_min_m: f64,
    medium_index: f64,
}

#[derive(Serialize)]
struct FrameFile {
    frame: usize,
    visible: bool,
    position_m: [f64; 3],
    forward: [f64; 3],
    joint_angles_rad: [f64; 8],
    bend_bl: Option<f64>,
    tail_tip_rad: Option<f64>,
    tail_tip_confidence: Option<f64>,
    phase_rad: Option<f64>,
    phase_confidence: Option<f64>,
    side_confidence: Option<f64>,
}

impl CameraFile {
    fn new(camera: &Camera) -> CameraFile {
        CameraFile {
            focal_px: rounded(camera.focal_px(), 3),
            center_px: camera.center_px,
            z_min_m: rounded(camera.z_min_m, 5),
            medium_index: camera.medium_index,
        }
    }
}

impl FrameFile {
    fn new(frame: usize, posture: &Posture, beat: Option<&Beat>) -> FrameFile {
        let beat = beat.filter(|_| posture.visible);
        let of = |value: fn(&Beat) -> f64, decimals| Some(rounded(value(beat?), decimals));
        let phase_turns = beat.and_then(|beat| beat.phase_turns);
        FrameFile {
            frame,
            visible: posture.visible,
            position_m: posture.position_m.to_array().map(|m| rounded(m, 5)),
            forward: posture.forward().to_array().map(|part| rounded(part, 5)),
            joint_angles_rad: posture.joint_angles_rad.map(|angle| rounded(angle, 5)),
            bend_bl: of(|beat| beat.bend_bl, 4),
            tail_tip_rad: of(|beat| beat.tail_tip_rad, 5),
            tail_tip_confidence: of(|beat| beat.tail_tip_confidence, 4),
            phase_rad: phase_turns.map(|turns| rounded(turns * std::f64::consts::TAU, 5)),
            phase_confidence: of(|beat| beat.phase_confidence, 4),
            side_confidence: of(|beat| beat.side_confidence, 4),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fish::sample::{SampleFilm, SampleParams};

    #[test]
    fn unmeasured_values_are_null_and_measured_ones_are_written() {
        let film = SampleFilm::new(SampleParams {
            n_frames: 2,
            width: 64,
            height: 64,
            ..SampleParams::default()
        });
        let mut motion = film.expect("in range").motion().clone();
        motion.beats[1] = Some(Beat {
            bend_bl: 0.01,
            tail_tip_rad: -0.2,
            tail_tip_confidence: 0.8,
            phase_turns: Some(0.1),
            phase_confidence: 0.9,
            side_confidence: 0.5,
        });
        let file: serde_json::Value = serde_json::from_slice(&write(&motion)).expect("JSON");
        let frames = file["frames"].as_array().expect("a list");
        assert_eq!(frames.len(), 2);
        assert!(frames[0]["tail_tip_rad"].is_null() && file["beat_hz"].is_null());
        assert_eq!(frames[1]["tail_tip_rad"], -0.2);
        assert_eq!(frames[1]["phase_rad"], 0.62832);
        assert_eq!(frames[1]["side_confidence"], 0.5);
    }
}
