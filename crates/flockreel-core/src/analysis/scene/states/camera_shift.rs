//! Measures how far the camera moved between a reference frame and other samples
//! (docs/explanation/algorithms.md, "Refused footage").
//!
//! Phase correlation (Kuglin & Hines 1975) compares small tiles spread over the picture. It uses structure
//! only, so light may change. Swaying plants and glittering water shift only their own tiles. The shift of
//! the camera is the one on which most tiles agree. Shifts above half a tile are not found; then most of the
//! picture differs, which `states` and `refusal` detect.
//!
//! The Fourier transform is our own, because that of a crate sums in an order that depends on the machine.

use std::f64::consts::TAU;

use rayon::prelude::*;

use crate::geometry::Rect;
use crate::raster::Frame;

/// Side of a tile, pixels; a power of two. Free choice.
const SIDE: usize = 64;
/// Largest number of tiles along each side of the picture. Free choice.
const MAX_TILES_ALONG: u32 = 5;
/// Least standard deviation of a tile's luma, levels of 255; below it a tile has no structure. Free choice.
const MIN_DEVIATION: f64 = 3.0;
/// Least height of the correlation peak, as a share of the peak of equal tiles. Free choice.
const MIN_PEAK: f64 = 0.3;
/// Least number of tiles with a peak for a shift. Free choice.
const MIN_TILES: usize = 4;
/// Least share of the tiles that must agree on a shift, 0..=1. Free choice.
const MIN_AGREEING_SHARE: f64 = 0.6;
/// Shift above which the camera has moved, and deviation within which a tile agrees, pixels. Smaller ones are within
/// the error of the correlation.
pub(super) const MIN_SHIFT_PX: f64 = 0.6;
/// Deviation within which a tile agrees, as a share of the shift, if that is larger. Tiles fade to their
/// edges, so large shifts are measured too small. Free choice.
const TOLERANCE: f64 = 0.35;
/// Standard deviation of the Gaussian weight of spatial frequencies, cycles per pixel. Free choice.
const BANDWIDTH: f64 = 0.2;
/// Standard deviation of the white noise that damps weak frequencies, levels of 255. Only frequencies well
/// above it are whitened to equal strength. Free choice.
const NOISE_SIGMA: f64 = 8.0;

/// The tiles of a reference frame that have structure, with their spectra.
pub(super) struct Correlator {
    tiles: Vec<(Rect, Vec<Complex>)>,
    fourier: Fourier,
}

impl Correlator {
    /// Returns a correlator against a reference frame.
    pub(super) fn new(reference: &Frame) -> Correlator {
        let fourier = Fourier::new();
        let tiles = tiles(reference.width, reference.height)
            .into_iter()
            .filter_map(|rect| {
                let mut tile = fourier.windowed(reference, rect)?;
                fourier.transform(&mut tile, Direction::Forward);
                Some((rect, tile))
            })
            .collect();
        Correlator { tiles, fourier }
    }

    /// Returns the shift of each chosen frame from the reference, pixels; `None` where the tiles do not
    /// agree.
    pub(super) fn shifts_px(&self, frames: &[Frame], chosen: &[usize]) -> Vec<Option<[f64; 2]>> {
        let shift_px = |&k: &usize| self.shift_px(&frames[k]);
        chosen.par_iter().map(shift_px).collect()
    }

    /// Returns the shift on which most tiles agree, pixels; `None` when they do not.
    fn shift_px(&self, frame: &Frame) -> Option<[f64; 2]> {
        let shifts: Vec<[f64; 2]> = self
            .tiles
            .iter()
            .filter_map(|(rect, reference)| {
                let mut tile = self.fourier.windowed(frame, *rect)?;
                self.fourier.transform(&mut tile, Direction::Forward);
                self.fourier.peak(&tile, reference)
            })
            .collect();
        if shifts.len() < MIN_TILES {
            return None;
        }
        let middle = |axis: usize| {
            let mut along: Vec<f64> = shifts.iter().map(|shift| shift[axis]).collect();
            along.sort_by(f64::total_cmp);
            along[along.len() / 2]
        };
        let shift = [middle(0), middle(1)];
        let tolerance_px = MIN_SHIFT_PX.max(TOLERANCE * libm::hypot(shift[0], shift[1]));
        let agrees = |s: &&[f64; 2]| libm::hypot(s[0] - shift[0], s[1] - shift[1]) <= tolerance_px;
        let agreeing = shifts.iter().filter(agrees).count() as f64;
        (agreeing >= MIN_AGREEING_SHARE * shifts.len() as f64).then_some(shift)
    }
}

/// Returns tiles spread evenly over a picture. They overlap in a small picture; there are none in one smaller
/// than a tile.
fn tiles(width: u32, height: u32) -> Vec<Rect> {
    let side = SIDE as u32;
    let along = |length: u32| -> Vec<u32> {
        let n = (2 * length / side).saturating_sub(1).min(MAX_TILES_ALONG);
        (0..n)
            .map(|k| (length - side) * (2 * k + 1) / (2 * n))
            .collect()
    };
    let columns = along(width);
    let at = |y: u32| {
        let tile = move |&x: &u32| Rect {
            x,
            y,
            w: side,
            h: side,
        };
        columns.iter().map(tile).collect::<Vec<_>>()
    };
    along(height).into_iter().flat_map(at).collect()
}

