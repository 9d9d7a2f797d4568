//! Measurement of the range of gray levels that a film uses, for gray of more than 8 bits.

use super::wanted::Wanted;
use super::{Film, MOST_SKIPPED};
use crate::footage::spread_idx;
use crate::media::error::Error;
use crate::media::gate::{Child, Order};
use crate::media::stretch::{LEAST_FRAMES, Stretch};
use crate::media::tools::Tool;

impl Film {
    /// Decodes frames spread over the film and returns the range of gray levels that they use.
    pub(super) fn measure_gray(&self) -> Result<Stretch, Error> {
        let (probe, n_pictures) = (&self.probe, self.probe.n_pictures);
        // More frames for longer films, because a child that outputs nothing for long counts as stalled.
        let n_frames = LEAST_FRAMES.max(n_pictures / MOST_SKIPPED);
        let wanted = Wanted::Numbers(spread_idx(n_pictures, n_frames));
        let size = format!("scale={}:{}:flags=neighbor", probe.width, probe.height);
        let chosen = wanted.filter().into_iter().chain([size]);
        let filters: Vec<String> = chosen.chain(["format=gray16le".to_owned()]).collect();
        let args = self.args(&wanted, &filters.join(","));
        let order = Order::new(Tool::Ffmpeg, args, &self.limits, n_pictures).with_input(&self.path);
        let mut child = Child::reading(order)?;
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
        Ok(Stretch::of(&counts))
    }
}
