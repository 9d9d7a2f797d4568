//! Posters: `poster.jpg`, one frame that stands for a film in lists. That of footage is made before it is measured, and
//! may not show the animal. That of a library does.

use std::collections::BTreeMap;
use std::path::Path;
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use crate::jobs::Error;
use crate::media;
use crate::store::footage::POSTER;
use flockreel_core::footage::{
    FootageFormat, FrameSource, FrameStream, Part, SourceError, Visit, spread_idx,
};
use flockreel_core::formats::evidence::small_jpeg;
use flockreel_core::library::Poses;
use flockreel_core::raster::Frame;

/// Last frame that may be the poster of footage. A film cannot be read from its middle. Free choice.
const MAX_POSTER_FRAME: usize = 30;
/// Time after which an upload looks for no later frame. Free choice.
pub(in crate::jobs) const MAX_POSTER_TIME: Duration = Duration::from_secs(10);
/// Number of frames that may become the poster of a library. Free choice; each costs the time of a small JPEG.
const N_GLIMPSES: usize = 9;

/// Writes a frame as `poster.jpg` into a folder: the middle one, or an earlier one of long footage.
pub(in crate::jobs) fn write_poster(source: &dyn FrameSource, folder: &Path) -> Result<(), Error> {
    let format = source.format();
    let wanted = (format.n_frames_hint / 2).min(MAX_POSTER_FRAME);
    let begin = Instant::now();
    let (mut stream, mut frame, mut n_read) = (source.open()?, Frame::default(), 0);
    while n_read <= wanted
        && begin.elapsed() < MAX_POSTER_TIME
        && stream.next_frame(&mut frame)?.is_some()
    {
        n_read += 1;
    }
    if n_read == 0 {
        return Err(media::Error::TooFewFrames { n_frames: 0 }.into());
    }
    Ok(std::fs::write(folder.join(POSTER), small_jpeg(&frame))?)
}

/// A video source that keeps small pictures of a few frames while the whole film is read. The poster of a library is one
/// of them, so no frame is decoded again for it.
pub(in crate::jobs) struct Glimpses<'a> {
    source: &'a dyn FrameSource,
    /// Indices of the frames to keep.
    wanted: Vec<usize>,
    /// JPEGs by index of the frame.
    kept: Mutex<BTreeMap<usize, Vec<u8>>>,
}

impl<'a> Glimpses<'a> {
    /// Keeps frames spread over the part from `from_s` to `to_s`, seconds.
    pub(in crate::jobs) fn new(
        source: &'a dyn FrameSource,
        from_s: Option<f64>,
        to_s: Option<f64>,
    ) -> Glimpses<'a> {
        let part = Part::new(source, from_s, to_s);
        let first = part.first_frame();
        let spread = spread_idx(part.format().n_frames_hint, N_GLIMPSES);
        // The first frame exists even if the estimated length of the film is wrong.
        let wanted = [0].into_iter().chain(spread).map(|idx| first + idx);
        Glimpses {
            source,
            wanted: wanted.collect(),
            kept: Mutex::default(),
        }
    }

    /// Writes `poster.jpg` into a folder. No frame is the poster of a film that had none.
    pub(in crate::jobs) fn write_poster(&self, poses: &Poses, folder: &Path) -> Result<(), Error> {
        let frames = poses.frames.iter().enumerate();
        let shown = frames.filter(|(_, pose)| pose.detected());
        let shown: Vec<usize> = shown.map(|(idx, _)| idx).collect();
        match self
            .poster_idx(&shown)
            .and_then(|idx| self.kept().remove(&idx))
        {
            Some(jpeg) => Ok(std::fs::write(folder.join(POSTER), jpeg)?),
            None => Ok(()),
        }
    }

    /// Returns which of the kept frames is the poster, given the increasing indices of those that show the animal: it
    /// shows the animal if any kept frame does, and is near the middle of `shown`.
    fn poster_idx(&self, shown: &[usize]) -> Option<usize> {
        let middle = shown.get(shown.len() / 2).copied().unwrap_or(0);
        let lacks_animal = |idx: usize| shown.binary_search(&idx).is_err();
        let kept = self.kept();
        let best = kept
            .keys()
            .min_by_key(|&&idx| (lacks_animal(idx), idx.abs_diff(middle)));
        best.copied()
    }

    fn kept(&self) -> MutexGuard<'_, BTreeMap<usize, Vec<u8>>> {
        self.kept.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl FrameSource for Glimpses<'_> {
    fn format(&self) -> FootageFormat {
        self.source.format()
    }

    fn open(&self) -> Result<Box<dyn FrameStream + '_>, SourceError> {
        Ok(Box::new(GlimpsesStream {
            stream: self.source.open()?,
            glimpses: self,
            n_read: 0,
        }))
    }

    fn spread(&self, n: usize, visit: &mut Visit<'_>) -> Result<(), SourceError> {
        self.source.spread(n, visit)
    }
}

struct GlimpsesStream<'a> {
    stream: Box<dyn FrameStream + 'a>,
    glimpses: &'a Glimpses<'a>,
    n_read: usize,
}

impl FrameStream for GlimpsesStream<'_> {
    fn next_frame(&mut self, frame: &mut Frame) -> Result<Option<f64>, SourceError> {
        let next = self.stream.next_frame(frame)?;
        if next.is_some() {
            if self.glimpses.wanted.contains(&self.n_read) {
                let mut kept = self.glimpses.kept();
                kept.entry(self.n_read).or_insert_with(|| small_jpeg(frame));
            }
            self.n_read += 1;
        }
        Ok(next)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use flockreel_core::fish::sample::{SampleFilm, SampleParams};

    #[test]
    fn poster_shows_the_animal_near_the_middle_of_its_frames() {
        let params = SampleParams {
            n_frames: 90,
            width: 64,
            height: 64,
            ..SampleParams::default()
        };
        let fps = params.fps;
        let film = SampleFilm::new(params).unwrap();
        let all = Glimpses::new(&film, None, None);
        let part = Glimpses::new(&film, Some(30.0 / fps), None);
        for glimpses in [&all, &part] {
            let (mut stream, mut frame) = (glimpses.open().unwrap(), Frame::default());
            while stream.next_frame(&mut frame).unwrap().is_some() {}
        }
        let frames = |range: std::ops::Range<usize>| range.collect::<Vec<usize>>();
        // Frames 0, 5, 15, 25, ... are kept.
        assert_eq!(all.poster_idx(&frames(0..90)), Some(45));
        assert_eq!(all.poster_idx(&frames(20..32)), Some(25));
        let best = all.poster_idx(&[5, 46, 47, 48]);
        assert_eq!(best, Some(5), "the only one that shows it");
        assert_eq!(
            all.poster_idx(&[51, 52, 53]),
            Some(55),
            "no kept frame shows it"
        );
        assert!(
            part.poster_idx(&frames(0..90)) >= Some(30),
            "outside of the part"
        );
    }
}
