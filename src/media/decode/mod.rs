//! Decoding of a film: planar YUV 4:2:0 frames over a pipe, each read directly into the caller's memory. The
//! number of decoded frames counts, not the number in the header (docs/explanation/promises.md, "Bad input").
//!
//! ffmpeg's own rotation and frame dropping are off. Rotation, square pixels and deinterlacing are explicit
//! filters (`filters`).

mod filters; // ffmpeg filters after the decoder
mod gray; // range of gray levels in use
mod wanted; // frames that a decoder has to output

use std::ffi::OsString;
use std::path::PathBuf;

use super::allow_list::input_args;
use super::error::{Damage, Error};
use super::gate::{Child, Order};

use super::hints::Hints;
use super::limits::Limits;
use super::note::Note;
use super::probe::header::gray_bits;
use super::probe::timeline::Timeline;
use super::probe::{Probe, probe};

use super::stretch::Stretch;
use super::tools::Tool;
use crate::footage::{
    FootageFormat, FrameSource, FrameStream, SourceError, Visit, spread_by_reading, spread_idx,
};
use crate::raster::Frame;
use wanted::{MOST_UNTOLD, Wanted};

/// Largest number of frames that a child may decode without output. Free choice.
const MOST_SKIPPED: usize = 300;

/// Least number of frames in a part of the film, so that it contains a reference frame. Three frames in a row
/// without one are common. Free choice.
const LEAST_SKIPPED: usize = 8;

/// A video file that is within the limits and can be read any number of times.
#[derive(Clone, Debug)]
pub(super) struct Film {
    path: PathBuf,
    limits: Limits,
    probe: Probe,
    stretch: Option<Stretch>,
}

impl Film {
    /// Checks the file: container, codec, size, rate and length. Reads it once, and decodes it only if the
    /// packets do not determine its pictures. `path` must be absolute, because the child has another working
    /// directory.
    pub(super) fn open(path: PathBuf, limits: &Limits, hints: &Hints) -> Result<Film, Error> {
        let mut video = Film {
            probe: probe(&path, limits, hints)?,
            limits: limits.clone(),
            path,
            stretch: None,
        };
        if let Some(bits) = gray_bits(&video.probe.pix_fmt) {
            let stretch = video.measure_gray()?;
            video.probe.notes.push(stretch.note(bits));
            video.stretch = Some(stretch);
        }
        Ok(video)
    }

    /// Returns notes about the file: assumptions, and corrected faults.
    pub(super) fn notes(&self) -> &[Note] {
        &self.probe.notes
    }

    /// Returns whether the film has an alpha channel.
    pub(super) fn has_alpha(&self) -> bool {
        self.probe.has_alpha
    }

    /// Returns the file.
    pub(super) fn files(&self) -> &[PathBuf] {
        std::slice::from_ref(&self.path)
    }

    /// Returns the order to decode the wanted frames.
    fn order(&self, wanted: &Wanted) -> Order {
        let n_pictures = self.probe.n_pictures;
        let filters = filters::filters(&self.probe, self.stretch.as_ref(), wanted);
        let args = self.args(wanted, &filters);
        Order::new(Tool::Ffmpeg, args, &self.limits, n_pictures).with_input(&self.path)
    }

    fn args(&self, wanted: &Wanted, filters: &str) -> Vec<OsString> {
        let probe = &self.probe;
        let threads = self.n_threads().to_string();
        let mut args: Vec<OsString> =
            ["-nostdin", "-copyts", "-noautorotate", "-threads", &threads]
                .map(Into::into)
                .into();
        if matches!(wanted, Wanted::InTime { .. }) {
            args.extend(["-skip_frame", "noref"].map(Into::into));
        }
        if let Some(decoder) = probe.decoder {
            args.extend(["-c:v", decoder].map(Into::into));
        }
        args.extend(input_args(probe.container, &self.path, &self.limits));
        let stream = format!("0:{}", probe.stream_idx);
        args.extend(
            [
                "-map",
                &stream,
                "-an",
                "-sn",
                "-dn",
                "-fps_mode",
                "passthrough",
            ]
            .map(Into::into),
        );
        args.extend(["-vf", filters, "-f", "rawvideo"].map(Into::into));
        // Write each frame at once, without a copy to a buffer.
        args.extend(["-avioflags", "direct", "pipe:1"].map(Into::into));
        args
    }

