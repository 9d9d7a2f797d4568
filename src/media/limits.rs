//! Limits of an input file and of the resources of its decoder (docs/explanation/promises.md, "Bad input").

use std::time::Duration;

use super::error::Error;
use super::sandbox::Layers;

/// The limits of one file and of the child processes that read it.
#[derive(Clone, Debug, PartialEq)]
pub struct Limits {
    /// Smallest side of the picture, pixels.
    pub min_side_px: u32,
    /// Largest side of the picture, pixels.
    pub max_side_px: u32,
    /// Largest area of the picture, pixels.
    pub max_pixels: u64,
    /// Smallest number of frames.
    pub min_frames: usize,
    /// Largest number of frames.
    pub max_frames: usize,
    /// Highest frame rate, frames per second.
    pub max_fps: f64,
    /// Longest duration of the footage, seconds.
    pub max_duration_s: f64,
    /// Largest file, bytes.
    pub max_bytes: u64,
    /// Largest number of streams (video, audio and others) in one file.
    pub max_streams: u32,
    /// Time limit for reading the headers of a file, wall clock.
    pub probe_time: Duration,
    /// Time limit for decoding or encoding, wall clock: the part independent of the length.
    pub base_time: Duration,
    /// Time limit for decoding or encoding, wall clock: the part per frame.
    pub time_per_frame: Duration,
    /// Longest wait for one frame.
    pub stall_time: Duration,
    /// Address space of a child, bytes.
    pub max_memory_bytes: u64,
    /// Largest file that a child may write, bytes.
    pub max_output_bytes: u64,
    /// Maximum number of decoding threads; 0 means the number of cores.
    pub threads: u32,
    /// Layers of the sandbox that a child enters, if this machine supports them.
    pub layers: Layers,
    /// Whether to accept a file that is cut off, up to the cut.
    pub allow_truncated: bool,
}

impl Default for Limits {
    fn default() -> Limits {
        Limits {
            min_side_px: 16,
            max_side_px: 8192,
            max_pixels: 3840 * 2160,
            min_frames: 2,
            max_frames: 216_000,
            max_fps: 1000.0,
            max_duration_s: 3600.0,
            max_bytes: 4 << 30,
            max_streams: 32,
            probe_time: Duration::from_secs(10),
            base_time: Duration::from_secs(60),
            time_per_frame: Duration::from_millis(100),
            stall_time: Duration::from_secs(30),
            max_memory_bytes: 4 << 30,
            max_output_bytes: 16 << 30,
            threads: 0,
            layers: Layers::ALL,
            allow_truncated: false,
        }
    }
}

impl Limits {
    /// Checks the size of a picture, pixels.
    pub(super) fn check_size(&self, width: u64, height: u64) -> Result<(), Error> {
        let is_too_large = width.max(height) > u64::from(self.max_side_px)
            || width.saturating_mul(height) > self.max_pixels;
        if is_too_large {
            return Err(Error::TooManyPixels { width, height });
        }
        if width.min(height) < u64::from(self.min_side_px) {
            return Err(Error::TooFewPixels { width, height });
        }
        Ok(())
    }

    /// Checks that there are not too many frames.
    pub(super) fn check_n_frames(&self, n_frames: usize) -> Result<(), Error> {
        if n_frames > self.max_frames {
            return Err(Error::TooManyFrames {
                limit: self.max_frames,
            });
        }
        Ok(())
    }

    /// Checks that there are not too many streams.
    pub(super) fn check_n_streams(&self, n_streams: usize) -> Result<(), Error> {
        if n_streams > self.max_streams as usize {
            return Err(Error::TooManyStreams {
                limit: self.max_streams,
            });
        }
        Ok(())
    }

    /// Checks the size of a file, bytes.
    pub(super) fn check_n_bytes(&self, n_bytes: u64) -> Result<(), Error> {
        check_n_bytes(n_bytes, self.max_bytes)
    }

    /// Checks the size of a file with one picture, bytes.
    pub(super) fn check_picture_bytes(&self, n_bytes: u64) -> Result<(), Error> {
        check_n_bytes(n_bytes, self.max_picture_bytes())
    }

    /// Returns the largest accepted file with one picture, bytes: more than any encoder needs for the largest
    /// picture.
    pub(super) fn max_picture_bytes(&self) -> u64 {
        self.max_pixels * 8 + (1 << 20)
    }

    /// Returns the time limit for `n_frames` frames, wall clock.
    pub(super) fn work_time(&self, n_frames: usize) -> Duration {
        let n = u32::try_from(n_frames).unwrap_or(u32::MAX);
        self.base_time + self.time_per_frame.saturating_mul(n)
    }
}

fn check_n_bytes(n_bytes: u64, limit: u64) -> Result<(), Error> {
    if n_bytes > limit {
        return Err(Error::TooLong {
            found: n_bytes as f64,
            unit: "bytes",
        });
    }
    Ok(())
}