#[derive(Clone, Copy, Default)]
struct Complex {
    re: f64,
    im: f64,
}

#[derive(Clone, Copy, PartialEq)]
enum Direction {
    Forward,
    Inverse,
}

/// The Fourier transform of a tile (Cooley & Tukey 1965), with its constant tables.
struct Fourier {
    /// exp(-i tau k / SIDE) for each k.
    roots: Vec<Complex>,
    /// Hann window.
    window: Vec<f64>,
    /// Weight of each spatial frequency.
    weights: Vec<f64>,
    /// Contribution of noise to the product of two spectra.
    noise: f64,
}

impl Fourier {
    fn new() -> Fourier {
        let angle_rad = |k: usize| TAU * k as f64 / SIDE as f64;
        let frequency = |k: usize| k.min(SIDE - k) as f64 / SIDE as f64 / BANDWIDTH;
        let weights = (0..SIDE * SIDE).map(|at| {
            let (fx, fy) = (frequency(at % SIDE), frequency(at / SIDE));
            libm::exp(-0.5 * (fx * fx + fy * fy))
        });
        let root = |k| Complex {
            re: libm::cos(angle_rad(k)),
            im: -libm::sin(angle_rad(k)),
        };
        let hann = |k: usize| 0.5 - 0.5 * libm::cos(angle_rad(k) + TAU / (2 * SIDE) as f64);
        let window: Vec<f64> = (0..SIDE).map(hann).collect();
        let along = window.iter().map(|w| w * w).sum::<f64>();
        Fourier {
            roots: (0..SIDE).map(root).collect(),
            noise: NOISE_SIGMA * NOISE_SIGMA * along * along,
            window,
            weights: weights.collect(),
        }
    }

    /// Returns the luma of a tile minus its mean, faded to its edges; `None` where it has no structure.
    fn windowed(&self, frame: &Frame, rect: Rect) -> Option<Vec<Complex>> {
        let width = frame.width as usize;
        let level = |k: usize| {
            let (x, y) = (rect.x as usize + k % SIDE, rect.y as usize + k / SIDE);
            f64::from(frame.luma()[y * width + x])
        };
        let n = (SIDE * SIDE) as f64;
        let mean = (0..SIDE * SIDE).map(level).sum::<f64>() / n;
        let variance = (0..SIDE * SIDE).map(|k| (level(k) - mean) * (level(k) - mean));
        if variance.sum::<f64>() / n < MIN_DEVIATION * MIN_DEVIATION {
            return None;
        }
        let value = |k: usize| Complex {
            re: (level(k) - mean) * self.window[k % SIDE] * self.window[k / SIDE],
            im: 0.0,
        };
        Some((0..SIDE * SIDE).map(value).collect())
    }

    /// Transforms the rows, then the columns, in place.
    fn transform(&self, tile: &mut [Complex], direction: Direction) {
        for row in tile.chunks_exact_mut(SIDE) {
            self.transform_line(row, direction);
        }
        let mut column = [Complex::default(); SIDE];
        for x in 0..SIDE {
            for (value, y) in column.iter_mut().zip(0..) {
                *value = tile[y * SIDE + x];
            }
            self.transform_line(&mut column, direction);
            for (value, y) in column.iter().zip(0..) {
                tile[y * SIDE + x] = *value;
            }
        }
    }

    fn transform_line(&self, line: &mut [Complex], direction: Direction) {
        let n_bits = SIDE.trailing_zeros();
        for k in 0..SIDE {
            let reversed = k.reverse_bits() >> (usize::BITS - n_bits);
            if k < reversed {
                line.swap(k, reversed);
            }
        }
        let mut half = 1;
        while half < SIDE {
            for pair in line.chunks_exact_mut(2 * half) {
                let (low, high) = pair.split_at_mut(half);
                for (k, (a, b)) in low.iter_mut().zip(high).enumerate() {
                    let root = self.roots[k * SIDE / (2 * half)];
                    let im = if direction == Direction::Forward {
                        root.im
                    } else {
                        -root.im
                    };
                    let turned = Complex {
                        re: b.re * root.re - b.im * im,
                        im: b.re * im + b.im * root.re,
                    };
                    *b = Complex {
                        re: a.re - turned.re,
                        im: a.im - turned.im,
                    };
                    *a = Complex {
                        re: a.re + turned.re,
                        im: a.im + turned.im,
                    };
                }
            }
            half *= 2;
        }
    }

