//! Why a video cannot be read or written: one variant a reason, each with its stable code
//! (RELIABILITY.md, "Reason codes").

use std::io;

use crate::code::Code;
use crate::footage::SourceError;

/// What of a film is missing.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum Damage {
    /// Nothing says where its pictures lie.
    #[error("it has no index")]
    NoIndex,
    /// It goes on past its end, by its own structure.
    #[error("its pictures end after {span_s:.1} s, with number {n_pictures}")]
    EndsAt {
        /// Pictures found.
        n_pictures: usize,
        /// From the first of them to the last, seconds.
        span_s: f64,
    },
    /// Pictures that cannot be decoded.
    #[error("{n_decoded} of {n_pictures} pictures can be decoded")]
    Undecodable {
        /// Pictures decoded.
        n_decoded: usize,
        /// Pictures found.
        n_pictures: usize,
    },
}

/// The reasons. `complaint` is the end of what ffmpeg said, for the log.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// Empty, text, a still image, a playlist, noise.
    #[error("not a video: {0}")]
    NotAVideo(String),
    /// A container outside the list.
    #[error("the container is not among those accepted: {0}")]
    ContainerNotAllowed(&'static str),
    /// A codec outside the list.
    #[error("the codec is not among those accepted: {0}")]
    CodecNotAllowed(String),
    /// Sound, subtitles, data: no picture.
    #[error("the file holds no video stream")]
    NoVideoStream,
    /// Wider, higher or larger than the limit.
    #[error("the picture is too large: {width}x{height}")]
    TooManyPixels {
        /// Columns.
        width: u64,
        /// Rows.
        height: u64,
    },
    /// Narrower or lower than the limit.
    #[error("the picture is too small: {width}x{height}")]
    TooFewPixels {
        /// Columns.
        width: u64,
        /// Rows.
        height: u64,
    },
    /// Pictures of several sizes.
    #[error(
        "the pictures differ in size: number {number} is {}x{}, the first {}x{}",
        found[0], found[1], first[0], first[1]
    )]
    PicturesDiffer {
        /// The first that differs, counted from 1.
        number: usize,
        /// Its columns and rows.
        found: [u32; 2],
        /// Columns and rows of the first.
        first: [u32; 2],
    },
    /// More frames than the limit.
    #[error("the footage has more frames than the limit: {limit}")]
    TooManyFrames {
        /// The limit.
        limit: usize,
    },
    /// Fewer frames than the limit.
    #[error("the footage has too few frames: {n_frames}")]
    TooFewFrames {
        /// Frames found.
        n_frames: usize,
    },
    /// More streams than the limit.
    #[error("the file holds more streams than the limit: {limit}")]
    TooManyStreams {
        /// The limit.
        limit: u32,
    },
    /// Longer than the limit, in seconds or in bytes.
    #[error("the footage is too long: {found} {unit}")]
    TooLong {
        /// How long.
        found: f64,
        /// In what: `s` or `bytes`.
        unit: &'static str,
    },
    /// A frame rate above the limit.
    #[error("the frame rate is too high: {fps}")]
    TooFast {
        /// Frames a second.
        fps: f64,
    },
    /// Ends inside its own structure, or damaged inside.
    #[error("the file is cut off or damaged: {0}")]
    Truncated(Damage),
    /// Encrypted samples.
    #[error("the video is encrypted")]
    Encrypted,
    /// The wall clock, the wait for a frame, or the processor time ran out.
    #[error("the media tool took longer than its time limit")]
    TimeLimit,
    /// The address space ran out.
    #[error("the media tool needed more memory than its limit: {complaint}")]
    MemoryLimit {
        /// ffmpeg's last words.
        complaint: String,
    },
    /// The child died or gave up.
    #[error("the media tool stopped unexpectedly ({status}): {complaint}")]
    Crashed {
        /// Exit code or signal.
        status: String,
        /// ffmpeg's last words.
        complaint: String,
    },
    /// No room for the output.
    #[error("there is no room left for the output")]
    StorageFull,
    /// A frame of another size than the video that it is written to, or a rate that is none.
    #[error("the encoder was given what it cannot take: {0}")]
    BadOutput(&'static str),
    /// ffmpeg is not installed, or does not run.
    #[error("the media tool is not installed: {0}")]
    ToolMissing(String),
    /// `--sandbox strict` was asked for, and a layer is missing.
    #[error("the sandbox is not whole, as `--sandbox strict` demands: {layer}: {reason}")]
    SandboxIncomplete {
        /// The first layer that is missing.
        layer: &'static str,
        /// Why.
        reason: String,
    },
    /// A file or pipe of ours failed.
    #[error("{doing}: {source}")]
    Io {
        /// What was being done.
        doing: &'static str,
        /// Why it failed.
        source: io::Error,
    },
}

impl Error {
    /// The stable code.
    pub fn code(&self) -> Code {
        match self {
            Error::NotAVideo(_) | Error::PicturesDiffer { .. } => Code::NotAVideo,
            Error::ContainerNotAllowed(_) => Code::ContainerNotAllowed,
            Error::CodecNotAllowed(_) => Code::CodecNotAllowed,
            Error::NoVideoStream => Code::NoVideoStream,
            Error::TooManyPixels { .. } => Code::TooManyPixels,
            Error::TooFewPixels { .. } => Code::TooFewPixels,
            Error::TooManyFrames { .. } => Code::TooManyFrames,
            Error::TooFewFrames { .. } => Code::TooFewFrames,
            Error::TooManyStreams { .. } => Code::TooManyStreams,
            Error::TooLong { .. } => Code::TooLong,
            Error::TooFast { .. } => Code::TooFast,
            Error::Truncated(_) => Code::Truncated,
            Error::Encrypted => Code::Encrypted,
            Error::TimeLimit => Code::TimeLimit,
            Error::MemoryLimit { .. } => Code::MemoryLimit,
            Error::Crashed { .. } => Code::DecoderCrashed,
            Error::StorageFull => Code::StorageFull,
            Error::BadOutput(_)
            | Error::ToolMissing(_)
            | Error::SandboxIncomplete { .. }
            | Error::Io { .. } => Code::Internal,
        }
    }

    /// Wraps a failure of ours; a full disk keeps its own reason.
    pub(super) fn io(doing: &'static str) -> impl Fn(io::Error) -> Error {
        move |source| match source.kind() {
            io::ErrorKind::StorageFull | io::ErrorKind::QuotaExceeded => Error::StorageFull,
            _ => Error::Io { doing, source },
        }
    }
}

impl From<Error> for SourceError {
    fn from(error: Error) -> SourceError {
        SourceError {
            code: error.code(),
            cause: Box::new(error),
        }
    }
}
