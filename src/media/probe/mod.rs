//! Probing of a file: its streams and pictures, checked against the limits (docs/explanation/promises.md,
//! "Bad input").
//!
//! Two runs of ffprobe read the headers and the timestamps of all video packets. A third run decodes the
//! film, if the packets do not determine its pictures. Numbers in the header are treated as claims.

mod clock; // correction of a recorder's timestamps
mod ending; // detection of files that are cut off
pub(in crate::media) mod header; // stream headers
mod packets; // timestamps of packets and pictures
pub(in crate::media) mod timeline; // presentation times -> a constant rate

use std::fs::File;
use std::io::Read;
use std::path::Path;
use std::thread;

use serde_json::Value;

use crate::media::allow_list::NO_RATE;
use crate::media::container::{Container, HEAD_BYTES};
use crate::media::error::{Damage, Error};
use crate::media::hints::Hints;
use crate::media::limits::Limits;
use crate::media::note::Note;
use crate::raster::{ColorSpec, Matrix, Range};
use ending::Ending;
use header::{
    Turn, alpha_decoder, check_codec, color_of, has_alpha, index_of, is_interlaced, number, ratio,
    read_header, shown_size, text, video_streams,
};
use packets::{AllPackets, Packets, Pictures};
use timeline::{Claims, Timeline};

/// Largest file, bytes, whose packets are read in parallel with its headers. A larger file may be invalid, so
/// its headers are checked first. Free choice.
const MOST_READ_EARLY: u64 = 64 << 20;

/// Gray of the full range, whose levels are kept.
pub(in crate::media) const GRAY: ColorSpec = ColorSpec {
    matrix: Matrix::Bt601,
    range: Range::Full,
};

/// A film that is within the limits.
#[derive(Clone, Debug)]
pub(in crate::media) struct Probe {
    /// Container, for `-f`.
    pub(in crate::media) container: Container,
    /// Index of the video stream, for `-map`.
    pub(in crate::media) stream_idx: u64,
    /// Width after rotation, in square pixels.
    pub(in crate::media) width: u32,
    /// Height after rotation, in square pixels.
    pub(in crate::media) height: u32,
    /// Rotation and mirroring of the stored picture.
    pub(in crate::media) turn: Turn,
    /// ffmpeg's name of the stored pixel format.
    pub(in crate::media) pix_fmt: String,
    /// ffmpeg's name of the stored luma weights.
    pub(in crate::media) color_space: String,
    /// Conversion of the frames to RGB.
    pub(in crate::media) color: ColorSpec,
    /// Whether the alpha channel is returned, as gray of the full range; and the decoder this needs, if not
    /// the default.
    pub(in crate::media) of_alpha: bool,
    pub(in crate::media) decoder: Option<&'static str>,
    /// Whether the film has an alpha channel.
    pub(in crate::media) has_alpha: bool,
    /// Whether the film is interlaced.
    pub(in crate::media) interlaced: bool,
    /// Expected number of decoded pictures.
    pub(in crate::media) n_pictures: usize,
    /// Whether the file's own timestamps determine its pictures, with none missing or corrected.
    pub(in crate::media) has_plain_times: bool,
    /// Frames and times at a constant rate.
    pub(in crate::media) timeline: Timeline,
    /// Notes about the file.
    pub(in crate::media) notes: Vec<Note>,
}

/// Properties of a file that do not need ffprobe.
struct Outside {
    container: Container,
    n_bytes: u64,
    ending: Ending,
}

