//! Reduction of gray of more than 8 bits to 8 bits. Cameras store 10 or 12 bits in 16-bit words, and
//! microscopes use a tenth of their range. The range of levels that a film uses becomes the full range from
//! black to white.

use super::notice::Notice;

/// Least number of frames sampled, spread over the film. Free choice.
pub(super) const MIN_SAMPLED_FRAMES: usize = 16;

/// Share of the pixels that may lie beyond either end of the range. In a picture of 640 x 480 it excludes up
/// to three hot pixels, but not a fluorescent animal of 24 pixels.
const CLIPPED_SHARE: f64 = 1e-5;

/// Least width of the range, levels of 65,536. It keeps the noise of a uniform picture small. Free choice.
const MIN_WIDTH: u16 = 256;

/// The range of gray levels that a film uses, 16 bits.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct GrayRange {
    /// Level that becomes black.
    black: u16,
    /// Level that becomes white, > `black`.
    white: u16,
}

impl GrayRange {
    /// Converts a 16-bit level to 8 bits: 0 at the start of the range and below, 255 at its end and above.
    pub(super) fn to_8_bits(self, level: u16) -> u8 {
        let width = u32::from(self.white - self.black);
        let above = u32::from(level.saturating_sub(self.black)).min(width);
        ((above * 255 + width / 2) / width) as u8
    }

    /// Returns the ffmpeg filter that expands the range to 16 bits.
    pub(super) fn filter(&self) -> String {
        let (black, width) = (self.black, self.white - self.black);
        format!("format=gray16le,lut=c0='clip((val-{black})*65535/{width},0,65535)'")
    }

    /// Returns a notice with the range in levels of `bits` bits.
    pub(super) fn notice(&self, bits: u32) -> Notice {
        let level = |value: u16| value >> (16 - bits);
        Notice::GrayStretched {
            black: level(self.black),
            white: level(self.white),
            max: level(u16::MAX),
        }
    }

    /// Returns the range of levels used, given the number of pixels at each level.
    pub(super) fn from_histogram(counts: &[u64]) -> GrayRange {
        let n_clipped = (counts.iter().sum::<u64>() as f64 * CLIPPED_SHARE) as u64;
        let black = n_clipped_levels(counts.iter(), n_clipped).min(u16::MAX - MIN_WIDTH);
        let white = u16::MAX - n_clipped_levels(counts.iter().rev(), n_clipped);
        GrayRange {
            black,
            white: white.max(black + MIN_WIDTH),
        }
    }
}

/// Returns the number of first levels that together hold at most `n_clipped` pixels.
fn n_clipped_levels<'a>(counts: impl Iterator<Item = &'a u64>, n_clipped: u64) -> u16 {
    let sums = counts.scan(0, |sum, count| {
        *sum += count;
        Some(*sum)
    });
    let n_levels = sums.take_while(|&sum| sum <= n_clipped).count();
    u16::try_from(n_levels).unwrap_or(u16::MAX)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn hot_pixels_are_clipped_and_a_small_animal_is_not() {
        let mut counts = vec![0; 1 << 16];
        counts[400..700].fill(1000);
        counts[65_535] = 2;
        assert_eq!(
            GrayRange::from_histogram(&counts),
            GrayRange {
                black: 400,
                white: 699
            }
        );
        counts[4000] = 24;
        assert_eq!(
            GrayRange::from_histogram(&counts),
            GrayRange {
                black: 400,
                white: 4000
            }
        );
    }

    #[test]
    fn range_becomes_black_to_white() {
        let gray_range = GrayRange {
            black: 1000,
            white: 5095,
        };
        let grays = [0, 1000, 1016, 3048, 5095, 65_535].map(|level| gray_range.to_8_bits(level));
        assert_eq!(grays, [0, 0, 1, 128, 255, 255]);
    }

    #[test]
    fn uniform_gray_gets_the_minimum_width() {
        for level in [0, 300, 65_535] {
            let mut counts = vec![0; 1 << 16];
            counts[level] = 10;
            let GrayRange { black, white } = GrayRange::from_histogram(&counts);
            assert!(
                white - black == MIN_WIDTH && usize::from(black) <= level,
                "{black} {white}"
            );
        }
    }
}
