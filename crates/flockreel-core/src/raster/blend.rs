//! Cross-fade of two placed sprites into one, at a jump (docs/explanation/algorithms.md, "Compositing"). It
//! works on premultiplied colors in encoded sRGB, the values from which mattes are cut.

use super::resample::{Quad, Resampled, scaled};
use crate::cpu::Level;
use crate::geometry::Rect;

/// Blends `weight` (0..=1) of `second` with the rest of `main`, and stores the result in `main`. The box of
/// `main` grows to contain both. `buffer` is overwritten. This machine must support the instructions of `cpu`.
pub fn cross_fade(
    main: &mut Resampled,
    second: &Resampled,
    weight: f64,
    buffer: &mut Resampled,
    cpu: Level,
) {
    buffer.begin(main.rect.union(&second.rect));
    buffer.runs.extend(main.runs.iter().chain(&second.runs));
    merge_touching(&mut buffer.runs);
    clear_runs(buffer);
    let share = (weight * 32767.0).round() as i16;
    add_weighted(buffer, main, 32767 - share, cpu);
    add_weighted(buffer, second, share, cpu);
    std::mem::swap(main, buffer);
}

/// Merges runs that touch.
fn merge_touching(runs: &mut Vec<[u32; 3]>) {
    runs.sort_unstable();
    runs.dedup_by(|next, run| {
        let is_touching = next[0] == run[0] && next[1] <= run[2];
        if is_touching {
            run[2] = run[2].max(next[2]);
        }
        is_touching
    });
}

/// Clears the pixels in the runs of a layer.
fn clear_runs(layer: &mut Resampled) {
    let Rect { x, y, w, .. } = layer.rect;
    for &[row, from, to] in &layer.runs {
        let first = ((row - y) * w + from - x) as usize;
        layer.pixels[first..first + (to - from) as usize].fill([0; 4]);
    }
}

/// Replaces the share `1 - share` of a layer's color by the opaque color `color`. Alpha is unchanged. `share`
/// is in 0..=1.
pub fn haze(layer: &mut Resampled, share: f64, color: Quad) {
    let kept = (share * 32767.0).round() as i16;
    let area = layer.rect.area() as usize;
    for pixel in &mut layer.pixels[..area] {
        let alpha = pixel[3];
        for channel in 0..3 {
            // Doubled, because colors range to 16384 and weights to 32768.
            let whole = (2 * i32::from(color[channel])).min(32767) as i16;
            let veil = scaled(scaled(alpha, whole), 32767 - kept);
            pixel[channel] = (scaled(pixel[channel], kept) + veil).min(alpha);
        }
    }
}

/// Adds a layer, with its colors and alpha multiplied by `weight`/32768.
fn add_weighted(sum: &mut Resampled, layer: &Resampled, weight: i16, cpu: Level) {
    let rect = sum.rect;
    for ([x, y], row) in layer.shown() {
        let first = ((y - rect.y) * rect.w + x - rect.x) as usize;
        let out = &mut sum.pixels[first..first + row.len()];
        match cpu {
            #[cfg(target_arch = "x86_64")]
            Level::Avx2 | Level::Avx512 if is_x86_feature_detected!("avx2") => {
                #[expect(unsafe_code, reason = "the same code, compiled for AVX2")]
                // SAFETY: the match guard checked AVX2, the only feature that the callee requires.
                unsafe {
                    add_row_avx2(out, row, weight);
                }
            }
            _ => add_row(out, row, weight),
        }
    }
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2")]
fn add_row_avx2(out: &mut [Quad], row: &[Quad], weight: i16) {
    add_row(out, row, weight);
}

#[inline(always)]
fn add_row(out: &mut [Quad], row: &[Quad], weight: i16) {
    let (out, row) = (out.as_flattened_mut(), row.as_flattened());
    for (out, &value) in out.iter_mut().zip(row) {
        *out += scaled(value, weight);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn fade_of_a_layer_into_itself_changes_nothing() {
        let rect = Rect::new(3, 2, 4, 3);
        let mut main = Resampled::uniform(rect, [6400, 3201, 1603, 8192]);
        let before = main.clone();
        cross_fade(
            &mut main,
            &before,
            0.25,
            &mut Resampled::default(),
            Level::detect(),
        );
        assert_eq!(main.rect, before.rect);
        for (a, b) in main
            .pixels
            .iter()
            .flatten()
            .zip(before.pixels.iter().flatten())
        {
            assert!(a.abs_diff(*b) <= 1, "{a} {b}");
        }
    }

    #[test]
    fn haze_replaces_color_and_keeps_alpha() {
        let white = [16384; 4];
        let half = [8192, 4096, 0, 8192];
        for (share, want) in [
            (1.0, half),
            (0.0, [8192; 4]),
            (0.5, [8192, 6144, 4096, 8192]),
        ] {
            let mut found = Resampled::uniform(Rect::of_size(1, 1), half);
            haze(&mut found, share, white);
            for (a, b) in found.pixels[0].iter().zip(want) {
                assert!(a.abs_diff(b) <= 2, "{share}: {:?}", found.pixels);
            }
        }
    }

    #[test]
    fn fade_between_separate_boxes_contains_both() {
        let at = |x| Rect::new(x, 0, 1, 1);
        let mut main = Resampled::uniform(at(0), [8000, 0, 0, 16384]);
        let second = Resampled::uniform(at(2), [0, 8000, 0, 16384]);
        cross_fade(
            &mut main,
            &second,
            0.25,
            &mut Resampled::default(),
            Level::Scalar,
        );
        assert_eq!(
            main.pixels,
            [[6000, 0, 0, 12288], [0; 4], [0, 2000, 0, 4096]]
        );
    }

    #[test]
    fn old_pixels_of_the_buffer_are_not_visible() {
        let rect = Rect::of_size(4, 2);
        let half = Resampled {
            rect,
            pixels: vec![[4000; 4]; 8],
            runs: vec![[0, 0, 2], [1, 3, 4]],
        };
        let other = Resampled {
            runs: vec![[0, 1, 3]],
            ..half.clone()
        };
        let (mut main, mut buffer) = (half, Resampled::uniform(rect, [9999; 4]));
        cross_fade(&mut main, &other, 0.5, &mut buffer, Level::Scalar);
        assert_eq!(main.runs, [[0, 0, 3], [1, 3, 4]]);
        let shown: Vec<i16> = (main.shown().flat_map(|(_, row)| row))
            .map(|pixel| pixel[3])
            .collect();
        assert_eq!(shown, [2000, 4000, 2000, 2000]);
    }

    #[test]
    fn every_instruction_set_fades_to_the_same_numbers() {
        let rect = |x| Rect::new(x, 1, 41, 7);
        let drawn = |x, seed| {
            let mut drawn = Resampled::uniform(rect(x), [0; 4]);
            for (k, value) in (0..).zip(drawn.pixels.as_flattened_mut()) {
                *value = (crate::random::bits(seed, &[k]) % 16385) as i16;
            }
            drawn
        };
        let faded = |weight, cpu| {
            let mut main = drawn(3, 1);
            cross_fade(
                &mut main,
                &drawn(9, 2),
                weight,
                &mut Resampled::default(),
                cpu,
            );
            (main.rect, main.pixels)
        };
        for (cpu, weight) in Level::available()
            .into_iter()
            .flat_map(|cpu| [0.0, 0.3, 0.5, 1.0].map(|weight| (cpu, weight)))
        {
            assert_eq!(faded(weight, cpu), faded(weight, Level::Scalar), "{cpu:?}");
        }
    }
}
