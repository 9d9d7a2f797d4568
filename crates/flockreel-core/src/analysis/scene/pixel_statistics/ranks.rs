//! Computes order statistics, such as the median, over the samples of each pixel, for a whole row of pixels
//! (docs/explanation/algorithms.md, "Background").
//!
//! A binary search finds the value of the wanted rank bit by bit, from the highest bit down. Each step counts
//! the samples below a candidate, for 64 neighboring pixels at once, in loops that the compiler vectorizes.
//! Samples that are left out hold 255, so no candidate exceeds them.

use crate::analysis::scene::samples::MAX_SAMPLES;

/// Largest difference between values of an unchanged scene, levels of 255. It covers noise and residual
/// flicker. Free choice.
pub(in crate::analysis::scene) const SAME_LEVELS: u8 = 10;
/// Pixels searched at once.
const LANES: usize = 64;

/// Values of one sample at [`LANES`] neighboring pixels.
type Lanes = [u8; LANES];

/// The samples of a pixel that count, and the wanted rank among them.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Wanted {
    /// The samples that count; bit k is sample k.
    pub(super) free: u64,
    /// Rank of the wanted value: 0 for the smallest, below the number of free samples.
    pub(super) rank: u8,
}

impl Wanted {
    /// Returns the request for the lower median of the free samples.
    pub(super) fn median(free: u64) -> Wanted {
        Wanted {
            free,
            rank: (free.count_ones().saturating_sub(1) / 2) as u8,
        }
    }
}

/// Writes the wanted value of each pixel to `row`; 255 where no sample is free.
///
/// `samples` holds the same row of each sample, at most [`MAX_SAMPLES`]. With `bases`, one row for each
/// sample, the absolute differences from `bases` are ranked instead.
pub(super) fn write_ranked(
    samples: &[&[u8]],
    bases: Option<&[&[u8]]>,
    wanted: &[Wanted],
    row: &mut [u8],
) {
    let mut values = [[0; LANES]; MAX_SAMPLES];
    for start in (0..row.len()).step_by(LANES) {
        let n = LANES.min(row.len() - start);
        let values = &mut values[..samples.len()];
        for (k, (lanes, sample)) in values.iter_mut().zip(samples).enumerate() {
            lanes[..n].copy_from_slice(&sample[start..start + n]);
            if let Some(bases) = bases {
                for (value, base) in lanes.iter_mut().zip(&bases[k][start..start + n]) {
                    *value = value.abs_diff(*base);
                }
            }
        }
        let wanted = &wanted[start..start + n];
        mask_excluded(values, wanted);
        let mut ranks = [0; LANES];
        for (rank, wanted) in ranks.iter_mut().zip(wanted) {
            *rank = wanted.rank;
        }
        row[start..start + n].copy_from_slice(&select(values, &ranks)[..n]);
    }
}

/// Narrows `wanted` to the free samples near the commonest value of each pixel, and asks for their median.
///
/// The center is the free sample with the most free samples within `SAME_LEVELS`. Only those within
/// `SAME_LEVELS` of it stay. The scene keeps its color while passing objects vary, so this finds the scene even
/// where objects cover it most of the time.
pub(super) fn narrow_to_commonest(samples: &[&[u8]], wanted: &mut [Wanted]) {
    for (start, wanted) in (0..).step_by(LANES).zip(wanted.chunks_mut(LANES)) {
        let mut values = [[0; LANES]; MAX_SAMPLES];
        let mut free = [[0u8; LANES]; MAX_SAMPLES];
        for (k, sample) in samples.iter().enumerate() {
            values[k][..wanted.len()].copy_from_slice(&sample[start..start + wanted.len()]);
            for (free, wanted) in free[k].iter_mut().zip(&*wanted) {
                *free = (wanted.free >> k & 1) as u8;
            }
        }
        let (mut most, mut commonest) = ([0u8; LANES], [0u8; LANES]);
        for (own, own_free) in values.iter().zip(&free).take(samples.len()) {
            let mut count = [0u8; LANES];
            for (other, free) in values.iter().zip(&free).take(samples.len()) {
                for (((count, own), other), free) in count.iter_mut().zip(own).zip(other).zip(free)
                {
                    *count += u8::from(own.abs_diff(*other) <= SAME_LEVELS) & free;
                }
            }
            for lane in 0..LANES {
                let count = count[lane] * own_free[lane];
                if count > most[lane] {
                    (most[lane], commonest[lane]) = (count, own[lane]);
                }
            }
        }
        for (lane, wanted) in wanted.iter_mut().enumerate() {
            let near = |k: &usize| values[*k][lane].abs_diff(commonest[lane]) <= SAME_LEVELS;
            let near: u64 = (0..samples.len()).filter(near).map(|k| 1 << k).sum();
            *wanted = Wanted::median(wanted.free & near);
        }
    }
}

