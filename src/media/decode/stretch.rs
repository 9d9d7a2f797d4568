//! Gray of more than 8 bits: cameras store 10 or 12 bits in words of 16, microscopes a tenth of their range. What of
//! it a film uses becomes the whole range from black to white.

use super::{MOST_SKIPPED, Video};
use crate::footage::spread_idx;
use crate::media::error::Error;
use crate::media::gate::{Child, Order};
use crate::media::note::Note;
use crate::media::tools::Tool;
use crate::media::wanted::Wanted;

/// Fewest frames that are looked at, spread over the film.
const LEAST_FRAMES: usize = 16;

/// Share of the pixels that may lie beyond either end of the range: a hot pixel or three of a picture of 640x480,
/// but fewer than a fluorescent animal of 24 pixels has.
const BEYOND: f64 = 1e-5;

/// Levels that the range holds at least, of 65,536: a picture of one gray keeps its noise as small as it is.
const LEAST_RANGE: u16 = 256;

/// The range of gray that a film uses, of 16 bits.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Stretch {
    from: u16,
    to: u16,
}

impl Stretch {
    /// The filter that makes the range the whole one.
    pub(super) fn filter(&self) -> String {
        let (from, range) = (self.from, self.to - self.from);
        format!("format=gray16le,lut=c0='clip((val-{from})*65535/{range},0,65535)'")
    }

    /// The range in levels of `bits` bits, for people.
    pub(super) fn note(&self, bits: u32) -> Note {
        let level = |value: u16| value >> (16 - bits);
        Note::GrayStretched {
            from: level(self.from),
            to: level(self.to),
            most: level(u16::MAX),
        }
    }

    /// The range that these counts of each level use.
    fn of(counts: &[u64]) -> Stretch {
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

/// How many levels hold no more than `n_beyond` pixels together.
fn beyond<'a>(counts: impl Iterator<Item = &'a u64>, n_beyond: u64) -> u16 {
    let sums = counts.scan(0, |sum, count| {
        *sum += count;
        Some(*sum)
    });
    let n_levels = sums.take_while(|&sum| sum <= n_beyond).count();
    u16::try_from(n_levels).unwrap_or(u16::MAX)
}

impl Video {
    /// Decodes frames spread over the film and returns the range of gray that they use.
    pub(super) fn measure_gray(&self) -> Result<Stretch, Error> {
        let (probe, n_pictures) = (&self.probe, self.probe.n_pictures);
        // A child that shows nothing for long is taken for stalled.
        let n_frames = LEAST_FRAMES.max(n_pictures / MOST_SKIPPED);
        let wanted = Wanted::Numbers(spread_idx(n_pictures, n_frames));
        let size = format!("scale={}:{}:flags=neighbor", probe.width, probe.height);
        let chosen = wanted.filter().into_iter().chain([size]);
        let filters: Vec<String> = chosen.chain(["format=gray16le".to_owned()]).collect();
        let args = self.args(&wanted, &filters.join(","));
        let order = Order::new(Tool::Ffmpeg, args, &self.limits, n_pictures).with_input(&self.path);
        let mut child = Child::reading(order)?;
        let mut picture = vec![0; 2 * probe.width as usize * probe.height as usize];
        let mut counts = vec![0_u64; 1 << 16];
        for _ in 0..n_frames {
            if child.read_full(&mut picture)? < picture.len() {
                break;
            }
            for pixel in picture.chunks_exact(2) {
                counts[usize::from(u16::from_le_bytes([pixel[0], pixel[1]]))] += 1;
            }
        }
        Ok(Stretch::of(&counts))
    }
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
