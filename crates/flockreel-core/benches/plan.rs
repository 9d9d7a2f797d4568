//! Measures the time of planning, for `bench/plan.py` (docs/explanation/algorithms.md, "Planning" and
//! "Quality measures").
//!
//! Arguments: COUNT FRAMES RUNS [--one-side] [--of=N] [LIBRARY_DIR]. `--one-side` disables mirroring. Without
//! a folder the benchmark generates a library of N frames, by default 1200. It has about five jumps per three
//! frames, half of them mirrored. The boids are simulated once. Only the planning is timed, on one thread and
//! on all. Prints one line of JSON.

mod poses;
mod timing;

use std::path::Path;
use std::sync::Arc;

use flockreel_core::cpu::Level;
use flockreel_core::flock::lens::Lens;
use flockreel_core::flock::motion::motion_of;
use flockreel_core::flock::plan::{Model, Planner};
use flockreel_core::flock::{BoidTrack, Params, Stats, plan_flock};
use flockreel_core::formats::library_dir;
use flockreel_core::library::{Jump, Library, LibraryStats, Playback, Pose, Sprites};
use flockreel_core::progress::Silent;
use flockreel_core::random::uniform;
use flockreel_core::raster::RgbImage;
use flockreel_core::scratch::InMemory;

fn main() {
    let (flags, arguments): (Vec<String>, Vec<String>) =
        timing::arguments().partition(|a| a.starts_with("--"));
    let n_frames = flags.iter().find_map(|flag| flag.strip_prefix("--of="));
    let n_frames = n_frames.map_or(1200, |n| n.parse().expect("a number"));
    let mirror = !flags.iter().any(|flag| flag == "--one-side");
    let [count, frames, runs, folder @ ..] = &arguments[..] else {
        // `cargo test --benches` runs this program without arguments.
        return println!("arguments: COUNT FRAMES RUNS [--one-side] [--of=N] [LIBRARY_DIR]");
    };
    let number = |text: &String| text.parse().expect("a number");
    let library = match folder.first() {
        Some(folder) => {
            library_dir::read(Path::new(folder), Arc::new(InMemory::default()))
                .expect("a library")
                .library
        }
        None => synthetic_library(n_frames),
    };
    let params = Params {
        count: Some(number(count)),
        frames: number(frames),
        mirror,
        ..Params::default()
    };
    let flock = plan_flock(&library, &params, &Silent).expect("a good library");
    let boids: Vec<BoidTrack> = flock.individuals.iter().map(|i| i.boid.clone()).collect();
    let n_threads = rayon::current_num_threads();
    let one = time(&library, &boids, &params, 1, number(runs));
    let all = time(&library, &boids, &params, n_threads, number(runs));
    let Stats {
        jumps_per_100_frames,
        clone_share,
        ..
    } = flock.stats;
    let n_sides = 1 + usize::from(mirror);
    println!(
        "{{\"count\":{count},\"frames\":{frames},\"states\":{},\"jumps\":{},\"level\":\"{}\",\
         \"one_thread_s\":{one:.6},\"threads\":{n_threads},\"all_threads_s\":{all:.6},\
         \"jumps_per_100_frames\":{jumps_per_100_frames},\"clone_share\":{clone_share}}}",
        n_sides * library.playback.component.len(),
        n_sides * library.playback.jumps.len(),
        Level::detect().name(),
    );
}

/// Returns the time of the fastest run, seconds.
fn time(
    library: &Library,
    boids: &[BoidTrack],
    params: &Params,
    n_threads: usize,
    n_runs: u32,
) -> f64 {
    let motion = motion_of(library, &Lens::new(library, params));
    let run = || {
        let model = Model::new(library, &motion, params);
        let plans = Planner::new(&model, boids).plan(&Silent);
        std::hint::black_box(plans.expect("plans"));
    };
    timing::on_threads(n_threads, || timing::fastest_s(n_runs.max(1), run))
}

const LENGTH_PX: f64 = 80.0;
const EPSILON: u64 = 1000;

/// Returns a library of an animal that swims to and fro and can jump between moments of similar heading.
fn synthetic_library(n_frames: u32) -> Library {
    let wave = |frame: u32, period: f64| (f64::from(frame) / period).sin();
    let heading = |frame: u32| {
        let side = if wave(frame, 29.0) > 0.0 {
            0.0
        } else {
            std::f64::consts::PI
        };
        side + 0.5 * wave(frame, 11.0) + 0.3 * wave(frame, 47.0)
    };
    let mut centroid_px = [320.0, 240.0];
    let frames = (0..n_frames)
        .map(|frame| {
            centroid_px[0] += 3.0 * heading(frame).cos();
            centroid_px[1] += 3.0 * heading(frame).sin();
            Pose {
                time_s: f64::from(frame) / 30.0,
                centroid_px: Some(centroid_px),
                heading_rad: Some(heading(frame)),
                length_px: Some(LENGTH_PX),
                height_px: Some(0.4 * LENGTH_PX),
                ..Pose::default()
            }
        })
        .collect();
    let jumps = synthetic_jumps(n_frames, heading);
    Library {
        poses: poses::from_the_side(frames),
        background: RgbImage::new(640, 480),
        occluders: None,
        sprites: Sprites::missing(96, 64, n_frames as usize),
        shadow: None,
        clip_frames: 8,
        epsilon: EPSILON,
        natural_step: EPSILON / 2,
        transitions: Vec::new(),
        patches: Vec::new(),
        playback: Playback {
            component: (0..n_frames).collect(),
            jumps,
        },
        stats: LibraryStats {
            n_frames: n_frames as usize,
            n_detected: n_frames as usize,
            component_share: 1.0,
            speed_bl_per_s: Some([0.5, 1.1, 2.0]),
            turn_rate_rad_per_s: Some(2.0),
            length_px: Some(LENGTH_PX),
            ..LibraryStats::default()
        },
    }
}

fn synthetic_jumps(n_frames: u32, heading: impl Fn(u32) -> f64) -> Vec<Jump> {
    let frame = |draw: u64, which: u64| (uniform(5, &[which, draw]) * f64::from(n_frames)) as u32;
    let jump = |draw: u64| {
        let (from, to) = (frame(draw, 1), frame(draw, 2));
        let mirrored = uniform(5, &[3, draw]) < 0.5;
        let shown = if mirrored {
            std::f64::consts::PI - heading(to)
        } else {
            heading(to)
        };
        let is_similar = (heading(from) - shown).cos() > 0.97 && from.abs_diff(to) > 15;
        let cost = 500 + (uniform(5, &[4, draw]) * 499.0) as u64;
        is_similar.then_some(Jump {
            from,
            to,
            cost,
            mirrored,
        })
    };
    let n_jumps = n_frames as usize * 5 / 3;
    let mut jumps: Vec<Jump> = (0..).filter_map(jump).take(n_jumps).collect();
    jumps.sort_unstable();
    jumps.dedup_by_key(|jump| (jump.from, jump.to, jump.mirrored));
    jumps
}