    /// Returns the number of decoding threads: one per megapixel and at most one per core. With less work per
    /// thread the threads cost more than they gain.
    fn n_threads(&self) -> u32 {
        let pixels = u64::from(self.probe.width) * u64::from(self.probe.height);
        let useful = 1 + (pixels >> 20) as u32;
        match self.limits.threads {
            0 => useful.min(std::thread::available_parallelism().map_or(1, |n| n.get() as u32)),
            most => useful.min(most),
        }
    }

    /// Calls `visit` with the wanted frames and returns their number. The number is not compared with the
    /// header's; that check belongs to reading the whole footage.
    fn show(&self, wanted: &Wanted, visit: &mut Visit<'_>) -> Result<usize, Error> {
        let mut stream = FilmStream::of(self, self.order(wanted))?;
        let mut frame = Frame::default();
        let mut n_shown = 0;
        let most = wanted.most();
        while stream.read(&mut frame)? == frame.planes.len() {
            n_shown += 1;
            if n_shown > most {
                return Err(Error::TooManyFrames { limit: most });
            }
            if visit(&frame).is_break() {
                return Ok(n_shown);
            }
        }
        // With no frames the caller tries another way, which then reports the error.
        match wanted {
            Wanted::InTime { .. } => {}
            _ => stream.check_end()?,
        }
        Ok(n_shown)
    }
}

impl FrameSource for Film {
    fn format(&self) -> FootageFormat {
        let probe = &self.probe;
        FootageFormat {
            width: probe.width,
            height: probe.height,
            fps: probe.timeline.fps(),
            n_frames_hint: match &probe.timeline {
                Timeline::Constant { .. } => probe.n_pictures,
                Timeline::Variable { sources, .. } => sources.len(),
            },
            color: probe.color,
        }
    }

    fn open(&self) -> Result<Box<dyn FrameStream + '_>, SourceError> {
        Ok(Box::new(FilmStream::of(self, self.order(&Wanted::All))?))
    }

    /// The child outputs only the wanted frames. For a long footage it decodes only reference frames and uses
    /// the first one after the middle of each part. This takes at most half the time.
    fn spread(&self, n: usize, visit: &mut Visit<'_>) -> Result<(), SourceError> {
        let n_pictures = self.probe.n_pictures;
        // A child that outputs nothing for long counts as stalled.
        if n_pictures > MOST_SKIPPED * n {
            return spread_by_reading(self, n, visit);
        }
        let format = self.format();
        if n_pictures >= LEAST_SKIPPED * n && self.probe.has_plain_times {
            let parts_per_s = n as f64 * format.fps / format.n_frames_hint as f64;
            let n_parts = n;
            if self.show(
                &Wanted::InTime {
                    parts_per_s,
                    n_parts,
                },
                visit,
            )? > 0
            {
                return Ok(());
            }
        }
        let given = spread_idx(format.n_frames_hint, n);
        let decoded = match &self.probe.timeline {
            Timeline::Constant { .. } => given,
            Timeline::Variable { sources, .. } => {
                given.iter().map(|&idx| sources[idx] as usize).collect()
            }
        };
        self.show(&Wanted::Numbers(decoded), visit)?;
        Ok(())
    }
}

/// A reader of a video.
struct FilmStream<'a> {
    video: &'a Film,
    child: Option<Child>,
    n_decoded: usize,
    n_given: usize,
    /// The last decoded frame, kept only if frames may repeat.
    held: Frame,
}

