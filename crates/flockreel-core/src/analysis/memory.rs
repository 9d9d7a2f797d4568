//! The memory that one stage of the analysis may take for frames, sprites or distances.

/// Memory of a stage, bytes. What does not fit is read again, or goes to the temporary storage. Free choice.
pub(super) const BUDGET_BYTES: usize = 128 << 20;