    /// Returns the shift of the first spectrum from the second, pixels: the peak of their phase correlation,
    /// refined below one pixel. Returns `None` when the peak is low.
    fn peak(&self, frame: &[Complex], reference: &[Complex]) -> Option<[f64; 2]> {
        let mut ideal = 0.0;
        let product = |k: usize| {
            let (f, r) = (frame[k], reference[k]);
            let (re, im) = (f.re * r.re + f.im * r.im, f.im * r.re - f.re * r.im);
            let length = libm::hypot(re, im);
            let weight = self.weights[k] / (length + self.noise);
            ideal += weight * length;
            Complex {
                re: re * weight,
                im: im * weight,
            }
        };
        let mut tile: Vec<Complex> = (0..SIDE * SIDE).map(product).collect();
        self.transform(&mut tile, Direction::Inverse);
        let highest = |a: &usize, b: &usize| tile[*a].re.total_cmp(&tile[*b].re);
        let at = (0..SIDE * SIDE).max_by(highest)?;
        if tile[at].re < MIN_PEAK * ideal {
            return None;
        }
        let (x, y) = (at % SIDE, at / SIDE);
        let value = |x: usize, y: usize| tile[y % SIDE * SIDE + x % SIDE].re;
        let signed = |k: usize| k as f64 - if k > SIDE / 2 { SIDE as f64 } else { 0.0 };
        Some([
            signed(x) + vertex(value(x + SIDE - 1, y), value(x, y), value(x + 1, y)),
            signed(y) + vertex(value(x, y + SIDE - 1), value(x, y), value(x, y + 1)),
        ])
    }
}

/// Returns the vertex of the parabola through three neighbors, -0.5..=0.5 from the middle one, which is the
/// highest.
fn vertex(before: f64, middle: f64, after: f64) -> f64 {
    let bend = before - 2.0 * middle + after;
    if bend < 0.0 {
        (0.5 * (before - after) / bend).clamp(-0.5, 0.5)
    } else {
        0.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random;
    use crate::raster::ColorSpec;

    /// Returns soft blotches seen by a camera shifted by (dx, dy) in light of `gain`, with noise.
    fn scene(dx: f64, dy: f64, gain: f64, noise_key: u64) -> Frame {
        let mut frame = Frame::new(320, 240, ColorSpec::default());
        let blotch = |k: u64| {
            let unit = |c: u64| random::uniform(4, &[k, c]);
            let radius_px = 1.5 + 5.0 * unit(2);
            (
                unit(0) * 320.0,
                unit(1) * 240.0,
                radius_px,
                80.0 * unit(3) - 40.0,
            )
        };
        let blotches: Vec<_> = (0..600).map(blotch).collect();
        for at in 0..320 * 240 {
            let (x, y) = ((at % 320) as f64 - dx, (at / 320) as f64 - dy);
            let light = |&(cx, cy, radius, level): &(f64, f64, f64, f64)| {
                let square = ((x - cx).powi(2) + (y - cy).powi(2)) / (2.0 * radius * radius);
                if square < 5.0 {
                    level * (-square).exp()
                } else {
                    0.0
                }
            };
            let level = gain * (110.0 + blotches.iter().map(light).sum::<f64>());
            let noise = 2.0 * random::normal(5, &[noise_key, at as u64]);
            frame.planes[at] = (level + noise).round().clamp(0.0, 255.0) as u8;
        }
        frame
    }

    #[test]
    fn shift_is_measured_in_any_light() {
        let correlator = Correlator::new(&scene(0.0, 0.0, 1.0, 0));
        for (dx, dy, gain) in [(0.0, 0.0, 1.2), (1.5, -0.7, 1.0), (-4.0, 2.4, 0.8)] {
            let frame = scene(dx, dy, gain, 1);
            let shift = correlator.shift_px(&frame);
            let [x, y] = shift.expect("most tiles agree");
            let off_px = (x - dx).hypot(y - dy);
            assert!(
                off_px < 0.25 + 0.2 * dx.hypot(dy),
                "{dx} {dy} {gain}: {shift:?}"
            );
        }
    }

    #[test]
    fn shift_of_a_third_of_the_picture_is_not_the_camera() {
        let still = scene(0.0, 0.0, 1.0, 0);
        let mut swaying = still.clone();
        let shifted = scene(3.0, 0.0, 1.0, 0);
        for at in (0..320 * 240).filter(|at| at % 320 < 107) {
            swaying.planes[at] = shifted.planes[at];
        }
        let shift = Correlator::new(&still).shift_px(&swaying);
        assert!(shift.is_none_or(|s| s[0].hypot(s[1]) < 0.3), "{shift:?}");
    }

    #[test]
    fn flat_picture_has_no_shift() {
        let mut flat = Frame::new(320, 240, ColorSpec::default());
        flat.planes.fill(128);
        assert!(Correlator::new(&flat).shift_px(&flat).is_none());
        assert!(tiles(48, 48).is_empty());
    }

    #[test]
    fn tiles_lie_inside_the_picture() {
        for (width, height) in [(64, 64), (65, 100), (210, 80), (1920, 1080), (63, 500)] {
            let inside = |t: &Rect| t.right() <= width && t.bottom() <= height;
            assert!(tiles(width, height).iter().all(inside));
        }
    }
}
