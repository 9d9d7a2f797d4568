//! Errors of reading and writing video: one variant per reason, each with its stable code
//! (docs/explanation/promises.md, "Bad input").

use std::io;

use flockreel_core::code::Code;
use flockreel_core::footage::SourceError;

/// How to make an index. Converters need one.
const REPAIR: &str = "use the repair function of the camera, or the program untrunc with a complete film of the same \
                      camera";

/// How to keep the pictures that can be read.
const KEEP: &str = "keep the rest with `ffmpeg -i film -an -c:v libx264 -crf 16 rest.mp4`";

/// The missing part of a damaged film, and what to do without a complete copy.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum Damage {
    /// The index that locates the pictures is missing.
    #[error(
        "the index is missing, as after a recording that was not finished, and no program finds the pictures without it: \
         {}",
        REPAIR
    )]
    NoIndex,
    /// The index that locates the pictures is incomplete or points beyond the end of the file.
    #[error("the index is damaged, so pictures cannot be found: {}", REPAIR)]
    BrokenIndex,
    /// The file ends before its own structure does.
    #[error(
        "the pictures end after {span_s:.1} s, at picture {n_pictures}: {}",
        KEEP
    )]
    EndsAt {
        /// Number of pictures found.
        n_pictures: usize,
        /// Time from the first to the last picture, seconds.
        span_s: f64,
    },
    /// Some pictures cannot be decoded.
    #[error("only {n_decoded} of {n_pictures} pictures can be decoded: {}", KEEP)]
    Undecodable {
        /// Number of decoded pictures.
        n_decoded: usize,
        /// Number of pictures in the file.
        n_pictures: usize,
    },
}

/// A reason to fail. `stderr_tail` is the end of ffmpeg's stderr, for the log.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// Not a video: empty, text, a still image, a playlist or noise.
    #[error("not a video: {0}")]
    NotAVideo(String),
    /// The container is not on the allow-list.
    #[error("the container format is not supported: {0}")]
    ContainerNotAllowed(&'static str),
    /// The codec is not on the allow-list.
    #[error("the video codec is not supported: {0}")]
    CodecNotAllowed(String),
    /// The file holds only audio, subtitles or data.
    #[error("the file holds no video stream")]
    NoVideoStream,
    /// A side or the area of the picture exceeds the limit.
    #[error("the picture is too large: {width}x{height}")]
    TooManyPixels {
        /// Width, pixels.
        width: u64,
        /// Height, pixels.
        height: u64,
    },
    /// A side of the picture is below the limit.
    #[error("the picture is too small: {width}x{height}")]
    TooFewPixels {
        /// Width, pixels.
        width: u64,
        /// Height, pixels.
        height: u64,
    },
    /// The pictures have different sizes.
    #[error(
        "the pictures differ in size: picture {number} is shown with {}x{} pixels, the first with {}x{}: scale, crop or \
         turn them to one size",
        found[0], found[1], first[0], first[1]
    )]
    PicturesDiffer {
        /// Number of the first picture that differs, counted from 1.
        number: usize,
        /// Its width and height, pixels.
        found: [u32; 2],
        /// Width and height of the first picture, pixels.
        first: [u32; 2],
    },
    /// The number of frames exceeds the limit.
    #[error("the footage has more frames than the limit: {limit}")]
    TooManyFrames {
        /// The limit.
        limit: usize,
    },
    /// The number of frames is below the limit.
    #[error("the footage has too few frames: {n_frames}")]
    TooFewFrames {
        /// Number of frames.
        n_frames: usize,
    },
    /// The number of streams exceeds the limit.
    #[error("the file holds more streams than the limit: {limit}")]
    TooManyStreams {
        /// The limit.
        limit: u32,
    },
    /// The duration or the file size exceeds the limit.
    #[error("the footage is too long: {found} {unit}")]
    TooLong {
        /// Duration or size.
        found: f64,
        /// Unit of `found`: `s` or `bytes`.
        unit: &'static str,
    },
    /// The frame rate exceeds the limit.
    #[error("the frame rate is too high: {fps}")]
    TooFast {
        /// Frame rate, frames per second.
        fps: f64,
    },
    /// The file is cut off or damaged.
    #[error("the file is cut off or damaged: {0}")]
    Truncated(Damage),
    /// The video is encrypted.
    #[error("the video is encrypted")]
    Encrypted,
    /// A time limit was exceeded: wall clock, waiting for a frame, or processor time.
    #[error("ffmpeg or ffprobe exceeded its time limit")]
    TimeLimit,
    /// The child ran out of address space.
    #[error("ffmpeg or ffprobe exceeded its memory limit: {stderr_tail}")]
    MemoryLimit {
        /// The end of ffmpeg's stderr.
        stderr_tail: String,
    },
    /// Someone else killed the child: an operator, or the kernel when the memory of the machine ran out.
    #[error(
        "ffmpeg or ffprobe was killed from outside, probably because the machine ran out of memory"
    )]
    Killed,
    /// The child died or failed.
    #[error("ffmpeg or ffprobe stopped unexpectedly ({status}): {stderr_tail}")]
    Crashed {
        /// Exit code or signal.
        status: String,
        /// The end of ffmpeg's stderr.
        stderr_tail: String,
    },
    /// The disk is full.
    #[error("the disk has too little free space for the output")]
    StorageFull,
    /// The encoder was given a frame of the wrong size, or an invalid size or rate.
    #[error("the encoder does not accept this input: {0}")]
    BadOutput(&'static str),
    /// ffmpeg is not installed or does not run.
    #[error("a required program is missing or does not run: {0}")]
    ToolMissing(String),
    /// `--sandbox strict` is set and a layer is missing.
    #[error(
        "`--sandbox strict` needs all layers of the sandbox, and one is missing: {layer}: {reason}"
    )]
    SandboxIncomplete {
        /// The first missing layer.
        layer: &'static str,
        /// Why it is missing.
        reason: String,
    },
    /// A file or pipe operation failed.
    #[error("{doing}: {source}")]
    Io {
        /// The operation.
        doing: &'static str,
        /// The underlying error.
        source: io::Error,
    },
}

impl Error {
    /// Returns the stable code.
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
            Error::MemoryLimit { .. } | Error::Killed => Code::MemoryLimit,
            Error::Crashed { .. } => Code::DecoderCrashed,
            Error::StorageFull => Code::StorageFull,
            Error::BadOutput(_)
            | Error::ToolMissing(_)
            | Error::SandboxIncomplete { .. }
            | Error::Io { .. } => Code::Internal,
        }
    }

    /// Wraps an I/O error; a full disk becomes `StorageFull`.
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
