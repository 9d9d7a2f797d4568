//! Conversion between YUV and RGB in 16.16 fixed point, identical on every machine.
//!
//! Each chroma sample applies to its whole 2 x 2 block without interpolation, as in ffmpeg's unscaled
//! converter. What is measured, cut out and put back therefore matches what a video editor shows.

/// Luma weights with which the planes were made.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub enum Matrix {
    /// ITU-R BT.601: standard definition, and video without a tag, which ffmpeg and OpenCV read this way.
    #[default]
    Bt601,
    /// ITU-R BT.709: high definition.
    Bt709,
}

/// Range of the values: 16..=235 or 0..=255 for luma.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub enum Range {
    /// Luma 16..=235, chroma 16..=240: nearly all video.
    #[default]
    Limited,
    /// 0..=255: motion JPEG and gray video.
    Full,
}

/// The meaning of YUV values: luma weights and range.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub struct ColorSpec {
    /// Luma weights.
    pub matrix: Matrix,
    /// Range of the values.
    pub range: Range,
}

const ONE: f64 = 65536.0;

/// Fixed-point factors from YUV to RGB.
#[derive(Clone, Copy, Debug)]
pub struct ToRgb {
    y_offset: i32,
    y: i32,
    r_v: i32,
    g_u: i32,
    g_v: i32,
    b_u: i32,
}

/// Fixed-point factors from RGB to YUV, in units of 2^-`SHIFT` of the product with one color value.
#[derive(Clone, Copy, Debug)]
pub struct ToYuv<const SHIFT: u32> {
    pub(super) y_offset: i32,
    pub(super) y: [i32; 3],
    pub(super) u: [i32; 3],
    pub(super) v: [i32; 3],
}

/// Factors from 8-bit RGB to YUV.
pub type FromRgb = ToYuv<16>;

/// Factors from opaque premultiplied colors, in units of 1/16384, to YUV. Products with sums of four pixels
/// stay below 2^31.
pub type FromQuads = ToYuv<21>;

/// Luma of black, and spans of luma and chroma.
struct Levels {
    black: f64,
    luma_span: f64,
    chroma_span: f64,
}

impl ColorSpec {
    /// Returns (K_r, K_b) of the matrix.
    fn weights(self) -> (f64, f64) {
        match self.matrix {
            Matrix::Bt601 => (0.299, 0.114),
            Matrix::Bt709 => (0.2126, 0.0722),
        }
    }

    fn levels(self) -> Levels {
        let [black, luma_span, chroma_span] = match self.range {
            Range::Limited => [16.0, 219.0, 224.0],
            Range::Full => [0.0, 255.0, 255.0],
        };
        Levels {
            black,
            luma_span,
            chroma_span,
        }
    }

    /// Returns the luma of black, 0..=255.
    pub fn black(self) -> f32 {
        self.levels().black as f32
    }

    /// Returns the factors for the conversion of YUV to RGB.
    pub fn to_rgb(self) -> ToRgb {
        let (kr, kb) = self.weights();
        let kg = 1.0 - kr - kb;
        let levels = self.levels();
        let chroma = levels.chroma_span;
        let fixed = |v: f64| (v * ONE).round() as i32;
        ToRgb {
            y_offset: levels.black as i32,
            y: fixed(255.0 / levels.luma_span),
            r_v: fixed(2.0 * (1.0 - kr) * 255.0 / chroma),
            g_u: fixed(-2.0 * (1.0 - kb) * kb / kg * 255.0 / chroma),
            g_v: fixed(-2.0 * (1.0 - kr) * kr / kg * 255.0 / chroma),
            b_u: fixed(2.0 * (1.0 - kb) * 255.0 / chroma),
        }
    }

    /// Returns the factors for the conversion of 8-bit RGB to YUV.
    pub fn from_rgb(self) -> FromRgb {
        self.to_yuv(|factor| factor / 255.0 * ONE)
    }

    /// Returns the factors for the conversion of colors in units of 1/16384 to YUV.
    pub fn from_quads(self) -> FromQuads {
        self.to_yuv(|factor| factor * 128.0)
    }

