//! Notices about accepted footage: assumptions, and faults of the file that were corrected.

/// One notice. It prints as a sentence.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum Notice {
    /// The file is cut off after its last picture.
    #[error(
        "The file is cut off after its last picture, so only sound or the index is incomplete. All {n_pictures} \
         pictures are readable."
    )]
    CutAfterPictures {
        /// Number of pictures found.
        n_pictures: usize,
    },
    /// The index of another track than that of the pictures is damaged.
    #[error(
        "The index of the sound or of another track is damaged, but all {n_pictures} pictures are readable: copy the \
         file again if the film should have sound."
    )]
    IndexDamaged {
        /// Number of pictures found.
        n_pictures: usize,
    },
    /// The recorder's clock was set, or the recording paused.
    #[error(
        "The timestamps of the file jump {n_leaps} times, first by {by_s:.1} s at {at_s:.1} s. The pictures are \
         assumed to follow each other at the usual rate. If the recording paused there, cut the film there."
    )]
    TimesLeap {
        /// Time of the first leap, seconds from the first picture.
        at_s: f64,
        /// Size of the first leap, seconds.
        by_s: f64,
        /// Number of leaps.
        n_leaps: usize,
    },
    /// Neither the file nor the user gives the frame rate.
    #[error(
        "The file does not state its frame rate, so {fps} frames per second are assumed. Set the rate with --fps \
         (`fps` in the API)."
    )]
    RateAssumed {
        /// Assumed frame rate, frames per second.
        fps: f64,
    },
    /// The film is HDR. ffmpeg's tone mapping computes in floating point, with other bytes on other processors, so it is
    /// left to the user.
    #[error(
        "The film is HDR ({transfer}), and its colors look pale. This does not harm the measurement. For flocks with true \
         colors convert the film: `ffmpeg -i film -an -vf zscale=t=linear:npl=100,format=gbrpf32le,zscale=p=bt709,\
         tonemap=hable,zscale=t=bt709:m=bt709:r=tv,format=yuv420p -c:v libx264 -crf 16 sdr.mp4`."
    )]
    HighDynamicRange {
        /// The standard.
        transfer: &'static str,
    },
    /// Gray of more than 8 bits was reduced to 8 bits.
    #[error(
        "The pictures use gray levels {black} to {white} of 0 to {max}. These levels were stretched to black and white."
    )]
    GrayStretched {
        /// Level that becomes black.
        black: u16,
        /// Level that becomes white.
        white: u16,
        /// Highest level of the format.
        max: u16,
    },
}

impl Notice {
    /// Returns the stable name.
    pub fn code(&self) -> &'static str {
        match self {
            Notice::CutAfterPictures { .. } => "cut_after_pictures",
            Notice::IndexDamaged { .. } => "index_damaged",
            Notice::TimesLeap { .. } => "times_leap",
            Notice::RateAssumed { .. } => "rate_assumed",
            Notice::HighDynamicRange { .. } => "high_dynamic_range",
            Notice::GrayStretched { .. } => "gray_stretched",
        }
    }
}
