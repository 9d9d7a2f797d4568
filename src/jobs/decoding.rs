//! A video source that measures decoding for the metrics: number of frames and time.

use std::time::{Duration, Instant};

use super::Listener;
use flockreel_core::footage::{FootageFormat, FrameSource, FrameStream, SourceError, Visit};
use flockreel_core::raster::Frame;

/// A video source that reports its frames and its reading time to the listener.
pub(super) struct Counted<'a, S: ?Sized> {
    source: &'a S,
    listener: &'a Listener,
}

impl<'a, S: FrameSource + ?Sized> Counted<'a, S> {
    pub(super) fn new(source: &'a S, listener: &'a Listener) -> Counted<'a, S> {
        Counted { source, listener }
    }
}

impl<S: FrameSource + ?Sized> FrameSource for Counted<'_, S> {
    fn format(&self) -> FootageFormat {
        self.source.format()
    }

    fn open(&self) -> Result<Box<dyn FrameStream + '_>, SourceError> {
        Ok(Box::new(CountedStream {
            stream: self.source.open()?,
            listener: self.listener,
            n_frames: 0,
            took: Duration::ZERO,
        }))
    }

    fn spread(&self, n: usize, visit: &mut Visit<'_>) -> Result<(), SourceError> {
        self.source.spread(n, visit)
    }
}

struct CountedStream<'a> {
    stream: Box<dyn FrameStream + 'a>,
    listener: &'a Listener,
    n_frames: u64,
    took: Duration,
}

impl FrameStream for CountedStream<'_> {
    fn next_frame(&mut self, frame: &mut Frame) -> Result<Option<f64>, SourceError> {
        let start = Instant::now();
        let next = self.stream.next_frame(frame);
        self.took += start.elapsed();
        self.n_frames += u64::from(matches!(next, Ok(Some(_))));
        next
    }
}

impl Drop for CountedStream<'_> {
    fn drop(&mut self) {
        self.listener.count_decoded(self.n_frames, self.took);
    }
}
