//! Tests of D against a pixel-by-pixel definition, at every instruction level of this machine.

use std::sync::Arc;

use proptest::prelude::*;

use super::*;
use crate::analysis::params::{ClipWeights, Planes};
use crate::library::{Pose, Poses, Sprites, View};
use crate::progress::Silent;
use crate::random;
use crate::scratch::{Full, InMemory};

/// Returns sprites of random bytes, alpha included.
fn noise(width: u32, height: u32, n_frames: usize, seed: u64) -> Sprites {
    drawn([width, height], n_frames, |frame_idx, rgba| {
        for (k, byte) in rgba.iter_mut().enumerate() {
            *byte = random::bits(seed, &[frame_idx as u64, k as u64]) as u8;
        }
    })
}

/// Returns drawn sprites, one per frame.
pub(crate) fn drawn(
    size: [u32; 2],
    n_frames: usize,
    draw: impl Fn(usize, &mut [u8]) + Sync,
) -> Sprites {
    let scratch = Arc::new(InMemory::default());
    let sprites = Sprites::drawn(size, n_frames, scratch, |frame_idx, rgba| {
        draw(frame_idx, rgba);
        Ok::<_, Full>(true)
    });
    sprites.expect("memory has room")
}

fn uniform(frames: usize) -> Clip {
    let weights = ClipWeights::Uniform;
    Clip { frames, weights }
}

fn compared(sprites: &Sprites, poses: &Poses, planes: Planes) -> ComparedSprites {
    ComparedSprites::new(sprites, poses, planes).expect("memory has room")
}

fn poses(view: View, headings_rad: impl IntoIterator<Item = Option<f64>>) -> Poses {
    let frames = headings_rad.into_iter().map(|heading_rad| Pose {
        heading_rad,
        ..Pose::default()
    });
    Poses {
        tail_beat: None,
        fps: 30.0,
        image_size_px: [640, 480],
        view,
        view_confidence: None,
        other_movers: Vec::new(),
        camera: None,
        animal: None,
        frames: frames.collect(),
    }
}

fn side_poses(sprites: &Sprites) -> Poses {
    poses(View::Side, vec![Some(0.0); sprites.n_frames()])
}

/// Returns D for f = 1 of sprites of `n_pixels` opaque gray pixels in a row, with one gray level per frame.
pub(crate) fn matrix_of_gray_levels(levels: &[u8], n_pixels: u32) -> DistanceMatrix {
    let sprites = drawn([n_pixels, 1], levels.len(), |frame_idx, rgba| {
        let level = levels[frame_idx];
        rgba.as_chunks_mut::<4>().0.fill([level, level, level, 255]);
    });
    let distances = Distances {
        pixels: &compared(&sprites, &side_poses(&sprites), Planes::Rgba),
        clip: uniform(1),
        side: Side::Plain,
        cpu: Level::detect(),
    };
    DistanceMatrix::compute(&distances, &Silent).expect("nobody cancels")
}

/// Returns the upper triangle as the engine computes it.
fn triangle(sprites: &Sprites, poses: &Poses, f: usize, side: Side, cpu: Level) -> Vec<Vec<u64>> {
    triangle_of(
        &compared(sprites, poses, Planes::Rgba),
        uniform(f),
        side,
        cpu,
    )
}

fn triangle_of(pixels: &ComparedSprites, clip: Clip, side: Side, cpu: Level) -> Vec<Vec<u64>> {
    let distances = Distances {
        pixels,
        clip,
        side,
        cpu,
    };
    let mut rows = Vec::new();
    distances
        .for_each_row(&Silent, |i, row| {
            assert_eq!(i, rows.len(), "rows come in order");
            rows.push(row.to_vec());
        })
        .expect("nobody cancels");
    rows
}

/// Returns U(n, m, p) of one frame, from the definition.
fn u(sprites: &Sprites, frame: usize, n: usize, m: usize, p: usize) -> i64 {
    let at = (m * sprites.width() as usize + n) * 4;
    let pixel = &sprites.sprite(frame)[at..at + 4];
    let (a, c) = (i64::from(pixel[3]), i64::from(pixel[p]));
    if p == 3 { a } else { (a * c + 127) / 255 }
}

