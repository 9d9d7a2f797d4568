//! Decoding of a film: planar YUV 4:2:0 frames over a pipe, each read directly into the caller's memory. The
//! number of decoded frames counts, not the number in the header (docs/explanation/promises.md, "Bad input").
//!
//! ffmpeg's own rotation and frame dropping are off. Rotation, square pixels and deinterlacing are explicit
//! filters (`filters`).

mod filters; // ffmpeg filters after the decoder
mod gray; // range of gray levels in use
mod selection; // frames that a decoder has to output

use std::ffi::OsString;
use std::path::PathBuf;

use super::allow_list::input_args;
use super::error::{Damage, Error};
use super::gate::Child;
use super::gray_range::GrayRange;
use super::invocation::Invocation;
use super::limits::Limits;
use super::notice::Notice;
use super::probe::header::gray_bits;
use super::probe::timeline::Timeline;
use super::probe::{Probe, probe};
use super::read_options::ReadOptions;
use super::tools::{Tool, installed};
use crate::config;
use flockreel_core::footage::{
    FootageFormat, FrameSource, FrameStream, SourceError, Visit, spread_by_reading, spread_idx,
};
use flockreel_core::raster::Frame;
use selection::{FrameSelection, MAX_UNANNOUNCED_FRAMES};

/// Largest number of frames that a child may decode without output. Free choice.
const MAX_SKIPPED_FRAMES: usize = 300;

/// Least number of frames in a part of the film, so that it contains a reference frame. Three frames in a row
/// without one are common. Free choice.
const MIN_FRAMES_PER_PART: usize = 8;

/// A video file that is within the limits and can be read any number of times.
#[derive(Clone, Debug)]
pub(super) struct Film {
    path: PathBuf,
    limits: Limits,
    probe: Probe,
    gray_range: Option<GrayRange>,
    /// Width and height of the frames, square pixels.
    size_px: [u32; 2],
    is_reduced: bool,
}

impl Film {
    /// Checks the file: container, codec, size, rate and length. Reads it once, and decodes it only if the
    /// packets do not determine its pictures. `path` must be absolute, because the child has another working
    /// directory.
    pub(super) fn open(
        path: PathBuf,
        limits: &Limits,
        options: &ReadOptions,
    ) -> Result<Film, Error> {
        let probe = probe(&path, limits, options)?;
        let mut film = Film {
            size_px: [probe.width, probe.height],
            is_reduced: false,
            probe,
            limits: limits.clone(),
            path,
            gray_range: None,
        };
        if let Some(bits) = gray_bits(&film.probe.pix_fmt) {
            let gray_range = film.measure_gray()?;
            film.probe.notices.push(gray_range.notice(bits));
            film.gray_range = Some(gray_range);
        }
        Ok(film)
    }

    /// Reduces the frames to a longest side of at most `longest_px`. Returns their size as a share of the film's.
    pub(super) fn reduce(&mut self, longest_px: u32) -> f64 {
        let Probe { width, height, .. } = self.probe;
        let scale = f64::from(longest_px) / f64::from(width.max(height));
        if scale >= 1.0 {
            return 1.0;
        }
        let reduced = |side: u32| ((f64::from(side) * scale).round() as u32).max(1);
        self.size_px = [reduced(width), reduced(height)];
        self.is_reduced = true;
        scale
    }

    /// Returns notices about the file: assumptions, and corrected faults.
    pub(super) fn notices(&self) -> &[Notice] {
        &self.probe.notices
    }

    /// Returns whether the film has an alpha channel.
    pub(super) fn has_alpha(&self) -> bool {
        self.probe.has_alpha
    }

    /// Returns the file.
    pub(super) fn files(&self) -> &[PathBuf] {
        std::slice::from_ref(&self.path)
    }

    /// Starts a decoder of the selected frames that are filtered by `filters`.
    fn start_decoder(&self, selection: &FrameSelection, filters: &str) -> Result<Child, Error> {
        let (tool, n_pictures) = (installed(Tool::Ffmpeg)?, self.probe.n_pictures);
        let args = self.args(selection, filters);
        let invocation = Invocation::new(tool, args, &self.limits, n_pictures);
        Child::reading(invocation.with_input(&self.path))
    }

