//! Notes about accepted footage: assumptions, and faults of the file that were corrected.

/// One note. It prints as a sentence.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum Note {
    /// The file is cut off after its last picture.
    #[error(
        "The file is cut off after its last picture: what is missing belongs to its sound or its index. All \
         {n_pictures} pictures are there."
    )]
    CutAfterPictures {
        /// Number of pictures found.
        n_pictures: usize,
    },
    /// The recorder's clock was set, or the recording paused.
    #[error(
        "The times in the file leap, first by {by_s:.1} s at {at_s:.1} s ({n_leaps} in all): the pictures are \
         taken to follow each other at the usual rate. If the recording paused there, cut it there."
    )]
    TimesLeap {
        /// Time of the first leap, seconds from the first picture.
        at_s: f64,
        /// Size of the first leap, seconds.
        by_s: f64,
        /// Number of leaps.
        n_leaps: usize,
    },
    /// Neither the file nor a hint gives the frame rate.
    #[error(
        "The file does not say its frame rate: {fps} is assumed. Say it with --fps (`fps` in the API)."
    )]
    RateAssumed {
        /// Assumed frame rate, frames per second.
        fps: f64,
    },
    /// Gray of more than 8 bits was reduced to 8 bits.
    #[error("Gray levels {from} to {to} of 0 to {most} are used, and are shown as black to white.")]
    GrayStretched {
        /// Level that becomes black.
        from: u16,
        /// Level that becomes white.
        to: u16,
        /// Highest level of the format.
        most: u16,
    },
}

impl Note {
    /// Returns the stable name.
    pub fn code(&self) -> &'static str {
        match self {
            Note::CutAfterPictures { .. } => "cut_after_pictures",
            Note::TimesLeap { .. } => "times_leap",
            Note::RateAssumed { .. } => "rate_assumed",
            Note::GrayStretched { .. } => "gray_stretched",
        }
    }
}
