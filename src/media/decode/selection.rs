//! The frames that a decoder has to output: all, or a selection. ffmpeg drops the others itself. A child that
//! outputs more than requested is stopped (docs/explanation/promises.md, "Poison jobs").

/// Number of pictures accepted beyond those that the packets announce. Free choice.
pub(super) const MAX_UNANNOUNCED_FRAMES: usize = 64;

/// The frames that a child outputs.
pub(super) enum FrameSelection {
    /// All frames.
    All,
    /// The frames with these indices in decoding order.
    Indices(Vec<usize>),
    /// The first frame after the middle of each part, with `parts_per_s` parts per second.
    OnePerPart { parts_per_s: f64, n_parts: usize },
}

impl FrameSelection {
    /// Returns the largest number of frames that a well-behaved child outputs.
    pub(super) fn max_frames(&self) -> usize {
        match self {
            FrameSelection::All => usize::MAX,
            FrameSelection::Indices(indices) => indices.len(),
            FrameSelection::OnePerPart { n_parts, .. } => 2 * n_parts + MAX_UNANNOUNCED_FRAMES,
        }
    }

    /// Returns the ffmpeg filter that drops the other frames; `None` for all frames.
    pub(super) fn filter(&self) -> Option<String> {
        match self {
            FrameSelection::All => None,
            FrameSelection::Indices(indices) => {
                let conditions: Vec<String> =
                    indices.iter().map(|idx| format!("eq(n,{idx})")).collect();
                Some(format!("select='{}'", conditions.join("+")))
            }
            FrameSelection::OnePerPart { parts_per_s, .. } => {
                // Slightly before the middle, because times are rounded.
                let part = |time: &str| format!("floor(({time}-start_t)*{parts_per_s}-0.499)");
                let (current, last) = (part("t"), part("prev_selected_t"));
                Some(format!(
                    "select='if(isnan(prev_selected_t),gte({current},0),gt({current},{last}))'"
                ))
            }
        }
    }
}
