//! Measures the speed of the distance engine, for `bench/distance.py`
//! (docs/explanation/algorithms.md, "Distances" and "Quality measures").
//!
//! Arguments: SPRITES WIDTH HEIGHT CLIP_FRAMES OUT_DIR. Reads raw RGBA sprites from a file and times the
//! engine on one thread and on all. Measures the psadbw peak of this machine in the same run. Writes d and D
//! as .npy files for comparison. Prints one line of JSON.
#![expect(
    unsafe_code,
    reason = "the bare instruction is timed by inline assembly"
)]

mod poses;
mod timing;

use std::path::Path;
use std::sync::Arc;
use std::time::Instant;

use flockreel_core::analysis::Params;
use flockreel_core::analysis::params::Planes;
use flockreel_core::analysis::similarity::distance::{
    ComparedSprites, DistanceMatrix, Distances, Side,
};
use flockreel_core::cpu::Level;
use flockreel_core::formats::npy;
use flockreel_core::library::{Pose, Poses, Sprites};
use flockreel_core::progress::Silent;
use flockreel_core::random;
use flockreel_core::scratch::{Full, InMemory};

fn main() {
    let arguments: Vec<String> = timing::arguments().collect();
    let [path, width, height, clip_frames, out] = &arguments[..] else {
        // `cargo test --benches` runs this program without arguments.
        return println!("arguments: SPRITES WIDTH HEIGHT CLIP_FRAMES OUT_DIR");
    };
    let size = [width, height].map(|text| text.parse().expect("a number of pixels"));
    let clip_frames = clip_frames.parse().expect("a number of frames");
    let (sprites, poses) = read(Path::new(path), size);
    let start = Instant::now();
    let pixels = ComparedSprites::new(&sprites, &poses, Planes::Rgba).expect("memory has room");
    let prepare_s = start.elapsed().as_secs_f64();
    let n_threads = rayon::current_num_threads();
    let one = time(&pixels, clip_frames, 1);
    let all = time(&pixels, clip_frames, n_threads);
    for (name, f) in [("d.npy", 1), ("D.npy", clip_frames)] {
        let matrix =
            DistanceMatrix::compute(&distances(&pixels, f), &Silent).expect("not cancelled");
        let mut file = std::fs::File::create(Path::new(out).join(name)).expect("a file");
        npy::write(&matrix, &mut file).expect("room for the matrix");
    }
    let [busy, peak, share] = share_of_peak(clip_frames);
    let n = sprites.n_frames() as f64;
    let pair_bytes = n * (n + 1.0) / 2.0 * pixels.n_bytes() as f64;
    println!(
        "{{\"level\":\"{}\",\"prepare_s\":{prepare_s:.6},\"one_thread_s\":{one:.6},\
         \"threads\":{n_threads},\"all_threads_s\":{all:.6},\"one_thread_gb_per_s\":{:.3},\
         \"no_blanks_gb_per_s\":{busy:.3},\"psadbw_peak_gb_per_s\":{peak:.3},\"share_of_psadbw_peak\":{share:.3}}}",
        Level::detect().name(),
        pair_bytes / one / 1e9,
    );
}

fn read(path: &Path, [width, height]: [u32; 2]) -> (Sprites, Poses) {
    let bytes = std::fs::read(path).expect("the sprites");
    let n_bytes = (width * height * 4) as usize;
    let n_frames = bytes.len() / n_bytes;
    let scratch = Arc::new(InMemory::default());
    let sprites = Sprites::drawn([width, height], n_frames, scratch, |frame_idx, rgba| {
        rgba.copy_from_slice(&bytes[frame_idx * n_bytes..][..n_bytes]);
        Ok::<_, Full>(true)
    });
    let sprites = sprites.expect("memory has room");
    (sprites, unmeasured(n_frames))
}

/// Returns poses without any measurement.
fn unmeasured(n_frames: usize) -> Poses {
    poses::from_the_side(vec![Pose::default(); n_frames])
}

fn distances(pixels: &ComparedSprites, clip_frames: usize) -> Distances<'_> {
    Distances {
        pixels,
        clip: Params::default().clip(clip_frames),
        side: Side::Plain,
        cpu: Level::detect(),
    }
}

