//! Limits of an input file and of the resources of its decoder (docs/explanation/promises.md, "Bad input").

use std::time::Duration;

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
    /// Returns the time limit for `n_frames` frames, wall clock.
    pub(super) fn work_time(&self, n_frames: usize) -> Duration {
        let n = u32::try_from(n_frames).unwrap_or(u32::MAX);
        self.base_time + self.time_per_frame.saturating_mul(n)
    }
}
