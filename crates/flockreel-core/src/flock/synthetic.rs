//! A synthetic library for tests: an animal of known motion, so that the right jumps are known without a
//! comparison of pixels.

use std::f64::consts::{PI, TAU};
use std::sync::Arc;

use crate::flock::boids::vector::unit;
use crate::geometry::angle::mirrored_rad;
use crate::geometry::wrap_rad;
use crate::library::{
    Jump, Library, LibraryStats, Patch, Playback, Pose, Poses, Sprites, Transition, View,
};
use crate::raster::RgbImage;
use crate::scratch::{Full, InMemory};

/// Length of the animal seen from the side, pixels.
pub(crate) const LENGTH_PX: f64 = 40.0;
const N_FRAMES: u32 = 600;
const CLIP_FRAMES: usize = 8;
/// Period of the tail beat, frames.
const BEAT: u32 = 10;
const SIZE_PX: [u32; 2] = [320, 240];

/// Returns the library of an animal that turns to both sides. In side view its length in the image shrinks as
/// it turns away. Jumps join frames of similar heading and turn rate in the same phase of the tail beat.
pub(crate) fn library(view: View) -> Library {
    let frames = poses(view);
    let scratch = Arc::new(InMemory::default());
    let sprites = Sprites::drawn([56, 56], frames.len(), scratch, |idx, rgba| {
        draw(rgba, &frames[idx], idx as u32);
        Ok::<_, Full>(true)
    });
    let sprites = sprites.expect("memory has room");
    let jumps = jumps(view);
    let first = jumps.iter().map(|jump| jump.to).min().unwrap_or(0);
    let last = jumps.iter().map(|jump| jump.from).max().unwrap_or(0);
    let component: Vec<u32> = (first..=last).collect();
    Library {
        stats: stats(&frames),
        poses: Poses {
            tail_beat: None,
            fps: 30.0,
            image_size_px: SIZE_PX,
            view,
            view_confidence: None,
            other_movers: Vec::new(),
            camera: None,
            animal: None,
            frames,
        },
        background: water(),
        occluders: None,
        sprites,
        shadow: None,
        clip_frames: CLIP_FRAMES,
        epsilon: 1000,
        natural_step: 500,
        transitions: jumps.iter().map(transition).collect(),
        patches: vec![Patch {
            frames: first..last + 1,
            next: vec![0],
        }],
        playback: Playback { jumps, component },
    }
}

/// Returns the side-view library reduced to 24 frames and five jumps, so that plans repeat frames.
pub(crate) fn few_looks() -> Library {
    let mut library = library(View::Side);
    let jump = |from, to, cost, mirrored| Jump {
        from,
        to,
        cost,
        mirrored,
    };
    library.playback = Playback {
        jumps: vec![
            jump(209, 200, 400, false),
            jump(214, 205, 300, true),
            jump(219, 200, 900, false),
            jump(219, 210, 500, false),
            jump(223, 200, 700, true),
        ],
        component: (200..224).collect(),
    };
    library.clip_frames = 2;
    library
}

/// Returns the yaw, radians: 0 = right, pi/2 = away from the viewer (in top view: down).
fn yaw_rad(frame: u32) -> f64 {
    let turn = |period: f64, phase: f64| libm::sin(TAU * f64::from(frame) / period + phase);
    // Mostly left or right, with turns in between.
    PI / 2.0 - PI / 2.0 * libm::tanh(2.5 * turn(173.0, 0.0)) + 0.3 * turn(61.0, 1.0)
}

fn turn_rad(frame: u32) -> f64 {
    yaw_rad(frame + 1) - yaw_rad(frame)
}

fn poses(view: View) -> Vec<Pose> {
    let mut centroid = [160.0, 120.0];
    (0..N_FRAMES)
        .map(|frame| {
            let (cos, sin) = (libm::cos(yaw_rad(frame)), libm::sin(yaw_rad(frame)));
            let pitch = 0.25 * libm::sin(TAU * f64::from(frame) / 71.0);
            let forward = match view {
                View::Top => [cos, sin, 0.0],
                View::Side => unit([cos, pitch, sin]),
            };
            for axis in 0..2 {
                centroid[axis] += 2.0 * forward[axis];
            }
            pose(frame, forward, centroid)
        })
        .collect()
}

fn pose(frame: u32, forward: [f64; 3], centroid_px: [f64; 2]) -> Pose {
    let shown = forward[0].hypot(forward[1]).max(0.35);
    Pose {
        time_s: f64::from(frame) / 30.0,
        centroid_px: Some(centroid_px),
        heading_rad: Some(libm::atan2(forward[1], forward[0])),
        length_px: Some(LENGTH_PX * shown),
        height_px: Some(0.4 * LENGTH_PX),
        forward: Some(forward),
        ..Pose::default()
    }
}

