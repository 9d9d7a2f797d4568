//! What is worth knowing of a film that was accepted: assumptions made, and faults of the file that were mended.

/// One such thing; prints as a sentence.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum Note {
    /// The file ends early, but not before its last picture.
    #[error(
        "The file is cut off after its last picture: what is missing belongs to its sound or its index. All \
         {n_pictures} pictures are there."
    )]
    CutAfterPictures {
        /// Pictures found.
        n_pictures: usize,
    },
    /// The clock of the recorder was set, or the recording paused.
    #[error(
        "The times in the file leap, first by {by_s:.1} s at {at_s:.1} s ({n_leaps} in all): the pictures are \
         taken to follow each other at the usual rate. If the recording paused there, cut it there."
    )]
    TimesLeap {
        /// When, seconds from the first picture.
        at_s: f64,
        /// By how much, seconds.
        by_s: f64,
        /// How many leaps.
        n_leaps: usize,
    },
    /// Neither the file nor a hint tells the rate.
    #[error(
        "The file does not say its frame rate: {fps} is assumed. Say it with --fps (`fps` in the API)."
    )]
    RateAssumed {
        /// Frames a second.
        fps: f64,
    },
    /// Gray of more than 8 bits.
    #[error("Gray levels {from} to {to} of 0 to {most} are used, and are shown as black to white.")]
    GrayStretched {
        /// The level that becomes black.
        from: u16,
        /// The level that becomes white.
        to: u16,
        /// The most that the format can hold.
        most: u16,
    },
}

impl Note {
    /// The stable name.
    pub fn code(&self) -> &'static str {
        match self {
            Note::CutAfterPictures { .. } => "cut_after_pictures",
            Note::TimesLeap { .. } => "times_leap",
            Note::RateAssumed { .. } => "rate_assumed",
            Note::GrayStretched { .. } => "gray_stretched",
        }
    }
}
