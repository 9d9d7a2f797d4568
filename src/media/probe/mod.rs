//! Probing of a file: its streams and pictures, checked against the limits (docs/explanation/promises.md,
//! "Bad input").
//!
//! Two runs of ffprobe read the headers and the timestamps of all video packets. A third run decodes the
//! film, if the packets do not determine its pictures. Numbers in the header are treated as claims.

mod animated_ending; // detection of cut GIF and APNG files
mod ending; // detection of files that are cut off
pub(in crate::media) mod header; // stream headers
mod mov_index; // check of the index of an MP4 file
mod packets; // timestamps of packets and pictures
pub(in crate::media) mod timeline; // presentation times -> a constant rate
mod timestamps; // correction of a recorder's timestamps

use std::fs::File;
use std::io::Read;
use std::path::Path;
use std::thread;

use serde_json::Value;

use crate::media::allow_list::UNKNOWN_RATE_FPS;
use crate::media::container::{Container, HEAD_BYTES};
use crate::media::error::{Damage, Error};
use crate::media::limits::Limits;
use crate::media::notice::Notice;
use crate::media::read_options::ReadOptions;
use ending::Ending;
use flockreel_core::raster::{ColorSpec, Matrix, Range};
use header::{
    Orientation, alpha_decoder, check_codec, color_of, has_alpha, index_of, is_interlaced, number,
    orientation_of, parse_header, ratio, read_header, shown_size, text, video_streams,
};
use mov_index::MovIndex;
use packets::{AllPackets, Packets, Pictures};
use timeline::{Claims, Timeline};

/// Largest file, bytes, whose packets are read in parallel with its headers. A larger file may be invalid, so
/// its headers are checked first. Free choice.
const MAX_PARALLEL_BYTES: u64 = 64 << 20;

/// Colors of the full range, so that gray keeps its levels.
pub(in crate::media) const FULL_RANGE: ColorSpec = ColorSpec {
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
    pub(in crate::media) orientation: Orientation,
    /// ffmpeg's name of the stored pixel format.
    pub(in crate::media) pix_fmt: String,
    /// ffmpeg's name of the stored luma weights.
    pub(in crate::media) color_space: String,
    /// Conversion of the frames to RGB.
    pub(in crate::media) color: ColorSpec,
    /// Whether the alpha channel is returned, as gray of the full range; and the decoder this needs, if not
    /// the default.
    pub(in crate::media) alpha_as_gray: bool,
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
    /// Notices about the file.
    pub(in crate::media) notices: Vec<Notice>,
}

/// Properties of a file that do not need ffprobe.
struct FileInfo {
    container: Container,
    n_bytes: u64,
    ending: Ending,
    /// Whether the index of each track is damaged; only known for MP4 and QuickTime.
    index: MovIndex,
}

/// Reads the headers and packet timestamps of a file, and refuses a file that exceeds the limits.
pub(in crate::media) fn probe(
    path: &Path,
    limits: &Limits,
    options: &ReadOptions,
) -> Result<Probe, Error> {
    let file = inspect(path, limits)?;
    let (container, n_bytes) = (file.container, file.n_bytes);
    let read_packets = || AllPackets::read(container, path, n_bytes, limits);
    let (header, packets) = thread::scope(|scope| {
        let thread = (n_bytes < MAX_PARALLEL_BYTES).then(|| scope.spawn(read_packets));
        let header = read_header(container, path, limits);
        (header, thread.and_then(|thread| thread.join().ok()))
    });
    let header = header.map_err(|error| file.explain(error))?;
    let streams = video_streams(&header, limits).map_err(|error| file.explain(error))?;
    if let [only] = streams[..] {
        check_stream(only, limits, options).map_err(|error| file.explain(error))?;
    }
    let packets = packets.unwrap_or_else(read_packets)?;
    let decode = |packets: &Packets| Pictures::read(container, path, packets, limits);
    judge(&file, &streams, &packets, decode, limits, options)
}