/// Returns medians over fifteen runs on one core: engine speed (GB/s), psadbw peak (GB/s), and their ratio.
///
/// The sprites (1200 of 96 x 64) have no blank bytes, so that all are compared. The peak is measured before
/// and after each run, because other programs slow both.
fn share_of_peak(clip_frames: usize) -> [f64; 3] {
    let (n_frames, size) = (1200, [96, 64]);
    let scratch = Arc::new(InMemory::default());
    let sprites = Sprites::drawn(size, n_frames, scratch, |frame_idx, rgba| {
        for (k, pixel) in rgba.as_chunks_mut::<4>().0.iter_mut().enumerate() {
            let [r, g, b, ..] = random::bits(1, &[frame_idx as u64, k as u64]).to_le_bytes();
            *pixel = [r | 1, g | 1, b | 1, 255];
        }
        Ok::<_, Full>(true)
    });
    let sprites = sprites.expect("memory has room");
    let poses = unmeasured(n_frames);
    let pixels = ComparedSprites::new(&sprites, &poses, Planes::Rgba).expect("memory has room");
    let n = n_frames as f64;
    let pair_bytes = n * (n + 1.0) / 2.0 * pixels.n_bytes() as f64;
    let measure = |_| {
        let ignore = |_: usize, row: &[u64]| {
            std::hint::black_box(row);
        };
        let before = peak_gb_per_s();
        let start = Instant::now();
        let result = distances(&pixels, clip_frames).for_each_row(&Silent, ignore);
        result.expect("not cancelled");
        let busy = pair_bytes / start.elapsed().as_secs_f64() / 1e9;
        let peak = (before + peak_gb_per_s()) / 2.0;
        [busy, peak, busy / peak]
    };
    let runs: Vec<[f64; 3]> = timing::on_threads(1, || (0..15).map(measure).collect());
    std::array::from_fn(|k| {
        let mut each: Vec<f64> = runs.iter().map(|run| run[k]).collect();
        each.sort_by(f64::total_cmp);
        each[each.len() / 2]
    })
}

/// Returns the fastest of fifteen runs, seconds.
fn time(pixels: &ComparedSprites, clip_frames: usize, n_threads: usize) -> f64 {
    let run = || {
        let mut total = 0u64;
        let add = |_: usize, row: &[u64]| total = total.wrapping_add(row.iter().sum());
        let result = distances(pixels, clip_frames).for_each_row(&Silent, add);
        result.expect("not cancelled");
        std::hint::black_box(total);
    };
    timing::on_threads(n_threads, || timing::fastest_s(15, run))
}

/// Returns the peak throughput of psadbw followed by its addition, from registers only, GB/s.
///
/// The vector width is that of the engine. No kernel for sums of absolute differences can be faster. Returns
/// NaN without AVX2.
fn peak_gb_per_s() -> f64 {
    #[cfg(target_arch = "x86_64")]
    if is_x86_feature_detected!("avx2") {
        const ROUNDS: u64 = 20_000_000;
        let start = Instant::now();
        // SAFETY: AVX2 is available, and only declared registers change.
        unsafe { sad_and_add_8(ROUNDS) };
        return (ROUNDS * 8 * 32) as f64 / start.elapsed().as_secs_f64() / 1e9;
    }
    f64::NAN
}

/// Executes eight psadbw of 32 bytes and eight additions, `rounds` times.
#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2")]
unsafe fn sad_and_add_8(rounds: u64) {
    // SAFETY: no memory is accessed, and every changed register is declared.
    unsafe {
        std::arch::asm!(
            "2:",
            "vpsadbw ymm8, ymm12, ymm14", "vpaddq ymm0, ymm0, ymm8",
            "vpsadbw ymm9, ymm13, ymm14", "vpaddq ymm1, ymm1, ymm9",
            "vpsadbw ymm10, ymm12, ymm15", "vpaddq ymm2, ymm2, ymm10",
            "vpsadbw ymm11, ymm13, ymm15", "vpaddq ymm3, ymm3, ymm11",
            "vpsadbw ymm8, ymm12, ymm14", "vpaddq ymm4, ymm4, ymm8",
            "vpsadbw ymm9, ymm13, ymm14", "vpaddq ymm5, ymm5, ymm9",
            "vpsadbw ymm10, ymm12, ymm15", "vpaddq ymm6, ymm6, ymm10",
            "vpsadbw ymm11, ymm13, ymm15", "vpaddq ymm7, ymm7, ymm11",
            "dec {rounds}",
            "jnz 2b",
            rounds = inout(reg) rounds => _,
            out("ymm0") _, out("ymm1") _, out("ymm2") _, out("ymm3") _,
            out("ymm4") _, out("ymm5") _, out("ymm6") _, out("ymm7") _,
            out("ymm8") _, out("ymm9") _, out("ymm10") _, out("ymm11") _,
            out("ymm12") _, out("ymm13") _, out("ymm14") _, out("ymm15") _,
            options(nomem, nostack),
        );
    }
}
