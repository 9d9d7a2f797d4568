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

/// Fixed-point factors from RGB to YUV.
#[derive(Clone, Copy, Debug)]
pub struct FromRgb {
    y_offset: i32,
    y: [i32; 3],
    u: [i32; 3],
    v: [i32; 3],
}

impl ColorSpec {
    /// Returns (K_r, K_b) of the matrix.
    fn weights(self) -> (f64, f64) {
        match self.matrix {
            Matrix::Bt601 => (0.299, 0.114),
            Matrix::Bt709 => (0.2126, 0.0722),
        }
    }

    /// Returns (luma offset, luma span, chroma span).
    fn spans(self) -> (f64, f64, f64) {
        match self.range {
            Range::Limited => (16.0, 219.0, 224.0),
            Range::Full => (0.0, 255.0, 255.0),
        }
    }

    /// Returns the luma of black, 0..=255.
    pub fn black(self) -> f32 {
        match self.range {
            Range::Limited => 16.0,
            Range::Full => 0.0,
        }
    }

    /// Returns the factors for the conversion of YUV to RGB.
    pub fn to_rgb(self) -> ToRgb {
        let (kr, kb) = self.weights();
        let kg = 1.0 - kr - kb;
        let (offset, luma, chroma) = self.spans();
        let fixed = |v: f64| (v * ONE).round() as i32;
        ToRgb {
            y_offset: offset as i32,
            y: fixed(255.0 / luma),
            r_v: fixed(2.0 * (1.0 - kr) * 255.0 / chroma),
            g_u: fixed(-2.0 * (1.0 - kb) * kb / kg * 255.0 / chroma),
            g_v: fixed(-2.0 * (1.0 - kr) * kr / kg * 255.0 / chroma),
            b_u: fixed(2.0 * (1.0 - kb) * 255.0 / chroma),
        }
    }

    /// Returns the factors for the conversion of RGB to YUV.
    pub fn from_rgb(self) -> FromRgb {
        let (kr, kb) = self.weights();
        let kg = 1.0 - kr - kb;
        let (offset, luma, chroma) = self.spans();
        let fixed = |v: f64, span: f64| (v * span / 255.0 * ONE).round() as i32;
        let (u, v) = (0.5 / (1.0 - kb), 0.5 / (1.0 - kr));
        FromRgb {
            y_offset: offset as i32,
            y: [fixed(kr, luma), fixed(kg, luma), fixed(kb, luma)],
            u: [
                fixed(-kr * u, chroma),
                fixed(-kg * u, chroma),
                fixed(0.5, chroma),
            ],
            v: [
                fixed(0.5, chroma),
                fixed(-kg * v, chroma),
                fixed(-kb * v, chroma),
            ],
        }
    }
}

/// Fixed-point factors from opaque premultiplied colors, in units of 1/16384, to YUV.
#[derive(Clone, Copy, Debug)]
pub struct FromQuads {
    pub(super) y_offset: i32,
    pub(super) y: [i32; 3],
    pub(super) u: [i32; 3],
    pub(super) v: [i32; 3],
}

impl ColorSpec {
    /// Returns the factors for the conversion of colors in units of 1/16384 to YUV.
    pub fn from_quads(self) -> FromQuads {
        let (kr, kb) = self.weights();
        let kg = 1.0 - kr - kb;
        let (offset, luma, chroma) = self.spans();
        // In units of 2^-21, so that products with sums of four pixels stay below 2^31.
        let fixed = |v: f64, span: f64| (v * span * 128.0).round() as i32;
        let (u, v) = (0.5 / (1.0 - kb), 0.5 / (1.0 - kr));
        FromQuads {
            y_offset: offset as i32,
            y: [kr, kg, kb].map(|k| fixed(k, luma)),
            u: [-kr * u, -kg * u, 0.5].map(|k| fixed(k, chroma)),
            v: [0.5, -kg * v, -kb * v].map(|k| fixed(k, chroma)),
        }
    }
}

impl FromQuads {
    /// Returns the luma of one pixel.
    #[inline(always)]
    pub fn luma(&self, [r, g, b, _]: [i16; 4]) -> u8 {
        let y = dot(self.y, [r, g, b].map(i32::from));
        (self.y_offset + ((y + (1 << 20)) >> 21)).clamp(0, 255) as u8
    }

    /// Returns the chroma (U, V) of a block, given the channel sums of its four pixels.
    #[inline(always)]
    pub fn chroma_of_block(&self, sum: [i32; 3]) -> [u8; 2] {
        let chroma = |k: [i32; 3]| (128 + ((dot(k, sum) + (1 << 22)) >> 23)).clamp(0, 255) as u8;
        [chroma(self.u), chroma(self.v)]
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

impl FromRgb {
    /// Returns the luma of one pixel.
    pub fn luma(&self, rgb: [u8; 3]) -> u8 {
        let y = dot(self.y, rgb.map(i32::from));
        (self.y_offset + ((y + 32768) >> 16)).clamp(0, 255) as u8
    }

    /// Returns the chroma (U, V) of a block, given the channel sums of its four pixels.
    pub fn chroma_of_block(&self, sum: [i32; 3]) -> [u8; 2] {
        // The sum of four pixels needs a shift by two more bits; half of the divisor is added for rounding.
        let chroma = |k: [i32; 3]| (128 + ((dot(k, sum) + (1 << 17)) >> 18)).clamp(0, 255) as u8;
        [chroma(self.u), chroma(self.v)]
    }
}

fn dot(k: [i32; 3], v: [i32; 3]) -> i32 {
    k[0] * v[0] + k[1] * v[1] + k[2] * v[2]
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