fn jumps(view: View) -> Vec<Jump> {
    let mut jumps = Vec::new();
    for from in 0..N_FRAMES - 2 {
        for to in (1..N_FRAMES - 1).filter(|to| (from + 1) % BEAT == to % BEAT && *to != from + 1) {
            for mirrored in [false, true] {
                let side = if mirrored { -1.0 } else { 1.0 };
                let meant = if mirrored {
                    PI - yaw_rad(to)
                } else {
                    yaw_rad(to)
                };
                let gap = match view {
                    View::Top => 0.0,
                    View::Side => wrap_rad(yaw_rad(from + 1) - meant).abs(),
                };
                let turn_gap = (turn_rad(from + 1) - side * turn_rad(to)).abs();
                if gap < 0.15 && turn_gap < 0.05 {
                    let cost = 300 + (2000.0 * gap + 10_000.0 * turn_gap) as u64;
                    jumps.push(Jump {
                        from,
                        to,
                        cost,
                        mirrored,
                    });
                }
            }
        }
    }
    jumps.sort_unstable();
    jumps
}

fn transition(jump: &Jump) -> Transition {
    Transition {
        from: jump.from,
        to: jump.to,
        mirrored: jump.mirrored,
        distance: jump.cost,
        heading_gap_rad: 0.0,
    }
}

fn stats(frames: &[Pose]) -> LibraryStats {
    LibraryStats {
        n_frames: frames.len(),
        n_detected: frames.len(),
        component_share: 1.0,
        speed_bl_per_s: Some([1.0, 1.5, 2.0]),
        turn_rate_rad_per_s: Some(2.5),
        length_px: Some(LENGTH_PX),
        ..LibraryStats::default()
    }
}

fn water() -> RgbImage {
    let mut image = RgbImage::new(SIZE_PX[0], SIZE_PX[1]);
    for y in 0..SIZE_PX[1] {
        for x in 0..SIZE_PX[0] {
            let shade = (y / 4) as u8;
            image.set_pixel(x, y, [20, 90 - shade / 2, 140 - shade + (x % 7) as u8]);
        }
    }
    image
}

/// Draws a body, a beating tail, and an eye above the center line, which shows mirroring and rotation.
fn draw(rgba: &mut [u8], pose: &Pose, frame: u32) {
    let heading = pose.heading_rad.unwrap_or(0.0);
    let upside_down = libm::cos(heading) < 0.0;
    let (cos, sin) = (libm::cos(heading), libm::sin(heading));
    let half = pose.length_px.unwrap_or(LENGTH_PX) / 2.0;
    let beat = 3.0 * libm::sin(TAU * f64::from(frame) / f64::from(BEAT));
    for (k, pixel) in rgba.chunks_exact_mut(4).enumerate() {
        let (dx, dy) = ((k % 56) as f64 - 27.5, (k / 56) as f64 - 27.5);
        let along = (cos * dx + sin * dy) / half;
        let up = if upside_down { -1.0 } else { 1.0 };
        let across = up * (cos * dy - sin * dx);
        let body = 1.0 - (along / 0.95 - 0.1).powi(2) - (across / 7.0).powi(2);
        let tail_center = beat * (-along - 0.5).max(0.0);
        let tail = (1.0 - ((along + 0.8) / 0.25).powi(2)) - ((across - tail_center) / 6.0).powi(2);
        let alpha = (body.max(tail) * 5.0).clamp(0.0, 1.0);
        let eye = (along - 0.6).powi(2) * half * half + (across + 2.0).powi(2) < 3.0;
        let color = if eye {
            [10, 10, 20]
        } else {
            [240, (130.0 - 4.0 * across).clamp(60.0, 200.0) as u8, 40]
        };
        pixel[..3].copy_from_slice(&color);
        pixel[3] = (255.0 * alpha).round() as u8;
    }
}

#[test]
fn jumps_lead_to_headings_alike() {
    let library = library(View::Side);
    let heading = |frame: u32| library.poses.frames[frame as usize].heading_rad.unwrap();
    assert!(library.playback.jumps.len() > 200);
    for jump in &library.playback.jumps {
        let to = heading(jump.to);
        let meant = if jump.mirrored { mirrored_rad(to) } else { to };
        let end_on = libm::cos(yaw_rad(jump.to)).abs() < 0.7;
        assert!(
            end_on || wrap_rad(heading(jump.from + 1) - meant).abs() < 1.0,
            "{jump:?}"
        );
    }
}
