//! What a file holds, and whether it is within the limits (RELIABILITY.md, "Default limits" and
//! "Reason codes"). Two runs of ffprobe: the headers, then the time of every packet of the chosen
//! stream. Numbers of the header are only claims; those that matter are counted again in `decode`.

use std::fs::File;
use std::io::Read;
use std::path::Path;
use std::thread;

use serde_json::Value;

use super::allow_list::input_args;
use super::container::{Container, HEAD_BYTES};
use super::error::Error;
use super::gate::{Child, Order};
use super::limits::Limits;
use super::packets::Packets;
use super::timeline::Timeline;
use super::tools::Tool;
use crate::raster::{ColorSpec, Matrix, Range};

/// Codecs that are accepted, by ffprobe's names.
const CODECS: [&str; 14] = [
    "h264",
    "hevc",
    "vp8",
    "vp9",
    "av1",
    "mpeg4",
    "mpeg2video",
    "mjpeg",
    "prores",
    "ffv1",
    "rawvideo",
    "wmv2",
    "wmv3",
    "vc1",
];

/// What ffprobe is asked for.
const HEADER_ENTRIES: &str = "format=duration:stream=index,codec_name,codec_type,codec_tag_string,\
    width,height,pix_fmt,sample_aspect_ratio,r_frame_rate,avg_frame_rate,time_base,nb_frames,\
    duration,color_range,color_space,field_order:stream_disposition=attached_pic:\
    stream_tags=DURATION,enc_key_id:stream_side_data=displaymatrix";

/// A larger file may turn out to be none of ours: its packets are read only once its headers are good.
const MOST_READ_EARLY: u64 = 64 << 20;

/// Headers longer than this are not believed.
const MAX_HEADER_BYTES: usize = 1 << 20;

/// How the stored picture is turned to be shown.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Turn {
    /// Rows and columns change places, first of all.
    pub(super) transpose: bool,
    /// Then left and right.
    pub(super) flip_x: bool,
    /// And top and bottom.
    pub(super) flip_y: bool,
}

/// A film that is within the limits.
#[derive(Clone, Debug)]
pub(super) struct Probe {
    /// For `-f`.
    pub(super) container: Container,
    /// For `-map`.
    pub(super) stream_idx: u64,
    /// Columns as shown, square pixels.
    pub(super) width: u32,
    /// Rows as shown, square pixels.
    pub(super) height: u32,
    /// How the stored picture is turned.
    pub(super) turn: Turn,
    /// ffmpeg's name of the stored pixel format.
    pub(super) pix_fmt: String,
    /// ffmpeg's name of the stored luma weights.
    pub(super) color_space: String,
    /// How the given frames are to be read.
    pub(super) color: ColorSpec,
    /// Stored in two fields.
    pub(super) interlaced: bool,
    /// Packets to be shown.
    pub(super) n_packets: usize,
    /// Whether a packet may rightly yield no picture of its own.
    pub(super) packets_may_be_silent: bool,
    /// Which frame is shown when.
    pub(super) timeline: Timeline,
}

/// Reads the headers and the packet times of a file.
pub(super) fn probe(path: &Path, limits: &Limits) -> Result<Probe, Error> {
    let (container, n_bytes) = sniff(path, limits)?;
    // The film is mostly the first stream: its packets are read while the headers are.
    let read_packets = |idx| Packets::read(container, path, idx, n_bytes, limits);
    let (header, first) = thread::scope(|scope| {
        let first = (n_bytes < MOST_READ_EARLY).then(|| scope.spawn(|| read_packets(0)));
        let header = read_header(container, path, limits);
        (header, first.and_then(|thread| thread.join().ok()))
    });
    let header = header?;
    let stream = choose_stream(&header, limits)?;
    check_codec(stream)?;
    let (width, height, turn) = shown_size(stream);
    check_size(width, height, limits)?;
    let stream_idx = number(&stream["index"]).unwrap_or(0.0) as u64;
    let packets = match first {
        Some(packets) if stream_idx == 0 => packets?,
        _ => read_packets(stream_idx)?,
    };
    let timeline = packets.timeline(stream, limits)?;
    if !limits.allow_truncated {
        packets.check_whole(&header, stream, &timeline)?;
    }
    let field_order = text(&stream["field_order"]);
    let interlaced = ["tt", "bb", "tb", "bt"].contains(&field_order);
    Ok(Probe {
        container,
        stream_idx,
        width: width as u32,
        height: height as u32,
        turn,
        pix_fmt: text(&stream["pix_fmt"]).to_owned(),
        color_space: text(&stream["color_space"]).to_owned(),
        color: color_of(stream),
        interlaced,
        n_packets: packets.n_shown,
        packets_may_be_silent: interlaced || text(&stream["codec_name"]) == "vp8",
        timeline,
    })
}

