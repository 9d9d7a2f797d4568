//! The frames that a decoder has to output: all, or a selection. ffmpeg drops the others itself. A child that
//! outputs more than requested is stopped (docs/explanation/promises.md, "Poison jobs").

/// Number of pictures accepted beyond those that the packets announce. Free choice.
pub(super) const MOST_UNTOLD: usize = 64;

/// The frames that a child outputs.
pub(super) enum Wanted {
    /// All frames.
    All,
    /// The frames with these indices in decoding order.
    Numbers(Vec<usize>),
    /// The first frame after the middle of each part, with `parts_per_s` parts per second.
    InTime { parts_per_s: f64, n_parts: usize },
}

impl Wanted {
    /// Returns the largest number of frames that a well-behaved child outputs.
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
                // Slightly before the middle, because times are rounded.
                let part = |time: &str| format!("floor(({time}-start_t)*{parts_per_s}-0.499)");
                let (this, last) = (part("t"), part("prev_selected_t"));
                Some(format!(
                    "select='if(isnan(prev_selected_t),gte({this},0),gt({this},{last}))'"
                ))
            }
        }
    }
}
