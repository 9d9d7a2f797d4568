//! Measures the time of the search for transitions, for `bench/transitions.py`
//! (docs/explanation/algorithms.md, "Transitions and playback" and "Quality measures").
//!
//! With `LIBRARY_DIR`, uses the sprites of that library. Compares the time for all distances with the time
//! for the transitions below its epsilon, on one thread and on all. With `N`, draws N sprites and times the
//! whole search. Prints one line of JSON.

#[path = "../crates/flockreel-core/benches/poses/mod.rs"]
mod poses;
#[path = "../crates/flockreel-core/benches/timing/mod.rs"]
mod timing;

use std::hint::black_box;
use std::path::Path;
use std::sync::Arc;
use std::time::Instant;

use flockreel::store::Spill;
use flockreel_core::analysis::Params;
use flockreel_core::analysis::similarity::distance::{ComparedSprites, Distances, Side};
use flockreel_core::analysis::similarity::transition;
use flockreel_core::cpu::Level;
use flockreel_core::formats::library_dir;
use flockreel_core::library::{Library, Pose, Poses, Sprites};
use flockreel_core::progress::Silent;
use flockreel_core::random;
use flockreel_core::scratch::{Full, InMemory};

fn main() {
    match timing::arguments().next() {
        None => println!("arguments: LIBRARY_DIR, or a number of frames"),
        Some(argument) => match argument.parse() {
            Ok(n_frames) => time_search(n_frames),
            Err(_) => pruned_against_all(Path::new(&argument)),
        },
    }
}

fn pruned_against_all(folder: &Path) {
    let stored = library_dir::read(folder, Arc::new(InMemory::default())).expect("a library");
    let (library, params) = (stored.library, stored.params);
    let pixels = ComparedSprites::new(&library.sprites, &library.poses, params.planes);
    let pixels = pixels.expect("memory has room");
    let threads = rayon::current_num_threads();
    let found = [1, threads].map(|n| timing::on_threads(n, || times(&library, &params, &pixels)));
    let [one, all] = &found;
    let side = |k: usize| {
        format!(
            "{{\"all_s\":{:.6},\"search_s\":{:.6},\"times_faster\":{:.2},\"two_threads_faster\":{:.2}}}",
            one.all_s[k],
            one.search_s[k],
            one.all_s[k] / one.search_s[k],
            one.search_s[k] / all.search_s[k],
        )
    };
    println!(
        "{{\"frames\":{},\"size\":[{},{}],\"level\":\"{}\",\"candidates\":{},\"transitions\":{},\
         \"plain\":{},\"both_sides\":{}}}",
        library.sprites.n_frames(),
        library.sprites.width(),
        library.sprites.height(),
        Level::detect().name(),
        one.n_candidates,
        one.n_transitions,
        side(0),
        side(1),
    );
}

/// Times in seconds, unmirrored only and with both sides.
#[derive(Default)]
struct Times {
    /// Time for all distances.
    all_s: [f64; 2],
    /// Time for the transitions, from the natural steps to the playback graph.
    search_s: [f64; 2],
    n_candidates: u64,
    n_transitions: usize,
}

/// Returns the fastest of seven runs each.
fn times(library: &Library, params: &Params, pixels: &ComparedSprites) -> Times {
    let mut times = Times::default();
    for (k, sides) in [&[Side::Plain][..], &[Side::Plain, Side::Mirrored]]
        .into_iter()
        .enumerate()
    {
        let distances = |side| Distances {
            pixels,
            clip: params.clip(library.clip_frames),
            side,
            cpu: Level::detect(),
        };
        times.all_s[k] = timing::fastest_s(7, || {
            for &side in sides {
                let ignore = |_: usize, row: &[u64]| {
                    black_box(row);
                };
                let result = distances(side).for_each_row(&Silent, ignore);
                result.expect("nobody cancels");
            }
        });
        // With a fixed epsilon, one search runs, whatever kappa the library used.
        let params = Params {
            epsilon: Some(library.epsilon),
            mirror: k == 1,
            ..params.clone()
        };
        times.search_s[k] = timing::fastest_s(7, || {
            let (sprites, poses, cpu) = (&library.sprites, &library.poses, Level::detect());
            let found = transition::connect_compared(pixels, sprites, poses, &params, cpu, &Silent);
            let found = found.expect("nobody cancels");
            times.n_candidates = found.n_candidates;
            times.n_transitions = found.transitions.len();
        });
    }
    times
}