fn triangle_by_definition(sprites: &Sprites, f: usize, side: Side) -> Vec<Vec<u64>> {
    let (w, h) = (sprites.width() as usize, sprites.height() as usize);
    let d = |i: usize, j: usize| -> u64 {
        let mut sum = 0;
        for m in 0..h {
            for n in 0..w {
                let n_of_j = match side {
                    Side::Plain => n,
                    Side::Mirrored => w - 1 - n,
                };
                for p in 0..4 {
                    let difference = u(sprites, i, n, m, p) - u(sprites, j, n_of_j, m, p);
                    sum += difference.unsigned_abs();
                }
            }
        }
        sum
    };
    let n_clips = (sprites.n_frames() + 1).saturating_sub(f);
    let window = |i: usize, j: usize| (0..f).map(|k| d(i + k, j + k)).sum();
    (0..n_clips)
        .map(|i| (i..n_clips).map(|j| window(i, j)).collect())
        .collect()
}

#[test]
fn every_level_equals_the_definition_at_tile_edges() {
    // Sizes around groups of 48, lines of 64 bytes and blocks of 1 KB; clips longer than the footage.
    for (w, h, n_frames, f) in [
        (1, 1, 1, 1),
        (3, 5, 47, 2),
        (8, 2, 48, 48),
        (16, 16, 49, 3),
        (17, 16, 50, 8),
        (5, 3, 7, 8),
        (2, 1, 100, 60),
    ] {
        let sprites = noise(w, h, n_frames, 1);
        for side in [Side::Plain, Side::Mirrored] {
            let wanted = triangle_by_definition(&sprites, f, side);
            for cpu in Level::available() {
                let found = triangle(&sprites, &side_poses(&sprites), f, side, cpu);
                assert!(
                    found == wanted,
                    "{w}x{h}, {n_frames} frames, {side:?}, {cpu:?}"
                );
            }
        }
    }
}

#[test]
fn the_largest_possible_differences_do_not_overflow() {
    let draw = |frame_idx, rgba: &mut [u8]| rgba.fill(255 * frame_idx as u8);
    let sprites = drawn([64, 64], 2, draw);
    for cpu in Level::available() {
        let found = triangle(&sprites, &side_poses(&sprites), 1, Side::Plain, cpu);
        assert_eq!(found, [vec![0, 64 * 64 * 4 * 255], vec![0]]);
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(24))]

    #[test]
    fn every_level_equals_scalar(
        (w, h, n_frames, f) in (1u32..40, 1u32..20, 1usize..120, 1usize..12),
        seed: u64,
        mirrored: bool,
    ) {
        let sprites = noise(w, h, n_frames, seed);
        let side = if mirrored { Side::Mirrored } else { Side::Plain };
        let scalar = triangle(&sprites, &side_poses(&sprites), f, side, Level::Scalar);
        for cpu in Level::available() {
            let found = triangle(&sprites, &side_poses(&sprites), f, side, cpu);
            prop_assert!(found == scalar, "{cpu:?}");
        }
    }
}

#[test]
fn one_thread_and_two_give_the_same() {
    let sprites = noise(24, 16, 130, 2);
    let with_threads = |n| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(n).build();
        pool.expect("threads can be made").install(|| {
            let poses = side_poses(&sprites);
            triangle(&sprites, &poses, 8, Side::Mirrored, Level::detect())
        })
    };
    assert_eq!(with_threads(1), with_threads(2));
}

