//! The value of a given rank among the samples of each pixel, for a whole row of pixels at once
//! (ALGORITHMS.md 2.1: medians).
//!
//! Bit by bit from the top, as a binary search for the value: how many samples lie below a candidate is
//! counted for 64 neighboring pixels in step, in loops that the compiler makes vectors of. Samples left
//! out are 255 while they are counted, above every candidate.

/// Most samples: they fit the bits of a word.
pub(super) const MOST: usize = 64;
/// Values of a scene that does not change lie this near to each other, levels of 255: noise, and what is left of flicker.
const NEAR: u8 = 10;
/// Pixels searched in step.
const LANES: usize = 64;

/// One sample's values of [`LANES`] pixels.
type Lanes = [u8; LANES];

/// Which samples of a pixel count, and which of them is wanted.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Wanted {
    /// Bit k for sample k.
    pub(super) free: u64,
    /// 0 for the least; below the number of free samples.
    pub(super) rank: u8,
}

impl Wanted {
    /// The lower median of the free samples.
    pub(super) fn median(free: u64) -> Wanted {
        Wanted {
            free,
            rank: (free.count_ones().saturating_sub(1) / 2) as u8,
        }
    }
}

/// For each pixel of a row the wanted value of the samples; 255 where none is free. `samples` are the same
/// row of each sample, at most [`MOST`]; with `bases`, one row a sample, the values are their distances from those.
pub(super) fn ranked(
    samples: &[&[u8]],
    bases: Option<&[&[u8]]>,
    wanted: &[Wanted],
    row: &mut [u8],
) {
    let mut values = [[0; LANES]; MOST];
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
        leave_out(values, wanted);
        let mut ranks = [0; LANES];
        for (rank, wanted) in ranks.iter_mut().zip(wanted) {
            *rank = wanted.rank;
        }
        row[start..start + n].copy_from_slice(&select(values, &ranks)[..n]);
    }
}

/// Of the free samples of each pixel keeps those that lie within `NEAR` levels of the value around which the most of them lie, and
/// wants their median. A scene stays as it is while what passes before it varies, so this is the scene even where something
/// stands before it more than half of the time.
pub(super) fn want_commonest(samples: &[&[u8]], wanted: &mut [Wanted]) {
    for (start, wanted) in (0..).step_by(LANES).zip(wanted.chunks_mut(LANES)) {
        let mut values = [[0; LANES]; MOST];
        let mut free = [[0u8; LANES]; MOST];
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
                    *count += u8::from(own.abs_diff(*other) <= NEAR) & free;
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
            let near = |k: &usize| values[*k][lane].abs_diff(commonest[lane]) <= NEAR;
            let near: u64 = (0..samples.len()).filter(near).map(|k| 1 << k).sum();
            *wanted = Wanted::median(wanted.free & near);
        }
    }
}

/// Makes 255 of what is not free.
fn leave_out(values: &mut [Lanes], wanted: &[Wanted]) {
    let all = u64::MAX >> (MOST - values.len());
    if wanted.iter().all(|w| w.free == all) {
        return;
    }
    for (k, lanes) in values.iter_mut().enumerate() {
        for (value, wanted) in lanes.iter_mut().zip(wanted) {
            *value |= ((wanted.free >> k & 1) as u8).wrapping_sub(1);
        }
    }
}

/// The value of each lane's rank.
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
    fn what_stays_as_it_is_is_the_commonest_though_something_passes_more_often() {
        // Twenty free samples of the scene, forty of which no ten are alike, and four that are not free.
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
        want_commonest(&rows, &mut wanted);
        let mut row = vec![0; 70];
        ranked(&rows, None, &wanted, &mut row);
        assert!(
            row.iter().all(|value| (120..=123).contains(value)),
            "{row:?}"
        );
    }

    proptest! {
        #[test]
        fn the_value_is_that_of_the_sorted_free_samples(
            n in 1usize..=MOST, width in 1usize..150, seed: u64, levels in 1u64..256,
        ) {
            let byte = |k: usize, x: usize| (crate::random::bits(seed, &[k as u64, x as u64]) % levels) as u8;
            let samples: Vec<Vec<u8>> = (0..n).map(|k| (0..width).map(|x| byte(k, x)).collect()).collect();
            let rows: Vec<&[u8]> = samples.iter().map(Vec::as_slice).collect();
            let base: Vec<u8> = (0..width).map(|x| byte(MOST, x)).collect();
            let wanted: Vec<Wanted> = (0..width).map(|x| {
                let free = crate::random::bits(seed, &[x as u64]) & u64::MAX >> (MOST - n);
                let rank = crate::random::bits(seed, &[x as u64, 7]) % u64::from(free.count_ones().max(1));
                Wanted { free, rank: rank as u8 }
            }).collect();
            let mut row = vec![0; width];
            for base in [None, Some(base.as_slice())] {
                let bases: Option<Vec<&[u8]>> = base.map(|base| vec![base; n]);
                ranked(&rows, bases.as_deref(), &wanted, &mut row);
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