/// Checks a film as `probe` does, with the given output of ffprobe: the headers as JSON, the lines of the packets, and
/// those of the decoded pictures. Starts no process; for fuzz targets.
pub fn check_ffprobe_output(
    path: &Path,
    header: &[u8],
    packets: &[u8],
    pictures: &[u8],
    limits: &Limits,
) -> Result<(), Error> {
    let file = inspect(path, limits)?;
    let header = parse_header(header)?;
    let streams = video_streams(&header, limits)?;
    let packets = AllPackets::from_output(packets, limits)?;
    let decode = |_: &Packets| Pictures::from_output(pictures, limits);
    let options = ReadOptions::default();
    judge(&file, &streams, &packets, decode, limits, &options).map(drop)
}

/// Refuses a film whose streams or packets exceed the limits. `decode` returns its pictures, if the packets do not
/// determine them.
fn judge(
    file: &FileInfo,
    streams: &[&Value],
    packets: &AllPackets,
    decode: impl Fn(&Packets) -> Result<Pictures, Error>,
    limits: &Limits,
    options: &ReadOptions,
) -> Result<Probe, Error> {
    let stream = choose_stream(streams, packets)?;
    let size = check_stream(stream, limits, options);
    let [width, height] = size.map_err(|error| file.explain(error))?;
    let times = PictureTimes::find(file, stream, packets, decode, limits)?;
    let (timeline, mut notices) = times.timeline(stream, limits, options)?;
    let n_pictures = times.times_s.len();
    if !limits.allow_truncated {
        notices.extend(file.notice(n_pictures));
    }
    let has_plain_times = times.has_plain_times && notices.is_empty();
    let hdr = header::hdr_transfer(stream);
    notices.extend(hdr.map(|transfer| Notice::HighDynamicRange { transfer }));
    Ok(Probe {
        container: file.container,
        stream_idx: index_of(stream),
        width: width as u32,
        height: height as u32,
        orientation: orientation_of(stream),
        pix_fmt: text(&stream["pix_fmt"]).to_owned(),
        color_space: text(&stream["color_space"]).to_owned(),
        color: if options.alpha_as_gray {
            FULL_RANGE
        } else {
            color_of(stream)
        },
        alpha_as_gray: options.alpha_as_gray,
        decoder: alpha_decoder(stream).filter(|_| options.alpha_as_gray),
        has_alpha: has_alpha(stream),
        interlaced: is_interlaced(stream),
        n_pictures,
        has_plain_times,
        timeline,
        notices,
    })
}

fn inspect(path: &Path, limits: &Limits) -> Result<FileInfo, Error> {
    let failed = Error::io("opening the footage");
    let file = File::open(path).map_err(&failed)?;
    let n_bytes = file.metadata().map_err(&failed)?.len();
    limits.check_n_bytes(n_bytes)?;
    let mut head = Vec::with_capacity(HEAD_BYTES);
    (&file)
        .take(HEAD_BYTES as u64)
        .read_to_end(&mut head)
        .map_err(&failed)?;
    let container = Container::detect(&head)?;
    let ending = Ending::detect(container, &file, n_bytes).map_err(&failed)?;
    let index = match container {
        Container::Mov => MovIndex::read(&file, n_bytes).map_err(&failed)?,
        _ => MovIndex::default(),
    };
    Ok(FileInfo {
        container,
        n_bytes,
        ending,
        index,
    })
}

impl FileInfo {
    /// Returns the reason why ffprobe found no usable video, which is the damage of the file if there is any.
    fn explain(&self, error: Error) -> Error {
        match error {
            Error::NotAVideo(_) if self.ending != Ending::Whole => {
                Error::Truncated(Damage::NoIndex)
            }
            Error::NotAVideo(_) | Error::NoVideoStream if self.index.is_damaged() => {
                Error::Truncated(Damage::BrokenIndex)
            }
            // The index names the codec.
            Error::CodecNotAllowed(codec) if codec.is_empty() && self.index.is_damaged() => {
                Error::Truncated(Damage::BrokenIndex)
            }
            error => error,
        }
    }

    /// Returns a notice if the file is damaged. The pictures of the film are known to be whole.
    fn notice(&self, n_pictures: usize) -> Option<Notice> {
        if self.ending != Ending::Whole {
            Some(Notice::CutAfterPictures { n_pictures })
        } else if self.index.is_damaged() {
            Some(Notice::IndexDamaged { n_pictures })
        } else {
            None
        }
    }
}

