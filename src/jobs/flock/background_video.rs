//! A video as the background of a flock, repeated if it is shorter than the flock
//! (docs/explanation/algorithms.md, "Compositing"). Its frames are chosen by time, so the two frame rates may
//! differ.

use crate::jobs::Error;
use flockreel_core::flock::Shot;
use flockreel_core::footage::{FrameSource, FrameStream};
use flockreel_core::raster::Frame;

/// A background video that is read along with the flock.
pub(super) struct BackgroundVideo<'a> {
    source: &'a dyn FrameSource,
    stream: Box<dyn FrameStream + 'a>,
    /// Frames of the video per frame of the flock.
    step: f64,
    /// Number of frames read so far, repetitions included.
    n_read: usize,
    frame: Frame,
}

impl<'a> BackgroundVideo<'a> {
    /// Opens the video for a flock with `fps` frames per second.
    pub(super) fn open(
        source: &'a dyn FrameSource,
        fps: f64,
    ) -> Result<BackgroundVideo<'a>, Error> {
        Ok(BackgroundVideo {
            source,
            stream: source.open()?,
            step: source.format().fps / fps,
            n_read: 0,
            frame: Frame::default(),
        })
    }

    /// Sets the background of a shot. `frame_idx` must not decrease from call to call.
    pub(super) fn draw(&mut self, frame_idx: usize, shot: &mut Shot) -> Result<(), Error> {
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