/// Reads the headers and packet timestamps of a file, and refuses a file that exceeds the limits.
pub(in crate::media) fn probe(path: &Path, limits: &Limits, hints: &Hints) -> Result<Probe, Error> {
    let outside = look(path, limits)?;
    let Outside {
        container,
        n_bytes,
        ending,
    } = outside;
    let read_packets = || AllPackets::read(container, path, n_bytes, limits);
    let (header, early) = thread::scope(|scope| {
        let early = (n_bytes < MOST_READ_EARLY).then(|| scope.spawn(read_packets));
        let header = read_header(container, path, limits);
        (header, early.and_then(|thread| thread.join().ok()))
    });
    let header = header.map_err(|error| match (error, ending) {
        (
            Error::NotAVideo(_),
            Ending::AfterPictures | Ending::InsideSamples | Ending::InsideData,
        ) => Error::Truncated(Damage::NoIndex),
        (error, _) => error,
    })?;
    let streams = video_streams(&header, limits)?;
    if let [only] = streams[..] {
        check_stream(only, limits, hints)?;
    }
    let all = early.unwrap_or_else(read_packets)?;
    let stream = choose_stream(&streams, &all)?;
    let (width, height, turn) = check_stream(stream, limits, hints)?;
    let found = Found::of(path, &outside, stream, &all, limits)?;
    let (timeline, mut notes) = found.timeline(stream, limits, hints)?;
    let is_cut_after = ending != Ending::Whole;
    if is_cut_after && !limits.allow_truncated {
        notes.push(Note::CutAfterPictures {
            n_pictures: found.times_s.len(),
        });
    }
    Ok(Probe {
        container,
        stream_idx: index_of(stream),
        width: width as u32,
        height: height as u32,
        turn,
        pix_fmt: text(&stream["pix_fmt"]).to_owned(),
        color_space: text(&stream["color_space"]).to_owned(),
        color: match hints.of_alpha {
            true => GRAY,
            false => color_of(stream),
        },
        of_alpha: hints.of_alpha,
        decoder: alpha_decoder(stream).filter(|_| hints.of_alpha),
        has_alpha: has_alpha(stream),
        interlaced: is_interlaced(stream),
        n_pictures: found.times_s.len(),
        has_plain_times: found.has_plain_times && notes.is_empty(),
        timeline,
        notes,
    })
}

fn look(path: &Path, limits: &Limits) -> Result<Outside, Error> {
    let failed = Error::io("opening the footage");
    let file = File::open(path).map_err(&failed)?;
    let n_bytes = file.metadata().map_err(&failed)?.len();
    if n_bytes > limits.max_bytes {
        return Err(Error::TooLong {
            found: n_bytes as f64,
            unit: "bytes",
        });
    }
    let mut head = Vec::with_capacity(HEAD_BYTES);
    (&file)
        .take(HEAD_BYTES as u64)
        .read_to_end(&mut head)
        .map_err(&failed)?;
    let container = Container::of(&head)?;
    let ending = Ending::of(container, &file, n_bytes).map_err(&failed)?;
    Ok(Outside {
        container,
        n_bytes,
        ending,
    })
}

/// The pictures of a film with their times in the file.
struct Found {
    /// Times in display order, as stored in the file; `None` for a picture without a time.
    times_s: Vec<Option<f64>>,
    has_plain_times: bool,
}

impl Found {
    /// Finds the pictures from their packets or, if the packets do not determine them, by decoding. Refuses a
    /// film that is cut off or damaged, unless the limits allow it.
    fn of(
        path: &Path,
        outside: &Outside,
        stream: &Value,
        all: &AllPackets,
        limits: &Limits,
    ) -> Result<Found, Error> {
        let packets = all.of(index_of(stream));
        if packets.encrypted {
            return Err(Error::Encrypted);
        }
        let shown_s = packets
            .shown_s()
            .filter(|_| has_a_picture_a_packet(outside, stream));
        let has_plain_times = shown_s.is_some();
        let (times_s, is_damaged) = match shown_s {
            Some(shown_s) => (shown_s.into_iter().map(Some).collect(), false),
            None => decoded(path, outside.container, &packets, limits)?,
        };
        let found = Found {
            times_s,
            has_plain_times,
        };
        let is_cut = match outside.ending {
            Ending::InsideData => true,
            // Only the index after the pictures may be missing. A Matroska file without sizes ends where its
            // reader says.
            Ending::AfterPictures if outside.container == Container::Matroska => false,
            _ => all.is_cut(packets.stream_idx),
        };
        match (is_cut || is_damaged) && !limits.allow_truncated {
            true => Err(Error::Truncated(Damage::EndsAt {
                n_pictures: found.times_s.len(),
                span_s: found.span_s(),
            })),
            false => Ok(found),
        }
    }

