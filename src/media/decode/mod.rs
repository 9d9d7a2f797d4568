//! Footage as frames: planar 4:2:0 over a pipe, each frame read once into the caller's memory
//! (ECOSYSTEM.md 5, "Drive"; RELIABILITY.md, "Facts": decoded frames are counted, headers are only
//! claims).
//!
//! ffmpeg turns nothing and drops nothing by itself: the turn, the square pixels and the
//! deinterlacing are filters that we choose (`filters`).

mod filters; // between the decoder and us
mod gray; // the range of gray that is used
mod wanted; // which frames a decoder is asked for

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

/// Most frames that a child may decode without showing one.
const MOST_SKIPPED: usize = 300;

/// In a part of so many frames there is one that others refer to: three in a row without are usual.
const LEAST_SKIPPED: usize = 8;

/// A video file that is within its limits and can be read any number of times.
#[derive(Clone, Debug)]
pub(super) struct Film {
    path: PathBuf,
    limits: Limits,
    probe: Probe,
    stretch: Option<Stretch>,
}

impl Film {
    /// Looks at the file: container, codec, size, rate, length. Reads it once, and decodes it only where its
    /// packets do not tell its pictures. `path` is absolute, for the child works elsewhere.
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

    /// What is worth knowing of the file: assumptions, and faults that were mended.
    pub(super) fn notes(&self) -> &[Note] {
        &self.probe.notes
    }

    /// Whether it has an alpha channel.
    pub(super) fn has_alpha(&self) -> bool {
        self.probe.has_alpha
    }

    /// Returns its file.
    pub(super) fn files(&self) -> &[PathBuf] {
        std::slice::from_ref(&self.path)
    }

    /// The order to decode every frame, or some.
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
        // A frame is written at once, not copied into a buffer first.
        args.extend(["-avioflags", "direct", "pipe:1"].map(Into::into));
        args
    }

    /// Decoding threads: one for each megapixel, for threads that share less than that cost more than
    /// they bring.
    fn n_threads(&self) -> u32 {
        let pixels = u64::from(self.probe.width) * u64::from(self.probe.height);
        let useful = 1 + (pixels >> 20) as u32;
        match self.limits.threads {
            0 => useful.min(std::thread::available_parallelism().map_or(1, |n| n.get() as u32)),
            most => useful.min(most),
        }
    }

    /// Calls `visit` with the wanted frames; returns how many there were. They are not compared with
    /// what the header promised: who reads the whole footage finds out whether it is cut off.
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
        // Without a frame another way is tried, which then says why.
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

    /// The child hands over only the frames that are wanted. Of a long footage it decodes only those
    /// that others refer to, and the first of them after the middle of each part stands for it: that
    /// takes half the time or less.
    fn spread(&self, n: usize, visit: &mut Visit<'_>) -> Result<(), SourceError> {
        let n_pictures = self.probe.n_pictures;
        // A child that shows nothing for long is taken for stalled.
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

/// One reading of a video.
struct FilmStream<'a> {
    video: &'a Film,
    child: Option<Child>,
    n_decoded: usize,
    n_given: usize,
    /// The last decoded frame, kept only where frames may be shown twice.
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

    /// Whether the child, which has closed its output, ended well.
    fn check_end(&mut self) -> Result<(), Error> {
        match self.child.take() {
            Some(child) => child.finish()?.check().map(drop),
            None => Ok(()),
        }
    }

    /// Reads the bytes of one frame; returns how many came before the child closed its output.
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

    /// The next decoded frame; false after the last, once the child has ended well.
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
        // A packet holds a picture or two; what comes besides is no film any more.
        let plenty = 2 * self.video.probe.n_pictures + MOST_UNTOLD;
        let limit = self.video.limits.max_frames.min(plenty);
        match self.n_decoded > limit {
            true => Err(Error::TooManyFrames { limit }),
            false => Ok(true),
        }
    }

    /// The next frame of the constant rate, which may be the last one again or some later one.
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

    /// The child has closed its output, `n_left` bytes after the last whole frame.
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
        // A picture or two may be lost to an open start. More are missing without a complaint only where the
        // codec may say "the same again" in its own way.
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