#[test]
fn spilled_blocks_are_compared_as_those_in_memory() {
    // Five groups, so two panels. Every other sprite is partly blank.
    let sprites = drawn([40, 24], 200, |frame_idx, rgba| {
        let n = if frame_idx % 2 == 0 { 2000 } else { 3840 };
        for (k, byte) in rgba[..n].iter_mut().enumerate() {
            *byte = random::bits(5, &[frame_idx as u64, k as u64]) as u8;
        }
    });
    let poses = side_poses(&sprites);
    let spilled = ComparedSprites::with_memory(0, &sprites, &poses, Planes::Rgba);
    let spilled = spilled.expect("memory has room");
    assert_eq!(
        spilled.steps(Level::detect()),
        compared(&sprites, &poses, Planes::Rgba).steps(Level::detect())
    );
    for side in [Side::Plain, Side::Mirrored] {
        let held = triangle(&sprites, &poses, 3, side, Level::detect());
        assert!(
            triangle_of(&spilled, uniform(3), side, Level::detect()) == held,
            "{side:?}"
        );
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(48))]

    /// Moving soft spots. Some pairs are similar, some are not.
    #[test]
    fn pruned_distances_are_all_those_below_the_limit(
        (w, h, n_frames, f) in (1u32..40, 1u32..40, 1usize..220, 1usize..6),
        (seed, percent) in (any::<u64>(), 0usize..=110),
        from_above: bool,
        binomial: bool,
    ) {
        let weights = if binomial { ClipWeights::Binomial } else { ClipWeights::Uniform };
        let clip = Clip { frames: f, weights };
        let sprites = drawn([w, h], n_frames, |frame_idx, rgba| {
            let at = |c: u64| (random::bits(seed, &[frame_idx as u64 / 9, c]) % 40) as f64;
            for (k, pixel) in rgba.as_chunks_mut::<4>().0.iter_mut().enumerate() {
                let (x, y) = ((k % w as usize) as f64 - at(0), (k / w as usize) as f64 - at(1));
                let light = 255.0 * libm::exp(-(x * x + y * y) / 90.0);
                *pixel = [light as u8, 255 - light as u8, (frame_idx % 9 * 3) as u8, light as u8];
            }
        });
        let poses = if from_above {
            poses(View::Top, (0..n_frames).map(|k| Some(k as f64 * 0.7)))
        } else {
            side_poses(&sprites)
        };
        let pixels = compared(&sprites, &poses, Planes::Rgba);
        for side in [Side::Plain, Side::Mirrored] {
            let whole = triangle_of(&pixels, clip, side, Level::detect());
            let mut all: Vec<u64> = whole.iter().flatten().copied().collect();
            all.sort_unstable();
            // The limit ranges from nothing to everything.
            let limit = all.get(all.len() * percent / 100).copied().unwrap_or(u64::MAX);
            for cpu in [Level::Scalar, Level::detect()] {
                let distances = Distances { pixels: &pixels, clip, side, cpu };
                let mut rows = Vec::new();
                let push = |_: usize, row: &[ClipPair]| rows.push(row.to_vec());
                distances.for_each_row_below(limit, &AllPairs, &Silent, push).expect("nobody cancels");
                let below = |(from, row): (usize, &Vec<u64>)| -> Vec<ClipPair> {
                    let pair = |(to, &distance)| ClipPair { from, to, distance };
                    (from..).zip(row).map(pair).filter(|pair| pair.distance < limit).collect()
                };
                let wanted: Vec<Vec<ClipPair>> = whole.iter().enumerate().map(below).collect();
                prop_assert!(rows == wanted, "{:?} {:?} {}", side, cpu, limit);
            }
        }
    }
}

#[test]
fn rgb_planes_leave_alpha_out() {
    let colors = [[0, 0, 0, 255], [200, 0, 0, 51]];
    let sprites = drawn([1, 1], 2, |frame_idx, rgba| {
        rgba.copy_from_slice(&colors[frame_idx])
    });
    let poses = side_poses(&sprites);
    let d = |planes| compared(&sprites, &poses, planes).steps(Level::detect());
    assert_eq!(d(Planes::Rgb), [40]);
    assert_eq!(d(Planes::Rgba), [40 + 204]);
}