/// The pictures of a film with their times in the file.
struct PictureTimes {
    /// Times in display order, as stored in the file; `None` for a picture without a time.
    times_s: Vec<Option<f64>>,
    has_plain_times: bool,
}

impl PictureTimes {
    /// Finds the pictures from their packets or, if the packets do not determine them, by decoding. Refuses a
    /// film whose pictures are cut off or damaged, unless the limits allow it.
    fn find(
        file: &FileInfo,
        stream: &Value,
        all: &AllPackets,
        decode: impl Fn(&Packets) -> Result<Pictures, Error>,
        limits: &Limits,
    ) -> Result<PictureTimes, Error> {
        let packets = all.of_stream(index_of(stream));
        if packets.encrypted {
            return Err(Error::Encrypted);
        }
        let shown_s = packets
            .shown_s()
            .filter(|_| has_one_picture_per_packet(file.container, stream));
        let has_plain_times = shown_s.is_some();
        let (times_s, is_damaged) = match shown_s {
            Some(shown_s) => (shown_s.into_iter().map(Some).collect(), false),
            None => decoded_times(packets.n_shown(), decode(&packets)?),
        };
        let times = PictureTimes {
            times_s,
            has_plain_times,
        };
        let is_cut = match file.ending {
            Ending::InsideData => true,
            // Only the index after the pictures may be missing. A Matroska file without sizes ends where its
            // reader says.
            Ending::AfterPictures if file.container == Container::Matroska => false,
            _ => all.is_cut(packets.stream_idx),
        };
        if (is_cut || is_damaged) && !limits.allow_truncated {
            Err(Error::Truncated(Damage::EndsAt {
                n_pictures: times.times_s.len(),
                span_s: times.span_s(),
            }))
        } else if file.index.is_damaged_for(packets.stream_idx) && !limits.allow_truncated {
            Err(Error::Truncated(Damage::BrokenIndex))
        } else {
            Ok(times)
        }
    }

    /// Returns the time from the first to the last picture, seconds; 0 if unknown.
    fn span_s(&self) -> f64 {
        let times = self.times_s.iter().flatten();
        let (first, last) = times.fold((f64::MAX, f64::MIN), |(first, last), &time| {
            (first.min(time), last.max(time))
        });
        (last - first).max(0.0)
    }

    fn timeline(
        &self,
        stream: &Value,
        limits: &Limits,
        options: &ReadOptions,
    ) -> Result<(Timeline, Vec<Notice>), Error> {
        let rate = |name: &str| ratio(text(&stream[name]), '/').filter(|fps| *fps > 0.0);
        let rates = [rate("avg_frame_rate"), rate("r_frame_rate")]
            .into_iter()
            .flatten();
        let claims = Claims {
            fps: rates
                .filter(|fps| (fps / UNKNOWN_RATE_FPS - 1.0).abs() > 1e-3)
                .collect(),
            tick_s: ratio(text(&stream["time_base"]), '/').unwrap_or(0.001),
            given_fps: options.fps,
        };
        Timeline::new(&self.times_s, &claims, limits)
    }
}

/// Returns the times of the decoded pictures, and whether too many of the packets were damaged.
fn decoded_times(n_packets: usize, pictures: Pictures) -> (Vec<Option<f64>>, bool) {
    let min_decoded = n_packets.saturating_sub((n_packets / 50).max(2));
    let is_damaged = pictures.times_s.len() < min_decoded && !pictures.stderr_tail.is_empty();
    (pictures.times_s, is_damaged)
}

/// Returns whether each packet with a valid time decodes to exactly one picture with that time.
fn has_one_picture_per_packet(container: Container, stream: &Value) -> bool {
    let has_times = !container.is_elementary_stream() && container != Container::MpegPs;
    has_times && !is_interlaced(stream) && text(&stream["codec_name"]) != "vp8"
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

/// Refuses a stream whose codec or size is not accepted. Returns the displayed width and height.
fn check_stream(stream: &Value, limits: &Limits, options: &ReadOptions) -> Result<[u64; 2], Error> {
    check_codec(stream)?;
    let [width, height] = shown_size(stream, options);
    limits.check_size(width, height)?;
    Ok([width, height])
}
