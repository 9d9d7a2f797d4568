//! A library drawn by code, for tests: an animal of known motion that comes back to the same poses,
//! so that its jumps are known by hand.

use crate::flock::boids::vector::unit;
use crate::geometry::angle::mirrored_rad;
use crate::library::{
    Jump, Library, LibraryStats, Patch, Playback, Pose, Poses, Sprites, Transition, View,
};
use crate::raster::RgbImage;

/// Length of the animal when seen from the side.
pub(crate) const LENGTH_PX: f64 = 40.0;
/// After so many frames it does the same again.
pub(crate) const PERIOD: u32 = 90;
const N_FRAMES: u32 = 3 * PERIOD + 12;
const CLIP_FRAMES: usize = 8;
const SIZE_PX: [u32; 2] = [320, 240];

/// An animal that swims in a circle: seen from above, or from the side with its length shrinking as
/// it turns away.
pub(crate) fn library(view: View) -> Library {
    let mut sprites = Sprites::missing(56, 56, N_FRAMES as usize);
    let frames: Vec<Pose> = (0..N_FRAMES).map(|frame| pose(view, frame)).collect();
    for (idx, pose) in frames.iter().enumerate() {
        draw(sprites.fill(idx), pose, idx as u32);
    }
    let jumps = jumps(view);
    let component: Vec<u32> = (0..N_FRAMES).collect();
    Library {
        stats: stats(&frames),
        poses: Poses {
            fps: 30.0,
            image_size_px: SIZE_PX,
            view,
            camera: None,
            animal: None,
            frames,
        },
        background: water(),
        sprites,
        clip_frames: CLIP_FRAMES,
        epsilon: 1000,
        natural_step: 500,
        transitions: jumps.iter().map(transition).collect(),
        patches: vec![Patch {
            frames: 0..N_FRAMES,
            next: vec![0],
        }],
        playback: Playback { jumps, component },
    }
}

fn phase(frame: u32) -> f64 {
    std::f64::consts::TAU * f64::from(frame) / f64::from(PERIOD)
}

fn pose(view: View, frame: u32) -> Pose {
    let (sin, cos) = (libm::sin(phase(frame)), libm::cos(phase(frame)));
    let forward = match view {
        View::Top => [-sin, cos, 0.0],
        View::Side => unit([-sin, 0.25 * libm::cos(2.0 * phase(frame)), cos]),
    };
    let shown = forward[0].hypot(forward[1]).max(0.35);
    let heading_rad = libm::atan2(forward[1], forward[0]);
    Pose {
        time_s: f64::from(frame) / 30.0,
        centroid_px: Some([160.0 + 100.0 * cos, 120.0 + 70.0 * sin]),
        heading_rad: Some(heading_rad),
        length_px: Some(LENGTH_PX * shown),
        height_px: Some(0.4 * LENGTH_PX),
        forward: Some(forward),
        ..Pose::default()
    }
}

/// The same pose one period off, and in side view the mirrored pose half a period off.
fn jumps(view: View) -> Vec<Jump> {
    let mut jumps = Vec::new();
    for from in (0..N_FRAMES - 1).step_by(5) {
        let cost = 300 + u64::from(from * 37 % 400);
        let ends = [
            (i64::from(from) + 1 - i64::from(PERIOD), false),
            (i64::from(from) + 1 + i64::from(PERIOD), false),
            (i64::from(from) + 1 - i64::from(PERIOD / 2), true),
            (i64::from(from) + 1 + i64::from(PERIOD / 2), true),
        ];
        for (to, mirrored) in ends {
            let inside = (0..i64::from(N_FRAMES)).contains(&to);
            if inside && (view == View::Side || !mirrored) {
                jumps.push(Jump {
                    from,
                    to: to as u32,
                    cost,
                    mirrored,
                });
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

/// A body, a tail that beats, and an eye above the middle line so that mirror and turn can be told.
fn draw(rgba: &mut [u8], pose: &Pose, frame: u32) {
    let heading = pose.heading_rad.unwrap_or(0.0);
    let upside_down = libm::cos(heading) < 0.0;
    let (cos, sin) = (libm::cos(heading), libm::sin(heading));
    let half = pose.length_px.unwrap_or(LENGTH_PX) / 2.0;
    let beat = 3.0 * libm::sin(8.0 * phase(frame));
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
        let color = match eye {
            true => [10, 10, 20],
            false => [240, 130 - (4.0 * across) as i32 as u8, 40],
        };
        pixel[..3].copy_from_slice(&color);
        pixel[3] = (255.0 * alpha).round() as u8;
    }
}

#[test]
fn half_a_period_later_it_heads_the_mirrored_way() {
    let library = library(View::Side);
    let heading = |frame: usize| library.poses.frames[frame].heading_rad.unwrap();
    let gap = heading(20 + PERIOD as usize / 2) - mirrored_rad(heading(20));
    assert!(gap.abs() < 1e-9, "{gap}");
}
