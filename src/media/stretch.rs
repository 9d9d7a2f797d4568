//! Reduction of gray of more than 8 bits to 8 bits. Cameras store 10 or 12 bits in 16-bit words, and
//! microscopes use a tenth of their range. The range of levels that a film uses becomes the full range from
//! black to white.

use super::note::Note;

/// Least number of frames sampled, spread over the film. Free choice.
pub(super) const LEAST_FRAMES: usize = 16;

/// Share of the pixels that may lie beyond either end of the range. In a picture of 640 x 480 it excludes up
/// to three hot pixels, but not a fluorescent animal of 24 pixels.
const BEYOND: f64 = 1e-5;

/// Least width of the range, levels of 65,536. It keeps the noise of a uniform picture small. Free choice.
const LEAST_RANGE: u16 = 256;

/// The range of gray levels that a film uses, 16 bits.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Stretch {
    from: u16,
    to: u16,
}

impl Stretch {
    /// Converts a 16-bit level to 8 bits: 0 at the start of the range and below, 255 at its end and above.
    pub(super) fn gray(&self, level: u16) -> u8 {
        let (above, range) = (level.saturating_sub(self.from), self.to - self.from);
        ((u32::from(above.min(range)) * 255 + u32::from(range) / 2) / u32::from(range)) as u8
    }

    /// Returns the ffmpeg filter that expands the range to 16 bits.
    pub(super) fn filter(&self) -> String {
        let (from, range) = (self.from, self.to - self.from);
        format!("format=gray16le,lut=c0='clip((val-{from})*65535/{range},0,65535)'")
    }

    /// Returns a note with the range in levels of `bits` bits.
    pub(super) fn note(&self, bits: u32) -> Note {
        let level = |value: u16| value >> (16 - bits);
        Note::GrayStretched {
            from: level(self.from),
            to: level(self.to),
            most: level(u16::MAX),
        }
    }

    /// Returns the range of levels used, given the number of pixels at each level.
    pub(super) fn of(counts: &[u64]) -> Stretch {
        let n_beyond = (counts.iter().sum::<u64>() as f64 * BEYOND) as u64;
        let from = beyond(counts.iter(), n_beyond);
        let to = u16::MAX - beyond(counts.iter().rev(), n_beyond);
        let from = from.min(u16::MAX - LEAST_RANGE);
        Stretch {
            from,
            to: to.max(from + LEAST_RANGE),
        }
    }
}

/// Returns the number of first levels that together hold at most `n_beyond` pixels.
fn beyond<'a>(counts: impl Iterator<Item = &'a u64>, n_beyond: u64) -> u16 {
    let sums = counts.scan(0, |sum, count| {
        *sum += count;
        Some(*sum)
    });
    let n_levels = sums.take_while(|&sum| sum <= n_beyond).count();
    u16::try_from(n_levels).unwrap_or(u16::MAX)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_hot_pixel_does_not_widen_the_range_and_a_small_animal_does() {
        let mut counts = vec![0; 1 << 16];
        counts[400..700].fill(1000);
        counts[65_535] = 2;
        assert_eq!(Stretch::of(&counts), Stretch { from: 400, to: 699 });
        counts[4000] = 24;
        assert_eq!(
            Stretch::of(&counts),
            Stretch {
                from: 400,
                to: 4000
            }
        );
    }

    #[test]
    fn the_range_becomes_black_to_white() {
        let stretch = Stretch {
            from: 1000,
            to: 5095,
        };
        let grays = [0, 1000, 1016, 3048, 5095, 65_535].map(|level| stretch.gray(level));
        assert_eq!(grays, [0, 0, 1, 128, 255, 255]);
    }

    #[test]
    fn one_gray_alone_is_not_blown_up() {
        for level in [0, 300, 65_535] {
            let mut counts = vec![0; 1 << 16];
            counts[level] = 10;
            let Stretch { from, to } = Stretch::of(&counts);
            assert!(
                to - from == LEAST_RANGE && usize::from(from) <= level,
                "{from} {to}"
            );
        }
    }
}