/// Sets the values that do not count to 255.
fn mask_excluded(values: &mut [Lanes], wanted: &[Wanted]) {
    let all = u64::MAX >> (MAX_SAMPLES - values.len());
    if wanted.iter().all(|w| w.free == all) {
        return;
    }
    for (k, lanes) in values.iter_mut().enumerate() {
        for (value, wanted) in lanes.iter_mut().zip(wanted) {
            *value |= ((wanted.free >> k & 1) as u8).wrapping_sub(1);
        }
    }
}

/// Returns the value of the given rank in each lane.
fn select(values: &[Lanes], ranks: &Lanes) -> Lanes {
    let mut found = [0; LANES];
    for bit in (0..8).rev() {
        let candidate = found.map(|value| value | 1 << bit);
        let mut below = [0u8; LANES];
        for lanes in values {
            for ((below, value), candidate) in below.iter_mut().zip(lanes).zip(&candidate) {
                *below += u8::from(value < candidate);
            }
        }
        for ((found, candidate), (below, rank)) in
            found.iter_mut().zip(candidate).zip(below.iter().zip(ranks))
        {
            *found = if below <= rank { candidate } else { *found };
        }
    }
    found
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    #[test]
    fn commonest_value_is_found_in_a_third_of_the_samples() {
        // Among 60 free samples, 20 show the scene, and no ten of the other 40 are alike. Four samples are not
        // free.
        let value = |k: usize| {
            if k.is_multiple_of(3) {
                120 + (k % 4) as u8
            } else {
                (4 * k) as u8
            }
        };
        let samples: Vec<Vec<u8>> = (0..64).map(|k| vec![value(k); 70]).collect();
        let rows: Vec<&[u8]> = samples.iter().map(Vec::as_slice).collect();
        let mut wanted = vec![Wanted::median(u64::MAX << 4); 70];
        narrow_to_commonest(&rows, &mut wanted);
        let mut row = vec![0; 70];
        write_ranked(&rows, None, &wanted, &mut row);
        assert!(
            row.iter().all(|value| (120..=123).contains(value)),
            "{row:?}"
        );
    }

    proptest! {
        #[test]
        fn the_value_is_that_of_the_sorted_free_samples(
            n in 1usize..=MAX_SAMPLES, width in 1usize..150, seed: u64, levels in 1u64..256,
        ) {
            let byte = |k: usize, x: usize| (crate::random::bits(seed, &[k as u64, x as u64]) % levels) as u8;
            let samples: Vec<Vec<u8>> = (0..n).map(|k| (0..width).map(|x| byte(k, x)).collect()).collect();
            let rows: Vec<&[u8]> = samples.iter().map(Vec::as_slice).collect();
            let base: Vec<u8> = (0..width).map(|x| byte(MAX_SAMPLES, x)).collect();
            let wanted: Vec<Wanted> = (0..width).map(|x| {
                let free = crate::random::bits(seed, &[x as u64]) & u64::MAX >> (MAX_SAMPLES - n);
                let rank = crate::random::bits(seed, &[x as u64, 7]) % u64::from(free.count_ones().max(1));
                Wanted { free, rank: rank as u8 }
            }).collect();
            let mut row = vec![0; width];
            for base in [None, Some(base.as_slice())] {
                let bases: Option<Vec<&[u8]>> = base.map(|base| vec![base; n]);
                write_ranked(&rows, bases.as_deref(), &wanted, &mut row);
                for x in 0..width {
                    let mut free: Vec<u8> = (0..n)
                        .filter(|k| wanted[x].free >> k & 1 == 1)
                        .map(|k| samples[k][x].abs_diff(base.map_or(0, |b| b[x])))
                        .collect();
                    free.sort();
                    prop_assert_eq!(row[x], free.get(usize::from(wanted[x].rank)).copied().unwrap_or(255));
                }
            }
        }
    }
}
