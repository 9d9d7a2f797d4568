//! What a file may be and what its decoder may use (RELIABILITY.md, "The gate": the default
//! limits, all settable).

use std::time::Duration;

use super::sandbox::Layers;

/// The limits of one file and of the child processes that read it.
#[derive(Clone, Debug, PartialEq)]
pub struct Limits {
    /// Least side of the picture, pixels.
    pub min_side_px: u32,
    /// Greatest side of the picture, pixels.
    pub max_side_px: u32,
    /// Greatest area of the picture, pixels.
    pub max_pixels: u64,
    /// Fewest frames.
    pub min_frames: usize,
    /// Most frames.
    pub max_frames: usize,
    /// Greatest frame rate, frames a second.
    pub max_fps: f64,
    /// Longest footage, seconds.
    pub max_duration_s: f64,
    /// Largest file, bytes.
    pub max_bytes: u64,
    /// Most streams (video, audio, anything) in one file.
    pub max_streams: u32,
    /// Wall clock for reading a file's headers.
    pub probe_time: Duration,
    /// Wall clock for decoding or encoding: the part that does not depend on the length.
    pub base_time: Duration,
    /// Wall clock for decoding or encoding: the part for each frame.
    pub time_per_frame: Duration,
    /// Longest wait for one frame.
    pub stall_time: Duration,
    /// Address space of a child, bytes.
    pub max_memory_bytes: u64,
    /// Largest file a child may write, bytes.
    pub max_output_bytes: u64,
    /// Decoding threads; 0 = one for each core.
    pub threads: u32,
    /// The layers of the sandbox that a child enters, as far as this machine has them.
    pub layers: Layers,
    /// Accept a file that is cut off inside, up to the cut.
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
    /// Wall clock for `n_frames` frames.
    pub(super) fn work_time(&self, n_frames: usize) -> Duration {
        let n = u32::try_from(n_frames).unwrap_or(u32::MAX);
        self.base_time + self.time_per_frame.saturating_mul(n)
    }
}