    fn args(&self, selection: &FrameSelection, filters: &str) -> Vec<OsString> {
        let probe = &self.probe;
        let threads = self.n_threads().to_string();
        let mut input = vec!["-nostdin", "-copyts", "-noautorotate", "-threads", &threads];
        // Otherwise ffmpeg rounds the left border of a crop down.
        input.extend(["-flags", "unaligned"]);
        if matches!(selection, FrameSelection::OnePerPart { .. }) {
            input.extend(["-skip_frame", "noref"]);
        }
        if let Some(decoder) = probe.decoder {
            input.extend(["-c:v", decoder]);
        }
        let stream = format!("0:{}", probe.stream_idx);
        let mut output = vec!["-map", &stream, "-an", "-sn", "-dn"];
        output.extend(["-fps_mode", "passthrough"]);
        output.extend(["-vf", filters, "-f", "rawvideo"]);
        // Write each frame at once, without a copy to a buffer.
        output.extend(["-avioflags", "direct", "pipe:1"]);
        let mut args: Vec<OsString> = input.into_iter().map(Into::into).collect();
        args.extend(input_args(probe.container, &self.path, &self.limits));
        args.extend(output.into_iter().map(Into::into));
        args
    }

    /// Returns the number of decoding threads: one per megapixel and at most one per core. With less work per
    /// thread the threads cost more than they gain.
    fn n_threads(&self) -> u32 {
        let pixels = u64::from(self.probe.width) * u64::from(self.probe.height);
        let useful = 1 + (pixels >> 20) as u32;
        match self.limits.threads {
            0 => useful.min(config::cores() as u32),
            max => useful.min(max),
        }
    }

    /// Calls `visit` with the selected frames and returns their number. The number is not compared with the
    /// header's; that check belongs to reading the whole footage.
    fn visit_frames(
        &self,
        selection: &FrameSelection,
        visit: &mut Visit<'_>,
    ) -> Result<usize, Error> {
        let mut stream = FilmStream::start(self, selection)?;
        let mut frame = Frame::default();
        let mut n_visited = 0;
        let limit = selection.max_frames();
        while stream.read(&mut frame)? == frame.planes.len() {
            n_visited += 1;
            if n_visited > limit {
                return Err(Error::TooManyFrames { limit });
            }
            if visit(&frame).is_break() {
                return Ok(n_visited);
            }
        }
        // With no frames the caller tries another way, which then reports the error.
        if !matches!(selection, FrameSelection::OnePerPart { .. }) {
            stream.check_exit()?;
        }
        Ok(n_visited)
    }
}

impl FrameSource for Film {
    fn format(&self) -> FootageFormat {
        let probe = &self.probe;
        let [width, height] = self.size_px;
        FootageFormat {
            width,
            height,
            fps: probe.timeline.fps(),
            n_frames_hint: probe.timeline.n_frames(probe.n_pictures),
            color: probe.color,
        }
    }

    fn open(&self) -> Result<Box<dyn FrameStream + '_>, SourceError> {
        Ok(Box::new(FilmStream::start(self, &FrameSelection::All)?))
    }

    /// The child outputs only the selected frames. For a long footage it decodes only reference frames and uses
    /// the first one after the middle of each part. This takes at most half the time.
    fn spread(&self, n: usize, visit: &mut Visit<'_>) -> Result<(), SourceError> {
        let n_pictures = self.probe.n_pictures;
        // A child that outputs nothing for long counts as stalled.
        if n_pictures > MAX_SKIPPED_FRAMES * n {
            return spread_by_reading(self, n, visit);
        }
        let format = self.format();
        // Reduced frames are compared with frames of the film, so they must be the right ones.
        let may_be_late = !self.is_reduced && self.probe.has_plain_times;
        if n_pictures >= MIN_FRAMES_PER_PART * n && may_be_late {
            let parts_per_s = n as f64 * format.fps / format.n_frames_hint as f64;
            let selection = FrameSelection::OnePerPart {
                parts_per_s,
                n_parts: n,
            };
            if self.visit_frames(&selection, visit)? > 0 {
                return Ok(());
            }
        }
        let frames = spread_idx(format.n_frames_hint, n);
        let at = |idx| self.probe.timeline.picture_at(idx, n_pictures);
        let decoded = frames.into_iter().filter_map(at).map(|(idx, _)| idx);
        self.visit_frames(&FrameSelection::Indices(decoded.collect()), visit)?;
        Ok(())
    }
}