    /// Returns the factors to YUV. `scale` converts the share of a color in a span to fixed point.
    fn to_yuv<const SHIFT: u32>(self, scale: impl Fn(f64) -> f64) -> ToYuv<SHIFT> {
        let (kr, kb) = self.weights();
        let kg = 1.0 - kr - kb;
        let levels = self.levels();
        let (u, v) = (0.5 / (1.0 - kb), 0.5 / (1.0 - kr));
        let luma = |k: f64| scale(k * levels.luma_span).round() as i32;
        let chroma = |k: f64| scale(k * levels.chroma_span).round() as i32;
        ToYuv {
            y_offset: levels.black as i32,
            y: [kr, kg, kb].map(luma),
            u: [-kr * u, -kg * u, 0.5].map(chroma),
            v: [0.5, -kg * v, -kb * v].map(chroma),
        }
    }
}

impl ToRgb {
    /// Converts one pixel. Each channel is rounded and clamped to 0..=255.
    pub fn convert(&self, y: u8, u: u8, v: u8) -> [u8; 3] {
        let luma = (i32::from(y) - self.y_offset) * self.y + 32768;
        let (u, v) = (i32::from(u) - 128, i32::from(v) - 128);
        let channel = |value: i32| (value >> 16).clamp(0, 255) as u8;
        [
            channel(luma + self.r_v * v),
            channel(luma + self.g_u * u + self.g_v * v),
            channel(luma + self.b_u * u),
        ]
    }
}

impl<const SHIFT: u32> ToYuv<SHIFT> {
    /// Returns the luma of one pixel.
    #[inline(always)]
    pub fn luma(&self, rgb: [impl Into<i32>; 3]) -> u8 {
        let y = dot(self.y, rgb.map(Into::into));
        (self.y_offset + rounded_shift(y, SHIFT)).clamp(0, 255) as u8
    }

    /// Returns the chroma (U, V) of a block, given the channel sums of its four pixels.
    #[inline(always)]
    pub fn chroma_of_block(&self, sum: [i32; 3]) -> [u8; 2] {
        // The sum of four pixels needs a shift by two more bits.
        let chroma = |k: [i32; 3]| 128 + rounded_shift(dot(k, sum), SHIFT + 2);
        [self.u, self.v].map(|k| chroma(k).clamp(0, 255) as u8)
    }
}

#[inline(always)]
fn dot(k: [i32; 3], v: [i32; 3]) -> i32 {
    k[0] * v[0] + k[1] * v[1] + k[2] * v[2]
}

/// Returns the value divided by 2^`shift` and rounded.
#[inline(always)]
fn rounded_shift(value: i32, shift: u32) -> i32 {
    (value + (1 << (shift - 1))) >> shift
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn white_black_and_red_have_their_textbook_values() {
        let spec = ColorSpec::default();
        let rgb = spec.to_rgb();
        assert_eq!(rgb.convert(235, 128, 128), [255, 255, 255]);
        assert_eq!(rgb.convert(16, 128, 128), [0, 0, 0]);
        let [r, g, b] = rgb.convert(81, 90, 240);
        assert!(r >= 253 && g <= 1 && b <= 1, "{r} {g} {b}");
    }

    #[test]
    fn rgb_survives_the_round_trip_within_two_levels() {
        for matrix in [Matrix::Bt601, Matrix::Bt709] {
            for range in [Range::Limited, Range::Full] {
                let spec = ColorSpec { matrix, range };
                let (to, from) = (spec.to_rgb(), spec.from_rgb());
                for rgb in [
                    [0, 0, 0],
                    [255, 255, 255],
                    [200, 100, 20],
                    [12, 250, 130],
                    [90, 90, 91],
                ] {
                    let [u, v] = from.chroma_of_block(rgb.map(|c| i32::from(c) * 4));
                    let back = to.convert(from.luma(rgb), u, v);
                    for (a, b) in back.iter().zip(rgb) {
                        assert!(a.abs_diff(b) <= 2, "{spec:?} {rgb:?} -> {back:?}");
                    }
                }
            }
        }
    }
}