/// Draws sprites of 96 x 64 pixels and times the search for their transitions only.
fn time_search(n_frames: usize) {
    let swim = Swim::new(n_frames);
    let scratch = Arc::new(Spill::into(&std::env::temp_dir()));
    let sprites = Sprites::drawn([96, 64], n_frames, scratch, |frame_idx, rgba| {
        swim.draw(frame_idx, rgba);
        Ok::<_, Full>(true)
    });
    let sprites = sprites.expect("the disk has room");
    let poses = swim.poses();
    let params = Params::default();
    let start = Instant::now();
    let found = transition::connect(&sprites, &poses, &params, Level::detect(), &Silent);
    let found = found.expect("nobody cancels");
    println!(
        "{{\"frames\":{n_frames},\"seconds\":{:.3},\"peak_mb\":{},\"candidates\":{},\
         \"transitions\":{},\"component_share\":{:.3}}}",
        start.elapsed().as_secs_f64(),
        peak_mb(),
        found.n_candidates,
        found.transitions.len(),
        found.component_share,
    );
}

/// Returns the peak memory of this process, MB; 0 where the system does not report it.
fn peak_mb() -> u64 {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let line = status.lines().find_map(|line| line.strip_prefix("VmHWM:"));
    let kb = line.and_then(|rest| rest.trim().trim_end_matches(" kB").parse::<u64>().ok());
    kb.unwrap_or(0) / 1024
}

/// A fish in side view that turns to and fro and beats its tail.
struct Swim {
    /// Yaw, pitch and phase of the tail beat per frame, radians.
    moments: Vec<[f64; 3]>,
}

impl Swim {
    fn new(n_frames: usize) -> Swim {
        let (mut rate, mut now) = ([0.0; 2], [0.0, 0.0, 0.0f64]);
        let step = |frame_idx: usize| {
            let kick = |c: u64| random::normal(3, &[frame_idx as u64, c]);
            rate[0] += -0.05 * rate[0] + 0.006 * kick(0);
            rate[1] += -0.05 * rate[1] - 0.002 * now[1] + 0.002 * kick(1);
            now = [
                now[0] + rate[0],
                now[1] + rate[1],
                now[2] + 0.5 + 0.1 * kick(2),
            ];
            now
        };
        Swim {
            moments: (0..n_frames).map(step).collect(),
        }
    }

    fn poses(&self) -> Poses {
        let pose = |&[yaw, pitch, _]: &[f64; 3]| Pose {
            heading_rad: Some(libm::atan2(libm::sin(pitch), libm::cos(yaw))),
            ..Pose::default()
        };
        poses::from_the_side(self.moments.iter().map(pose).collect())
    }

    /// Draws an orange spindle with a dark eye, foreshortened by the yaw, with a bent tail and a little
    /// noise.
    fn draw(&self, frame_idx: usize, rgba: &mut [u8]) {
        let [yaw, pitch, phase] = self.moments[frame_idx];
        let (along, away) = (libm::cos(yaw), libm::sin(yaw));
        let (half_length, half_height) = (10.0 + 32.0 * along.abs(), 15.0 + 2.0 * away);
        let toward = along.signum();
        for (k, pixel) in rgba.as_chunks_mut::<4>().0.iter_mut().enumerate() {
            let (x, y) = ((k % 96) as f64 - 47.5, (k / 96) as f64 - 31.5);
            let ahead = toward * x / half_length;
            let bend = 5.0 * libm::sin(phase + 2.0 * ahead) * (1.0 - ahead) * away.abs();
            let across = (y - bend - x * toward * pitch) / (half_height * (1.1 + 0.4 * ahead));
            let inside = 1.0 - ahead * ahead - across * across;
            let alpha = (inside * 900.0).clamp(0.0, 255.0) as u8;
            if alpha == 0 {
                continue;
            }
            let eye = (ahead - 0.7).powi(2) + (across + 0.2).powi(2) < 0.012;
            let noise = (random::bits(4, &[frame_idx as u64, k as u64]) % 7) as f64 - 3.0;
            let shade = if eye {
                20.0
            } else {
                110.0 + 120.0 * inside - 40.0 * across
            };
            let color = |tint: f64| (shade * tint + noise).clamp(0.0, 255.0) as u8;
            *pixel = [color(1.0), color(0.6), color(0.3), alpha];
        }
    }
}