    /// Returns the time from the first to the last picture, seconds; 0 if unknown.
    fn span_s(&self) -> f64 {
        let times = self.times_s.iter().flatten();
        let (least, most) = times.fold((f64::MAX, f64::MIN), |(least, most), &time| {
            (least.min(time), most.max(time))
        });
        (most - least).max(0.0)
    }

    fn timeline(
        &self,
        stream: &Value,
        limits: &Limits,
        hints: &Hints,
    ) -> Result<(Timeline, Vec<Note>), Error> {
        let rate = |name: &str| ratio(text(&stream[name]), '/').filter(|fps| *fps > 0.0);
        let told = [rate("avg_frame_rate"), rate("r_frame_rate")]
            .into_iter()
            .flatten();
        let claims = Claims {
            fps: told
                .filter(|fps| (fps / NO_RATE - 1.0).abs() > 1e-3)
                .collect(),
            tick_s: ratio(text(&stream["time_base"]), '/').unwrap_or(0.001),
            wanted_fps: hints.fps,
        };
        Timeline::found(&self.times_s, &claims, limits)
    }
}

/// Returns the times of the decoded pictures, and whether too many packets were damaged.
fn decoded(
    path: &Path,
    container: Container,
    packets: &Packets,
    limits: &Limits,
) -> Result<(Vec<Option<f64>>, bool), Error> {
    let n_packets = packets.n_shown();
    let pictures = Pictures::read(container, path, (packets.stream_idx, n_packets), limits)?;
    let n_least = n_packets - (n_packets / 50).max(2).min(n_packets);
    let is_damaged = pictures.times_s.len() < n_least && !pictures.complaint.is_empty();
    Ok((pictures.times_s, is_damaged))
}

/// Returns whether each packet with a valid time decodes to exactly one picture with that time.
fn has_a_picture_a_packet(outside: &Outside, stream: &Value) -> bool {
    let is_told = !outside.container.is_bare() && outside.container != Container::MpegPs;
    is_told && !is_interlaced(stream) && text(&stream["codec_name"]) != "vp8"
}

/// Returns the stream with the most pictures; of equals, the one with the largest picture, then the first. A
/// thumbnail is a stream of one picture, whether marked as such or not.
fn choose_stream<'a>(streams: &[&'a Value], packets: &AllPackets) -> Result<&'a Value, Error> {
    let side = |s: &Value, name: &str| number(&s[name]).unwrap_or(0.0) as u64;
    let rank = |s: &Value| {
        let area = side(s, "width").saturating_mul(side(s, "height"));
        (packets.n_shown(index_of(s)), area)
    };
    let is_cover = |s: &Value| {
        let marked = number(&s["disposition"]["attached_pic"]) == Some(1.0);
        marked && packets.n_shown(index_of(s)) <= 1
    };
    let films = streams.iter().copied().filter(|s| !is_cover(s));
    (films.rev().max_by_key(|s| rank(s))).ok_or(Error::NoVideoStream)
}

/// Refuses a stream whose codec or size is not accepted. Returns the displayed size and the rotation.
fn check_stream(stream: &Value, limits: &Limits, hints: &Hints) -> Result<(u64, u64, Turn), Error> {
    check_codec(stream)?;
    let (width, height, turn) = shown_size(stream, hints);
    check_size(width, height, limits)?;
    Ok((width, height, turn))
}

pub(in crate::media) fn check_size(width: u64, height: u64, limits: &Limits) -> Result<(), Error> {
    let too_large = width.max(height) > u64::from(limits.max_side_px)
        || width.saturating_mul(height) > limits.max_pixels;
    if too_large {
        return Err(Error::TooManyPixels { width, height });
    }
    match width.min(height) < u64::from(limits.min_side_px) {
        true => Err(Error::TooFewPixels { width, height }),
        false => Ok(()),
    }
}