impl FrameStream for FilmStream<'_> {
    fn next_frame(&mut self, frame: &mut Frame) -> Result<Option<f64>, SourceError> {
        let video = self.video;
        let time_s = match &video.probe.timeline {
            Timeline::Constant { fps, ragged_s } => {
                let first_ragged = video.probe.n_pictures - ragged_s.len();
                let late = self
                    .n_given
                    .checked_sub(first_ragged)
                    .and_then(|k| ragged_s.get(k));
                let time_s = late.copied().unwrap_or(self.n_given as f64 / fps);
                self.decode(frame)?.then_some(time_s)
            }
            Timeline::Variable {
                times_s, sources, ..
            } => self.resample(times_s, sources, frame)?,
        };
        self.n_given += usize::from(time_s.is_some());
        Ok(time_s)
    }
}

impl<'a> FilmStream<'a> {
    fn of(video: &'a Film, order: Order) -> Result<FilmStream<'a>, Error> {
        Ok(FilmStream {
            video,
            child: Some(Child::reading(order)?),
            n_decoded: 0,
            n_given: 0,
            held: Frame::default(),
        })
    }

    /// Checks that the child, which has closed its output, exited successfully.
    fn check_end(&mut self) -> Result<(), Error> {
        match self.child.take() {
            Some(child) => child.finish()?.check().map(drop),
            None => Ok(()),
        }
    }

    /// Reads the bytes of one frame. Returns fewer bytes if the child closed its output.
    fn read(&mut self, frame: &mut Frame) -> Result<usize, Error> {
        let probe = &self.video.probe;
        (frame.width, frame.height, frame.color) = (probe.width, probe.height, probe.color);
        frame
            .planes
            .resize(Frame::n_bytes(probe.width, probe.height), 0);
        match &mut self.child {
            Some(child) => child.read_full(&mut frame.planes),
            None => Ok(0),
        }
    }

    /// Decodes the next frame. Returns false after the last, once the child has exited successfully.
    fn decode(&mut self, frame: &mut Frame) -> Result<bool, Error> {
        if self.child.is_none() {
            return Ok(false);
        }
        let n_read = self.read(frame)?;
        if n_read < frame.planes.len() {
            self.end(n_read)?;
            return Ok(false);
        }
        self.n_decoded += 1;
        // A packet holds one or two pictures. More pictures than that indicate a malicious file.
        let plenty = 2 * self.video.probe.n_pictures + MOST_UNTOLD;
        let limit = self.video.limits.max_frames.min(plenty);
        match self.n_decoded > limit {
            true => Err(Error::TooManyFrames { limit }),
            false => Ok(true),
        }
    }

    /// Returns the next frame at the constant rate. It may repeat the last frame or skip some.
    fn resample(
        &mut self,
        times_s: &[f64],
        sources: &[u32],
        frame: &mut Frame,
    ) -> Result<Option<f64>, Error> {
        let wanted = sources
            .get(self.n_given)
            .map_or(usize::MAX, |&source| source as usize);
        let mut held = std::mem::take(&mut self.held);
        while self.n_decoded <= wanted {
            if !self.decode(&mut held)? {
                return Ok(None);
            }
        }
        frame.clone_from(&held);
        self.held = held;
        Ok(times_s.get(wanted).copied())
    }

    /// Handles the end of the output, `n_left` bytes after the last complete frame.
    fn end(&mut self, n_left: usize) -> Result<(), Error> {
        let Some(child) = self.child.take() else {
            return Ok(());
        };
        let end = child.finish()?.check()?;
        if n_left > 0 {
            return Err(Error::Crashed {
                status: "it ended inside a frame".into(),
                complaint: end.complaint,
            });
        }
        let probe = &self.video.probe;
        let n_pictures = probe.n_pictures;
        // A few pictures may be lost at an open GOP. More are missing without an error message only in codecs
        // that can encode a repeated picture as nothing.
        let n_least = match end.complaint.is_empty() {
            true => n_pictures / 2,
            false => n_pictures - (n_pictures / 50).max(2).min(n_pictures),
        };
        match self.n_decoded < n_least.max(1) && !self.video.limits.allow_truncated {
            true => Err(Error::Truncated(Damage::Undecodable {
                n_decoded: self.n_decoded,
                n_pictures,
            })),
            false => Ok(()),
        }
    }
}
