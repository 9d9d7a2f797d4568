//! Camera of one flock: gain of light and color, blur and noise, in the order in which a camera adds them. The
//! gains act on encoded values, as an automatic exposure and white balance do.

use crate::random::Sequence;
use crate::raster::RgbImage;

/// Reach of the blur in standard deviations. Free choice: beyond it lies less than 0.3 % of a Gaussian.
const REACH: f64 = 3.0;

/// Camera of one flock.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Look {
    /// Factors of red, green and blue.
    pub gain: [f64; 3],
    /// Standard deviation of the blur, pixels.
    pub blur_px: f64,
    /// Standard deviation of the noise, gray levels. It is the same in all colors of a pixel.
    pub noise: f64,
    /// Quality of JPEG pictures, 1 to 100.
    pub jpeg_quality: u8,
    /// Seed of the noise.
    pub seed: u64,
}

impl Look {
    /// Returns the picture as the camera takes it. `number` of the picture selects its noise.
    pub fn take(&self, mut picture: RgbImage, number: u64) -> RgbImage {
        let levels: [[f32; 256]; 3] = self
            .gain
            .map(|gain| std::array::from_fn(|level| (level as f64 * gain) as f32));
        let mut values: Vec<f32> = (picture.pixels.chunks_exact(3))
            .flat_map(|rgb| [0, 1, 2].map(|k| levels[k][usize::from(rgb[k])]))
            .collect();
        if self.blur_px > 0.0 {
            values = blurred(&values, &gaussian(self.blur_px), 3 * picture.width as usize);
        }
        if self.noise > 0.0 {
            let noise = Sequence::new(self.seed, &[number]);
            for (k, pixel) in values.chunks_exact_mut(3).enumerate() {
                let shift = (self.noise * noise.irwin_hall(k as u64)) as f32;
                pixel.iter_mut().for_each(|value| *value += shift);
            }
        }
        for (value, new) in picture.pixels.iter_mut().zip(values) {
            *value = (new + 0.5).clamp(0.0, 255.0) as u8;
        }
        picture
    }
}

/// Returns one half of a Gaussian kernel from its middle on; the whole sums up to 1.
fn gaussian(sigma_px: f64) -> Vec<f32> {
    let reach = (REACH * sigma_px).ceil() as usize;
    let weight = |k: usize| libm::exp(-((k * k) as f64) / (2.0 * sigma_px * sigma_px));
    let sum = 1.0 + 2.0 * (1..=reach).map(weight).sum::<f64>();
    (0..=reach).map(|k| (weight(k) / sum) as f32).collect()
}

/// Filters rows of `stride` RGB values, then columns. The border pixels repeat beyond the border.
fn blurred(values: &[f32], kernel: &[f32], stride: usize) -> Vec<f32> {
    let mut rows = vec![0.0; values.len()];
    let reach = kernel.len() - 1;
    let mut padded = Vec::new();
    for (row, to) in values
        .chunks_exact(stride)
        .zip(rows.chunks_exact_mut(stride))
    {
        padded.clear();
        padded.extend(row[..3].iter().cycle().take(3 * reach));
        padded.extend_from_slice(row);
        padded.extend(row[stride - 3..].iter().cycle().take(3 * reach));
        let shifted = |pixels: usize| &padded[3 * pixels..3 * pixels + stride];
        sum_weighted(to, kernel, shifted(reach), |away| {
            [shifted(reach - away), shifted(reach + away)]
        });
    }
    let mut columns = vec![0.0; values.len()];
    let last = values.len() / stride - 1;
    for (y, to) in columns.chunks_exact_mut(stride).enumerate() {
        let row = |y: usize| &rows[y * stride..(y + 1) * stride];
        sum_weighted(to, kernel, row(y), |away| {
            [row(y.saturating_sub(away)), row((y + away).min(last))]
        });
    }
    columns
}

/// Writes the weighted sum of a row and of the rows on both sides of it.
fn sum_weighted<'a>(
    to: &mut [f32],
    kernel: &[f32],
    middle: &[f32],
    sides: impl Fn(usize) -> [&'a [f32]; 2],
) {
    for (to, value) in to.iter_mut().zip(middle) {
        *to = kernel[0] * value;
    }
    for (away, weight) in kernel.iter().enumerate().skip(1) {
        let [before, after] = sides(away);
        for ((to, before), after) in to.iter_mut().zip(before).zip(after) {
            *to += weight * (before + after);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const PLAIN: Look = Look {
        gain: [1.0; 3],
        blur_px: 0.0,
        noise: 0.0,
        jpeg_quality: 90,
        seed: 1,
    };

    fn picture(at: impl Fn(u32, u32) -> [u8; 3]) -> RgbImage {
        let mut picture = RgbImage::new(41, 31);
        for y in 0..31 {
            for x in 0..41 {
                picture.set_pixel(x, y, at(x, y));
            }
        }
        picture
    }

    #[test]
    fn plain_camera_changes_nothing_and_gains_are_factors() {
        let seen = picture(|x, y| [(x * 3) as u8, (y * 4) as u8, 100]);
        assert_eq!(PLAIN.take(seen.clone(), 7), seen);
        let gain = [2.0, 1.0, 0.5];
        let taken = Look { gain, ..PLAIN }.take(seen, 7);
        assert_eq!(taken.pixel(10, 5), [60, 20, 50]);
    }

    #[test]
    fn blur_spreads_a_point_by_its_deviation_and_keeps_a_flat_picture() {
        let blur_px = 1.5;
        let look = Look { blur_px, ..PLAIN };
        let flat = picture(|_, _| [9, 90, 200]);
        assert_eq!(look.take(flat.clone(), 0), flat);
        let edge = look.take(picture(|x, _| if x < 20 { [0; 3] } else { [200; 3] }), 0);
        // A Gaussian edge has 16 % of its height one deviation before the middle, which lies at x = 20.
        let before = f64::from(edge.pixel(18, 15)[0]);
        assert!((before / 200.0 - 0.16).abs() < 0.015, "{before}");
    }

    #[test]
    fn noise_has_its_deviation_and_differs_between_pictures() {
        let look = Look {
            noise: 6.0,
            ..PLAIN
        };
        let gray = picture(|_, _| [128; 3]);
        let (a, b) = (look.take(gray.clone(), 0), look.take(gray, 1));
        assert!(a != b);
        let n = f64::from(41 * 31);
        let squares: f64 = (a.pixels.chunks_exact(3))
            .map(|p| (f64::from(p[0]) - 128.0).powi(2))
            .sum();
        assert!(((squares / n).sqrt() - 6.0).abs() < 0.5);
        assert!(
            a.pixels
                .chunks_exact(3)
                .all(|p| p[0] == p[1] && p[1] == p[2])
        );
    }
}