/// A reader of a video.
struct FilmStream<'a> {
    film: &'a Film,
    child: Option<Child>,
    n_decoded: usize,
    n_returned: usize,
    /// The last decoded frame, kept only if frames may repeat.
    last_frame: Frame,
}

impl FrameStream for FilmStream<'_> {
    fn next_frame(&mut self, frame: &mut Frame) -> Result<Option<f64>, SourceError> {
        let probe = &self.film.probe;
        let shown = probe.timeline.picture_at(self.n_returned, probe.n_pictures);
        let is_decoded = match &probe.timeline {
            Timeline::Constant { .. } => self.decode(frame)?,
            // After the last frame the rest of the film is decoded, which shows whether it is whole.
            Timeline::Variable { .. } => {
                self.decode_to(shown.map_or(usize::MAX, |(idx, _)| idx), frame)?
            }
        };
        self.n_returned += usize::from(is_decoded);
        Ok(shown.filter(|_| is_decoded).map(|(_, time_s)| time_s))
    }
}

impl<'a> FilmStream<'a> {
    fn start(film: &'a Film, selection: &FrameSelection) -> Result<FilmStream<'a>, Error> {
        let gray_range = film.gray_range.as_ref();
        let filters = filters::filters(&film.probe, film.size_px, gray_range, selection);
        Ok(FilmStream {
            film,
            child: Some(film.start_decoder(selection, &filters)?),
            n_decoded: 0,
            n_returned: 0,
            last_frame: Frame::default(),
        })
    }

    /// Checks that the child, which has closed its output, exited successfully.
    fn check_exit(&mut self) -> Result<(), Error> {
        match self.child.take() {
            Some(child) => child.finish()?.check().map(drop),
            None => Ok(()),
        }
    }

    /// Reads the bytes of one frame. Returns fewer bytes if the child closed its output.
    fn read(&mut self, frame: &mut Frame) -> Result<usize, Error> {
        [frame.width, frame.height] = self.film.size_px;
        frame.color = self.film.probe.color;
        let n_bytes = Frame::n_bytes(frame.width, frame.height);
        frame.planes.resize(n_bytes, 0);
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
            self.finish(n_read)?;
            return Ok(false);
        }
        self.n_decoded += 1;
        // A packet holds one or two pictures. More pictures than that indicate a malicious file.
        let plausible = 2 * self.film.probe.n_pictures + MAX_UNANNOUNCED_FRAMES;
        let limit = self.film.limits.max_frames.min(plausible);
        if self.n_decoded > limit {
            Err(Error::TooManyFrames { limit })
        } else {
            Ok(true)
        }
    }

    /// Decodes up to a picture, which may be the last one again. Returns false if there is none.
    fn decode_to(&mut self, picture_idx: usize, frame: &mut Frame) -> Result<bool, Error> {
        let mut last_frame = std::mem::take(&mut self.last_frame);
        while self.n_decoded <= picture_idx {
            if !self.decode(&mut last_frame)? {
                return Ok(false);
            }
        }
        frame.clone_from(&last_frame);
        self.last_frame = last_frame;
        Ok(true)
    }

    /// Handles the end of the output, `n_left` bytes after the last complete frame.
    fn finish(&mut self, n_left: usize) -> Result<(), Error> {
        let Some(child) = self.child.take() else {
            return Ok(());
        };
        let exit = child.finish()?.check()?;
        if n_left > 0 {
            return Err(Error::Crashed {
                status: "it ended inside a frame".into(),
                stderr_tail: exit.stderr_tail,
            });
        }
        let probe = &self.film.probe;
        let n_pictures = probe.n_pictures;
        // A few pictures may be lost at an open GOP. More are missing without an error message only in codecs
        // that can encode a repeated picture as nothing.
        let min_decoded = if exit.stderr_tail.is_empty() {
            n_pictures / 2
        } else {
            n_pictures.saturating_sub((n_pictures / 50).max(2))
        };
        if self.n_decoded < min_decoded.max(1) && !self.film.limits.allow_truncated {
            Err(Error::Truncated(Damage::Undecodable {
                n_decoded: self.n_decoded,
                n_pictures,
            }))
        } else {
            Ok(())
        }
    }
}