/// Returns a letter L around the center of an 8 x 8 sprite, rotated by quarter turns.
///
/// The long arm points along the heading. The short arm points to the left or right of it, by its sign.
fn letter_l(quarter_turns: u32, short_arm: i32) -> (Sprites, Option<f64>) {
    let mut bytes = [0; 256];
    for (x, y, red) in [(1, 1, 9), (3, 1, 90), (5, 1, 200), (1, 3 * short_arm, 50)] {
        // Pixel centers are at odd half pixels from the center. A quarter turn maps (x, y) to (-y, x).
        let (mut x, mut y) = (x, y);
        for _ in 0..quarter_turns {
            (x, y) = (-y, x);
        }
        let at = (((y + 7) / 2) * 8 + (x + 7) / 2) as usize * 4;
        bytes[at..at + 4].copy_from_slice(&[red, 255 - red, 30, 255]);
    }
    let heading_rad = f64::from(quarter_turns) * 0.5 * std::f64::consts::PI;
    let sprites = drawn([8, 8], 1, |_, rgba| rgba.copy_from_slice(&bytes));
    (sprites, Some(heading_rad))
}

fn top_view(letters: &[(Sprites, Option<f64>)]) -> (Sprites, Poses) {
    let sprites = drawn([8, 8], letters.len(), |frame_idx, rgba| {
        rgba.copy_from_slice(&letters[frame_idx].0.sprite(0));
    });
    let headings = letters.iter().map(|(_, heading_rad)| *heading_rad);
    let poses = poses(View::Top, headings.collect::<Vec<_>>());
    (sprites, poses)
}

#[test]
fn in_top_view_the_heading_does_not_change_the_distance() {
    let (sprites, poses) = top_view(&[
        letter_l(0, 1),
        letter_l(1, 1),
        letter_l(2, 1),
        letter_l(3, 1),
    ]);
    for row in triangle(&sprites, &poses, 1, Side::Plain, Level::Scalar) {
        assert!(row.iter().all(|&distance| distance == 0), "{row:?}");
    }
}

#[test]
fn in_top_view_sprites_are_mirrored_across_the_body_axis() {
    // Pixel centers are at odd half pixels, so the mirror image of y = 1 is y = -1.
    let (image, heading_rad) = letter_l(0, 1);
    let rows = image.sprite(0);
    let mirror_image = drawn([8, 8], 1, |_, rgba| {
        for (y, row) in rows.chunks_exact(32).enumerate() {
            rgba[(7 - y) * 32..][..32].copy_from_slice(row);
        }
    });
    let (sprites, poses) = top_view(&[letter_l(3, 1), (mirror_image, heading_rad)]);
    assert_eq!(
        triangle(&sprites, &poses, 1, Side::Mirrored, Level::Scalar)[0][1],
        0
    );
    assert_ne!(
        triangle(&sprites, &poses, 1, Side::Plain, Level::Scalar)[0][1],
        0
    );
}

#[test]
fn cancelling_stops_at_the_next_panel() {
    struct Impatient;
    impl Progress for Impatient {
        fn report(&self, _: &'static str, _: f64) {}
        fn cancelled(&self) -> bool {
            true
        }
    }
    let sprites = noise(8, 8, 5, 3);
    let distances = Distances {
        pixels: &compared(&sprites, &side_poses(&sprites), Planes::Rgba),
        clip: uniform(1),
        side: Side::Plain,
        cpu: Level::Scalar,
    };
    assert_eq!(
        distances.for_each_row(&Impatient, |_, _| ()),
        Err(Cancelled)
    );
}

#[test]
fn the_matrix_is_symmetric() {
    let matrix = matrix_of_gray_levels(&[10, 13, 11, 30], 2);
    for (i, a) in [10u64, 13, 11, 30].into_iter().enumerate() {
        for (j, b) in [10u64, 13, 11, 30].into_iter().enumerate() {
            assert_eq!(matrix.distance(i, j), 6 * a.abs_diff(b));
        }
    }
    assert_eq!(matrix.max(), 120);
}
