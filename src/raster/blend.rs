//! Premultiplied pictures over one another (ALGORITHMS.md 8), in the encoded values in which they
//! were cut out.

use super::RgbImage;
use super::resample::Resampled;
use crate::geometry::Rect;

/// Draws a placed sprite over a picture.
pub fn over(canvas: &mut RgbImage, sprite: &Resampled) {
    let rect = sprite.rect;
    if rect.is_empty() {
        return;
    }
    let stride = canvas.width as usize * 3;
    let rows = sprite.pixels.chunks_exact(rect.w as usize);
    for (row, y) in rows.zip(rect.y as usize..) {
        let out = &mut canvas.pixels[y * stride + rect.x as usize * 3..][..rect.w as usize * 3];
        for (out, pixel) in out.chunks_exact_mut(3).zip(row) {
            if pixel[3] > 0.0 {
                let through = 1.0 - pixel[3];
                for channel in 0..3 {
                    let value = pixel[channel] + through * f32::from(out[channel]);
                    // A cast saturates: no clamp is needed.
                    out[channel] = (value + 0.5) as u8;
                }
            }
        }
    }
}

/// `weight` of `second` and the rest of `main`, in `main`: its box grows to hold both.
pub fn mix(main: &mut Resampled, second: &Resampled, weight: f32) {
    let rect = main.rect.union(&second.rect);
    let mut pixels = vec![[0.0; 4]; rect.area() as usize];
    add(&mut pixels, rect, main, 1.0 - weight);
    add(&mut pixels, rect, second, weight);
    main.rect = rect;
    main.pixels = pixels;
}

fn add(pixels: &mut [[f32; 4]], rect: Rect, layer: &Resampled, weight: f32) {
    if layer.rect.is_empty() {
        return;
    }
    let rows = layer.pixels.chunks_exact(layer.rect.w as usize);
    for (row, y) in rows.zip(layer.rect.y..) {
        let at = (y - rect.y) as usize * rect.w as usize + (layer.rect.x - rect.x) as usize;
        for (out, pixel) in pixels[at..].iter_mut().zip(row) {
            for channel in 0..4 {
                out[channel] += weight * pixel[channel];
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn layer(rect: Rect, pixel: [f32; 4]) -> Resampled {
        Resampled {
            rect,
            pixels: vec![pixel; rect.area() as usize],
        }
    }

    #[test]
    fn opaque_covers_half_halves_and_clear_leaves() {
        let rect = Rect::of_size(1, 1);
        for (pixel, want) in [
            ([10.0, 20.0, 30.0, 1.0], [10, 20, 30]),
            ([100.0, 50.0, 0.0, 0.5], [150, 100, 50]),
            ([0.0; 4], [100, 100, 100]),
        ] {
            let mut canvas = RgbImage::new(1, 1);
            canvas.set_pixel(0, 0, [100, 100, 100]);
            over(&mut canvas, &layer(rect, pixel));
            assert_eq!(canvas.pixel(0, 0), want);
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
        let mut main = layer(rect, [100.0, 50.0, 25.0, 0.5]);
        let before = main.clone();
        mix(&mut main, &before, 0.25);
        assert_eq!((main.rect, &main.pixels), (before.rect, &before.pixels));
    }

    #[test]
    fn mixing_boxes_apart_holds_both() {
        let at = |x| Rect {
            x,
            y: 0,
            w: 1,
            h: 1,
        };
        let mut main = layer(at(0), [80.0, 0.0, 0.0, 1.0]);
        mix(&mut main, &layer(at(2), [0.0, 80.0, 0.0, 1.0]), 0.25);
        assert_eq!(
            main.pixels,
            [[60.0, 0.0, 0.0, 0.75], [0.0; 4], [0.0, 20.0, 0.0, 0.25]]
        );
    }
}
