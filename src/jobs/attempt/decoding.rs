//! A video source that measures decoding for the metrics: number of frames and time.

use std::time::{Duration, Instant};

use super::Reporter;
use flockreel_core::footage::{FootageFormat, FrameSource, FrameStream, SourceError, Visit};
use flockreel_core::raster::Frame;

/// A video source that reports its frames and its reading time.
pub(in crate::jobs) struct Counted<'a, S: ?Sized> {
    source: &'a S,
    reporter: &'a Reporter,
}

impl<'a, S: FrameSource + ?Sized> Counted<'a, S> {
    pub(in crate::jobs) fn new(source: &'a S, reporter: &'a Reporter) -> Counted<'a, S> {
        Counted { source, reporter }
    }
}

impl<S: FrameSource + ?Sized> FrameSource for Counted<'_, S> {
    fn format(&self) -> FootageFormat {
        self.source.format()
    }

    fn open(&self) -> Result<Box<dyn FrameStream + '_>, SourceError> {
        Ok(Box::new(CountedStream {
            stream: self.source.open()?,
            reporter: self.reporter,
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
    reporter: &'a Reporter,
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
        self.reporter.count_decoded(self.n_frames, self.took);
    }
}