fn sniff(path: &Path, limits: &Limits) -> Result<(Container, u64), Error> {
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
    file.take(HEAD_BYTES as u64)
        .read_to_end(&mut head)
        .map_err(&failed)?;
    Ok((Container::of(&head)?, n_bytes))
}

fn read_header(container: Container, path: &Path, limits: &Limits) -> Result<Value, Error> {
    let mut args = vec![
        "-show_entries".into(),
        HEADER_ENTRIES.into(),
        "-of".into(),
        "json".into(),
    ];
    args.extend(input_args(container, path, limits));
    let order = Order::new(Tool::Ffprobe, args, limits, 0).with_input(path);
    let mut child = Child::reading(order)?;
    let mut json = vec![0; MAX_HEADER_BYTES];
    let n_read = child.read_full(&mut json)?;
    if n_read == json.len() {
        return Err(Error::NotAVideo("its header has no end".into()));
    }
    let end = child.finish()?;
    let says = |what| end.complaint.contains(what);
    if says("Number of streams exceeds") {
        return Err(Error::TooManyStreams {
            limit: limits.max_streams,
        });
    }
    if says("moov atom not found") {
        return Err(Error::Truncated {
            found: 0.0,
            promised: 1.0,
            unit: "index",
        });
    }
    if let Some(codec) = refused_codec(&end.complaint) {
        return Err(Error::CodecNotAllowed(codec.to_owned()));
    }
    match end.check() {
        Ok(_) => serde_json::from_slice(&json[..n_read])
            .map_err(|error| Error::NotAVideo(error.to_string())),
        Err(Error::Crashed { status, complaint }) if status.starts_with("exit") => {
            Err(Error::NotAVideo(complaint))
        }
        Err(error) => Err(error),
    }
}

/// The codec that ffprobe was not allowed to open, by its own words.
fn refused_codec(complaint: &str) -> Option<&str> {
    let line = complaint
        .lines()
        .find(|line| line.contains(") not on whitelist"))?;
    Some(line.split_once("Codec (")?.1.split_once(')')?.0)
}

/// The video stream with the largest picture, the first of equals; cover pictures are none.
fn choose_stream<'a>(header: &'a Value, limits: &Limits) -> Result<&'a Value, Error> {
    let streams = header["streams"].as_array().map_or(&[][..], Vec::as_slice);
    if streams.len() > limits.max_streams as usize {
        return Err(Error::TooManyStreams {
            limit: limits.max_streams,
        });
    }
    let area = |s: &Value| number(&s["width"]).unwrap_or(0.0) * number(&s["height"]).unwrap_or(0.0);
    let films = streams.iter().filter(|s| {
        text(&s["codec_type"]) == "video" && number(&s["disposition"]["attached_pic"]) != Some(1.0)
    });
    films
        .rev()
        .max_by(|a, b| area(a).total_cmp(&area(b)))
        .ok_or(Error::NoVideoStream)
}

fn check_codec(stream: &Value) -> Result<(), Error> {
    let codec = text(&stream["codec_name"]);
    let tag = text(&stream["codec_tag_string"]);
    if tag == "encv" || !stream["tags"]["enc_key_id"].is_null() {
        return Err(Error::Encrypted);
    }
    match CODECS.contains(&codec) {
        true => Ok(()),
        false => Err(Error::CodecNotAllowed(codec.to_owned())),
    }
}

