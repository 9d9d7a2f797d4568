//! Order statistics: percentile and median, which a small share of outliers barely moves.

/// Returns the value at rank `share` (0..=1) of the values by the nearest-rank method; `None` if there are
/// none. Reorders `values`.
pub fn percentile(values: &mut [f64], share: f64) -> Option<f64> {
    let rank = (share * values.len().saturating_sub(1) as f64).round() as usize;
    (!values.is_empty()).then(|| *values.select_nth_unstable_by(rank, f64::total_cmp).1)
}

/// Returns the median; `None` if there are no values.
pub fn median(values: impl Iterator<Item = f64>) -> Option<f64> {
    percentile(&mut values.collect::<Vec<f64>>(), 0.5)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn percentile_takes_the_nearest_rank() {
        let mut values = [3.0, 1.0, 2.0, 5.0, 4.0];
        let at = [0.0, 0.25, 0.5, 1.0].map(|share| percentile(&mut values, share));
        assert_eq!(at, [Some(1.0), Some(2.0), Some(3.0), Some(5.0)]);
        assert_eq!(median(std::iter::empty()), None);
    }
}
