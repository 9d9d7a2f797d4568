//! Another film behind a flock: its frames at the flock's own times, over and over (ALGORITHMS.md 8).

use crate::flock::Shot;
use crate::footage::{FrameSource, FrameStream};
use crate::jobs::Error;
use crate::raster::Frame;

/// A film that is read along with the flock.
pub(super) struct Behind<'a> {
    source: &'a dyn FrameSource,
    stream: Box<dyn FrameStream + 'a>,
    /// Frames of it to a frame of the flock.
    step: f64,
    /// Frames read since the beginning, those of earlier rounds too.
    n_read: usize,
    frame: Frame,
}

impl<'a> Behind<'a> {
    /// Opens the film, for a flock of so many frames a second.
    pub(super) fn of(source: &'a dyn FrameSource, fps: f64) -> Result<Behind<'a>, Error> {
        Ok(Behind {
            source,
            stream: source.open()?,
            step: source.format().fps / fps,
            n_read: 0,
            frame: Frame::default(),
        })
    }

    /// Gives a shot the frame that lies behind it. Shots come in order.
    pub(super) fn at(&mut self, frame_idx: usize, shot: &mut Shot) -> Result<(), Error> {
        let wanted = (frame_idx as f64 * self.step) as usize;
        while self.n_read <= wanted {
            if self.stream.next_frame(&mut self.frame)?.is_none() {
                self.stream = self.source.open()?;
                if self.stream.next_frame(&mut self.frame)?.is_none() {
                    break;
                }
            }
            self.n_read += 1;
        }
        shot.behind.clone_from(&self.frame);
        Ok(())
    }
}
