//! How fast transitions are found, and how that grows with the footage (ALGORITHMS.md 5 and 9), for
//! `bench/transitions.py`. Prints one line of JSON.
//!
//! `LIBRARY_DIR`: the library's own sprites; all distances against only those below epsilon, on one thread
//! and on all. `N`: so many sprites drawn by code; the search for transitions from end to end.

use std::path::Path;
use std::sync::Arc;
use std::time::Instant;

use flockreel::analysis::distance::{ComparedSprites, Distances, NOT_BELOW, Side};
use flockreel::analysis::{Params, transition};
use flockreel::cpu::Level;
use flockreel::formats::library_dir;
use flockreel::library::{Library, Pose, Poses, Sprites, View};
use flockreel::progress::Silent;
use flockreel::random;
use flockreel::scratch::{Full, InMemory};
use flockreel::store::Spill;

fn main() {
    let mut arguments = std::env::args().skip(1).filter(|a| a != "--bench");
    match arguments.next() {
        None => println!("arguments: LIBRARY_DIR, or a number of frames"),
        Some(argument) => match argument.parse() {
            Ok(n_frames) => from_end_to_end(n_frames),
            Err(_) => pruned_against_all(Path::new(&argument)),
        },
    }
}

fn pruned_against_all(folder: &Path) {
    let stored = library_dir::read(folder, Arc::new(InMemory::default())).expect("a library");
    let library = stored.library;
    let planes = stored.params.planes;
    let pixels = ComparedSprites::new(&library.sprites, &library.poses, planes);
    let pixels = pixels.expect("memory has room");
    let threads = rayon::current_num_threads();
    let [plain, mirrored] = [Side::Plain, Side::Mirrored].map(|side| {
        let [one, all] = [1, threads].map(|n| times(&library, &pixels, side, n));
        format!(
            "{{\"all_s\":{:.6},\"below_s\":{:.6},\"times_faster\":{:.2},\
             \"two_threads_faster\":{:.2},\"share_below\":{:.5}}}",
            one.0,
            one.1,
            one.0 / one.1,
            one.1 / all.1,
            one.2,
        )
    });
    println!(
        "{{\"frames\":{},\"size\":[{},{}],\"level\":\"{}\",\"plain\":{plain},\"mirrored\":{mirrored}}}",
        library.sprites.n_frames(),
        library.sprites.width(),
        library.sprites.height(),
        Level::detect().name(),
    );
}

/// Seconds for all distances and for those below epsilon, the best of seven; and their share.
fn times(
    library: &Library,
    pixels: &ComparedSprites,
    side: Side,
    n_threads: usize,
) -> (f64, f64, f64) {
    let pool = rayon::ThreadPoolBuilder::new()
        .num_threads(n_threads)
        .build();
    let pool = pool.expect("threads can be made");
    let distances = Distances {
        pixels,
        clip: Params::default().clip(library.clip_frames),
        side,
        cpu: Level::detect(),
    };
    let (mut n_all, mut n_below) = (0, 0);
    let mut best = [f64::INFINITY; 2];
    for _ in 0..7 {
        let start = Instant::now();
        n_all = 0;
        let count = |_: usize, row: &[u64]| n_all += row.len();
        pool.install(|| distances.for_each_row(&Silent, count))
            .expect("nobody cancels");
        best[0] = best[0].min(start.elapsed().as_secs_f64());
        let start = Instant::now();
        n_below = 0;
        let count =
            |_: usize, row: &[u64]| n_below += row.iter().filter(|d| **d != NOT_BELOW).count();
        let below = || distances.for_each_row_below(library.epsilon, &Silent, count);
        pool.install(below).expect("nobody cancels");
        best[1] = best[1].min(start.elapsed().as_secs_f64());
    }
    (best[0], best[1], n_below as f64 / n_all as f64)
}

/// Draws sprites of 96 x 64 and finds their transitions; times only the latter.
fn from_end_to_end(n_frames: usize) {
    let swim = Swim::new(n_frames);
    let scratch = Arc::new(Spill::into(&std::env::temp_dir()));
    let sprites = Sprites::drawn([96, 64], n_frames, scratch, |frame_idx, rgba| {
        swim.draw(frame_idx, rgba);
        Ok::<_, Full>(true)
    });
    let sprites = sprites.expect("the disk has room");
    let poses = swim.poses();
    let start = Instant::now();
    let found = transition::connect(
        &sprites,
        &poses,
        &Params::default(),
        Level::detect(),
        &Silent,
    );
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

/// Most memory that this process ever held, MB; 0 where the system does not say.
fn peak_mb() -> u64 {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let line = status.lines().find_map(|line| line.strip_prefix("VmHWM:"));
    let kb = line.and_then(|rest| rest.trim().trim_end_matches(" kB").parse::<u64>().ok());
    kb.unwrap_or(0) / 1024
}

/// A fish that turns now this way, now that, and beats its tail; seen from the side.
struct Swim {
    /// Per frame: yaw, pitch, phase of the tail beat, radians.
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
        Poses {
            tail_beat: None,
            fps: 30.0,
            image_size_px: [640, 480],
            view: View::Side,
            camera: None,
            animal: None,
            frames: self.moments.iter().map(pose).collect(),
        }
    }

    /// An orange spindle with a dark eye, as long as it is turned, its tail bent; a little noise.
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
