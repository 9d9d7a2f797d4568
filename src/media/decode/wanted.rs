//! Which frames of a film a decoder is asked for: all, or some spread through it (for `decode`). ffmpeg drops
//! the others itself, and whoever hands over more than it was asked for is no decoder (RELIABILITY.md, R8).

/// Pictures that may come though no packet told of them.
pub(super) const MOST_UNTOLD: usize = 64;

/// Which frames a child hands over.
pub(super) enum Wanted {
    /// Every one.
    All,
    /// Those of these numbers, counted as they are decoded.
    Numbers(Vec<usize>),
    /// The first after the middle of each of so many parts a second.
    InTime { parts_per_s: f64, n_parts: usize },
}

impl Wanted {
    /// More frames than a child that does as it is told can hand over.
    pub(super) fn most(&self) -> usize {
        match self {
            Wanted::All => usize::MAX,
            Wanted::Numbers(numbers) => numbers.len(),
            Wanted::InTime { n_parts, .. } => 2 * n_parts + MOST_UNTOLD,
        }
    }

    pub(super) fn filter(&self) -> Option<String> {
        match self {
            Wanted::All => None,
            Wanted::Numbers(numbers) => {
                let each: Vec<String> = numbers.iter().map(|idx| format!("eq(n,{idx})")).collect();
                Some(format!("select='{}'", each.join("+")))
            }
            Wanted::InTime { parts_per_s, .. } => {
                // A little before the middle, for times are rounded.
                let part = |time: &str| format!("floor(({time}-start_t)*{parts_per_s}-0.499)");
                let (this, last) = (part("t"), part("prev_selected_t"));
                Some(format!(
                    "select='if(isnan(prev_selected_t),gte({this},0),gt({this},{last}))'"
                ))
            }
        }
    }
}
