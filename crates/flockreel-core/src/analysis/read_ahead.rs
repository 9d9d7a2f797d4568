//! Reads frames ahead on a separate thread, so that decoding and measuring overlap. Decoding is the slowest
//! stage and must never wait.
//!
//! The queue is bounded in bytes. Reading starts before the background is known, so the first frames are
//! ready when tracking begins. Consumers return the memory of each batch for reuse.

use std::sync::mpsc::{Receiver, Sender, SyncSender, channel, sync_channel};
use std::thread;

use super::memory::BUDGET_BYTES;
use crate::footage::{FrameSource, SourceError};
use crate::raster::Frame;

/// Approximate size of a batch, bytes. Free choice.
const BATCH_BYTES: usize = 4 << 20;
/// Largest number of frames in a batch. Free choice.
const MAX_BATCH_FRAMES: usize = 16;

/// The true time of a frame, seconds from the first frame, and the frame.
pub type TimedFrame = (f64, Frame);

/// The frames of a footage in batches.
pub struct Batches {
    ready: Receiver<Result<Vec<TimedFrame>, SourceError>>,
    used: Sender<Vec<TimedFrame>>,
}

impl Batches {
    /// Returns the next batch, in order and not empty; `None` after the last.
    pub fn next_batch(&self) -> Result<Option<Vec<TimedFrame>>, SourceError> {
        // A closed channel means that the reader has finished.
        self.ready.recv().ok().transpose()
    }

    /// Returns the memory of a batch to the reader.
    pub fn recycle(&self, batch: Vec<TimedFrame>) {
        // A finished reader needs no memory, so a failure is ignored.
        self.used.send(batch).ok();
    }
}

/// Calls `work` while a separate thread reads the footage from its start.
pub fn while_reading<R>(source: &dyn FrameSource, work: impl FnOnce(Batches) -> R) -> R {
    let format = source.format();
    let n_bytes = Frame::n_bytes(format.width, format.height).max(1);
    let n_frames = (BATCH_BYTES / n_bytes).clamp(1, MAX_BATCH_FRAMES);
    let n_waiting = (BUDGET_BYTES / (n_bytes * n_frames)).max(2);
    let (send, ready) = sync_channel(n_waiting);
    let (used, free) = channel();
    thread::scope(|scope| {
        scope.spawn(move || {
            if let Err(error) = read(source, n_frames, &send, &free) {
                // A consumer that no longer listens has its own error.
                send.send(Err(error)).ok();
            }
        });
        work(Batches { ready, used })
    })
}

/// Reads until the footage ends or the consumer stops.
fn read(
    source: &dyn FrameSource,
    n_frames: usize,
    send: &SyncSender<Result<Vec<TimedFrame>, SourceError>>,
    free: &Receiver<Vec<TimedFrame>>,
) -> Result<(), SourceError> {
    let mut stream = source.open()?;
    loop {
        let mut batch = free.try_recv().unwrap_or_default();
        batch.resize_with(n_frames, TimedFrame::default);
        let mut n_read = 0;
        for (time_s, frame) in &mut batch {
            match stream.next_frame(frame)? {
                Some(time) => *time_s = time,
                None => break,
            }
            n_read += 1;
        }
        batch.truncate(n_read);
        let is_last = n_read < n_frames;
        if n_read > 0 && send.send(Ok(batch)).is_err() || is_last {
            return Ok(());
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::code::Code;
    use crate::footage::{FootageFormat, FrameStream};
    use crate::raster::ColorSpec;

    /// Frames that contain their own number, followed by a failure if `fails` is set.
    struct NumberedFrames {
        n_frames: u8,
        fails: bool,
    }

    struct NumberedStream<'a>(&'a NumberedFrames, u8);

    impl FrameSource for NumberedFrames {
        fn format(&self) -> FootageFormat {
            FootageFormat {
                width: 2,
                height: 2,
                fps: 10.0,
                n_frames_hint: usize::from(self.n_frames),
                color: ColorSpec::default(),
            }
        }

        fn open(&self) -> Result<Box<dyn FrameStream + '_>, SourceError> {
            Ok(Box::new(NumberedStream(self, 0)))
        }
    }

    impl FrameStream for NumberedStream<'_> {
        fn next_frame(&mut self, frame: &mut Frame) -> Result<Option<f64>, SourceError> {
            if self.1 == self.0.n_frames {
                let error = SourceError {
                    code: Code::Truncated,
                    cause: "cut off".into(),
                };
                return if self.0.fails { Err(error) } else { Ok(None) };
            }
            frame.planes = vec![self.1; 6];
            self.1 += 1;
            Ok(Some(f64::from(self.1)))
        }
    }

    fn numbers(n_frames: u8, fails: bool) -> (Vec<u8>, bool) {
        while_reading(&NumberedFrames { n_frames, fails }, |batches| {
            let mut seen = Vec::new();
            loop {
                match batches.next_batch() {
                    Ok(Some(batch)) => {
                        seen.extend(batch.iter().map(|(_, frame)| frame.planes[0]));
                        batches.recycle(batch);
                    }
                    Ok(None) => return (seen, false),
                    Err(_) => return (seen, true),
                }
            }
        })
    }

    #[test]
    fn every_frame_comes_once_and_in_order() {
        for n_frames in [0, 1, 15, 16, 17, 200] {
            assert_eq!(numbers(n_frames, false), ((0..n_frames).collect(), false));
        }
    }

    #[test]
    fn a_failure_follows_all_complete_batches() {
        assert_eq!(numbers(40, true), ((0..32).collect(), true));
    }

    #[test]
    fn the_reader_ends_when_the_consumer_stops() {
        let source = NumberedFrames {
            n_frames: 250,
            fails: false,
        };
        assert_eq!(while_reading(&source, |_| 7), 7);
    }
}
