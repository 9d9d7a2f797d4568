//! Resizing of whole pictures: the background of a flock rendered at another size than the footage
//! (docs/explanation/algorithms.md, "Compositing"). The filter is a Catmull-Rom kernel, widened to the output
//! pixel when shrinking, so that fine detail does not flicker. Edge pixels extend outward.

use super::RgbImage;

/// Returns the picture resized to `width` by `height`, each at least 1.
pub fn resized(image: &RgbImage, width: u32, height: u32) -> RgbImage {
    if (image.width, image.height) == (width, height) {
        return image.clone();
    }
    // Each pass transposes: the first resizes the rows, the second the columns.
    let across = resampled_rows(&image.pixels, image.width as usize, width as usize);
    let pixels = resampled_rows(&across, image.height as usize, height as usize);
    RgbImage {
        width,
        height,
        pixels,
    }
}

/// Resizes rows of `length` pixels to `n` pixels and transposes the result.
fn resampled_rows(pixels: &[u8], length: usize, n: usize) -> Vec<u8> {
    let n_rows = pixels.len() / (3 * length);
    let mut out = vec![0; n * n_rows * 3];
    for (to, taps) in taps(length, n).iter().enumerate() {
        for row in 0..n_rows {
            let mut sum = [0.0f32; 3];
            for &(from, weight) in taps {
                let at = (row * length + from) * 3;
                for channel in 0..3 {
                    sum[channel] += weight * f32::from(pixels[at + channel]);
                }
            }
            let at = (to * n_rows + row) * 3;
            // The cast saturates, so no clamp is needed.
            out[at..at + 3].copy_from_slice(&sum.map(|value| (value + 0.5) as u8));
        }
    }
    out
}

/// Returns, for each of `n` output pixels, the indices and weights of the `length` input pixels it sums.
fn taps(length: usize, n: usize) -> Vec<Vec<(usize, f32)>> {
    let step = length as f64 / n as f64;
    let width = step.max(1.0);
    let last = length as i64 - 1;
    (0..n)
        .map(|to| {
            let center = (to as f64 + 0.5) * step - 0.5;
            let first = (center - 2.0 * width).ceil() as i64;
            let end = (center + 2.0 * width).floor() as i64;
            let weights = (first..=end).map(|from| catmull_rom((from as f64 - center) / width));
            let sum: f64 = weights.clone().sum();
            let from = (first..=end).map(|from| from.clamp(0, last) as usize);
            from.zip(weights.map(|w| (w / sum) as f32)).collect()
        })
        .collect()
}

/// Returns the value of the Catmull-Rom kernel at a distance in pixels.
fn catmull_rom(distance: f64) -> f64 {
    let d = distance.abs();
    if d < 1.0 {
        1.0 + d * d * (1.5 * d - 2.5)
    } else if d < 2.0 {
        2.0 + d * (-4.0 + d * (2.5 - 0.5 * d))
    } else {
        0.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ramp(width: u32, height: u32) -> RgbImage {
        let mut image = RgbImage::new(width, height);
        for y in 0..height {
            for x in 0..width {
                image.set_pixel(x, y, [(x * 4) as u8, (y * 5) as u8, 77]);
            }
        }
        image
    }

    #[test]
    fn ramp_stays_a_ramp_when_enlarged_or_shrunk() {
        let image = ramp(40, 30);
        for (width, height) in [(80, 60), (20, 15), (40, 30)] {
            let other = resized(&image, width, height);
            let step = 40.0 / f64::from(width);
            // Excludes the edges, where the extension is constant.
            for (x, y) in [(width / 2, height / 2), (width / 4, 2 * height / 3)] {
                let want = [4.0, 5.0]
                    .map(|slope| move |at: u32| slope * ((f64::from(at) + 0.5) * step - 0.5));
                let [r, g, b] = other.pixel(x, y);
                assert!((f64::from(r) - want[0](x)).abs() <= 1.0, "{width}: {r}");
                assert!((f64::from(g) - want[1](y)).abs() <= 1.0, "{width}: {g}");
                assert_eq!(b, 77);
            }
        }
    }

    #[test]
    fn fine_checkerboard_shrinks_to_gray() {
        let mut image = RgbImage::new(64, 64);
        for k in 0..64 * 64 {
            let value = if (k % 64 + k / 64) % 2 == 0 { 200 } else { 100 };
            image.set_pixel(k % 64, k / 64, [value; 3]);
        }
        let small = resized(&image, 20, 20);
        assert!(small.pixels.iter().all(|&p| p.abs_diff(150) <= 8));
    }
}