/// Size as shown, and the turn that leads there.
fn shown_size(stream: &Value) -> (u64, u64, Turn) {
    let side = |name: &str| number(&stream[name]).unwrap_or(0.0);
    let (mut width, mut height) = (side("width"), side("height"));
    let aspect = ratio(text(&stream["sample_aspect_ratio"]), ':').unwrap_or(1.0);
    // The smaller count is stretched: no measured detail is lost.
    match aspect {
        a if a > 1.0 => width = (width * a).round(),
        a if a > 0.0 => height = (height / a).round(),
        _ => {}
    }
    let turn = turn_of(stream);
    if turn.transpose {
        std::mem::swap(&mut width, &mut height);
    }
    (width as u64, height as u64, turn)
}

/// The turn that a display matrix asks for, to the nearest quarter.
fn turn_of(stream: &Value) -> Turn {
    let matrices = stream["side_data_list"]
        .as_array()
        .map_or(&[][..], Vec::as_slice);
    let matrix = matrices
        .iter()
        .map(|data| text(&data["displaymatrix"]))
        .find(|m| !m.is_empty());
    // Three rows, each "address: a b u".
    let cells: Vec<f64> = matrix
        .unwrap_or_default()
        .lines()
        .filter_map(|line| line.split_once(':'))
        .flat_map(|(_, row)| row.split_whitespace().filter_map(|cell| cell.parse().ok()))
        .collect();
    let &[a, b, _, c, d, ..] = cells.as_slice() else {
        return Turn {
            transpose: false,
            flip_x: false,
            flip_y: false,
        };
    };
    // A stored point (x, y) is shown at (a x + c y, b x + d y).
    let transpose = f64::abs(b) > f64::abs(a);
    Turn {
        transpose,
        flip_x: if transpose { c < 0.0 } else { a < 0.0 },
        flip_y: if transpose { b < 0.0 } else { d < 0.0 },
    }
}

pub(super) fn check_size(width: u64, height: u64, limits: &Limits) -> Result<(), Error> {
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

fn color_of(stream: &Value) -> ColorSpec {
    let pix_fmt = text(&stream["pix_fmt"]);
    let matrix = match text(&stream["color_space"]) {
        // Wider gamuts are converted to it by `decode`.
        "bt709" | "bt2020nc" | "bt2020c" if !is_rgb(pix_fmt) => Matrix::Bt709,
        _ => Matrix::Bt601,
    };
    let full = pix_fmt.starts_with("yuvj")
        || pix_fmt.starts_with("gray")
        || (text(&stream["color_range"]) == "pc" && !is_rgb(pix_fmt));
    let range = if full { Range::Full } else { Range::Limited };
    ColorSpec { matrix, range }
}

/// Whether a pixel format, by ffmpeg's name, holds red, green and blue.
pub(super) fn is_rgb(pix_fmt: &str) -> bool {
    [
        "rgb", "bgr", "gbr", "argb", "abgr", "0rgb", "0bgr", "pal8", "x2rgb", "x2bgr", "mono",
    ]
    .iter()
    .any(|start| pix_fmt.starts_with(start))
}

pub(super) fn n_streams(header: &Value) -> usize {
    header["streams"].as_array().map_or(0, Vec::len)
}

pub(super) fn text(value: &Value) -> &str {
    value.as_str().unwrap_or_default()
}

/// A number, which ffprobe may have put in quotes.
pub(super) fn number(value: &Value) -> Option<f64> {
    value.as_f64().or_else(|| value.as_str()?.parse().ok())
}

/// `30000/1001` or `4:3`; `None` for `0/0` and the like.
pub(super) fn ratio(text: &str, sign: char) -> Option<f64> {
    let (over, under) = text.split_once(sign)?;
    let value = over.parse::<f64>().ok()? / under.parse::<f64>().ok()?;
    value.is_finite().then_some(value)
}
