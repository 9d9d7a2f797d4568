//! Measurement of the range of gray levels that a film uses, for gray of more than 8 bits.

use super::selection::FrameSelection;
use super::{Film, MAX_SKIPPED_FRAMES};
use crate::media::error::Error;
use crate::media::gray_range::{GrayRange, MIN_SAMPLED_FRAMES};
use flockreel_core::footage::spread_idx;

impl Film {
    /// Decodes frames spread over the film and returns the range of gray levels that they use.
    pub(super) fn measure_gray(&self) -> Result<GrayRange, Error> {
        let (probe, n_pictures) = (&self.probe, self.probe.n_pictures);
        // More frames for longer films, because a child that outputs nothing for long counts as stalled.
        let n_frames = MIN_SAMPLED_FRAMES.max(n_pictures / MAX_SKIPPED_FRAMES);
        let selection = FrameSelection::Indices(spread_idx(n_pictures, n_frames));
        let size = format!("scale={}:{}:flags=neighbor", probe.width, probe.height);
        let chosen = selection.filter().into_iter().chain([size]);
        let filters: Vec<String> = chosen.chain(["format=gray16le".to_owned()]).collect();
        let mut child = self.start_decoder(&selection, &filters.join(","))?;
        let mut picture = vec![0; 2 * probe.width as usize * probe.height as usize];
        let mut counts = vec![0_u64; 1 << 16];
        for _ in 0..n_frames {
            if child.read_full(&mut picture)? < picture.len() {
                break;
            }
            for pixel in picture.chunks_exact(2) {
                counts[usize::from(u16::from_le_bytes([pixel[0], pixel[1]]))] += 1;
            }
        }
        Ok(GrayRange::from_histogram(&counts))
    }
}
