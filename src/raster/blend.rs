//! Two placed sprites as one: the cross-fade at a jump (ALGORITHMS.md 8), premultiplied, in the encoded
//! values in which they were cut out.

use super::resample::{Quad, Resampled, scaled};
use crate::geometry::Rect;

/// `weight` of `second` (0..=1) and the rest of `main`, in `main`: its box grows to hold both. `memory` is
/// lent.
pub fn mix(main: &mut Resampled, second: &Resampled, weight: f64, memory: &mut Vec<Quad>) {
    let rect = main.rect.union(&second.rect);
    memory.clear();
    memory.resize(rect.area() as usize, [0; 4]);
    let share = (weight * 32767.0).round() as i16;
    add(memory, rect, main, 32767 - share);
    add(memory, rect, second, share);
    main.rect = rect;
    std::mem::swap(&mut main.pixels, memory);
}

/// Lets only `share` of a layer's color through (0..=1) and puts another, of alpha 1, in the place of the
/// rest; alpha stays.
pub fn haze(layer: &mut Resampled, share: f64, color: Quad) {
    let kept = (share * 32767.0).round() as i16;
    for pixel in &mut layer.pixels {
        let alpha = pixel[3];
        for channel in 0..3 {
            // Twice, because a color goes to 16384 and a weight to 32768.
            let whole = (2 * i32::from(color[channel])).min(32767) as i16;
            let veil = scaled(scaled(alpha, whole), 32767 - kept);
            pixel[channel] = (scaled(pixel[channel], kept) + veil).min(alpha);
        }
    }
}

fn add(pixels: &mut [Quad], rect: Rect, layer: &Resampled, weight: i16) {
    if layer.rect.is_empty() {
        return;
    }
    let rows = layer.pixels.chunks_exact(layer.rect.w as usize);
    for (row, y) in rows.zip(layer.rect.y..) {
        let at = (y - rect.y) as usize * rect.w as usize + (layer.rect.x - rect.x) as usize;
        for (out, pixel) in pixels[at..at + row.len()].iter_mut().zip(row) {
            for channel in 0..4 {
                out[channel] += scaled(pixel[channel], weight);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn layer(rect: Rect, pixel: Quad) -> Resampled {
        Resampled {
            rect,
            pixels: vec![pixel; rect.area() as usize],
        }
    }

    #[test]
    fn mixing_a_layer_with_itself_changes_nothing() {
        let rect = Rect {
            x: 3,
            y: 2,
            w: 4,
            h: 3,
        };
        let mut main = layer(rect, [6400, 3201, 1603, 8192]);
        let before = main.clone();
        mix(&mut main, &before, 0.25, &mut Vec::new());
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
    fn haze_takes_the_color_and_leaves_the_alpha() {
        let white = [16384; 4];
        let half = [8192, 4096, 0, 8192];
        for (share, want) in [
            (1.0, half),
            (0.0, [8192; 4]),
            (0.5, [8192, 6144, 4096, 8192]),
        ] {
            let mut found = layer(Rect::of_size(1, 1), half);
            haze(&mut found, share, white);
            for (a, b) in found.pixels[0].iter().zip(want) {
                assert!(a.abs_diff(b) <= 2, "{share}: {:?}", found.pixels);
            }
        }
    }

    #[test]
    fn mixing_boxes_apart_holds_both() {
        let at = |x| Rect {
            x,
            y: 0,
            w: 1,
            h: 1,
        };
        let mut main = layer(at(0), [8000, 0, 0, 16384]);
        let second = layer(at(2), [0, 8000, 0, 16384]);
        mix(&mut main, &second, 0.25, &mut Vec::new());
        assert_eq!(
            main.pixels,
            [[6000, 0, 0, 12288], [0; 4], [0, 2000, 0, 4096]]
        );
    }
}
