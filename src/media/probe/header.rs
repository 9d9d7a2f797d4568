//! Stream headers, read by ffprobe: codec, size, rotation, colors. They are claims, checked against the
//! limits before anything is decoded.

use std::path::Path;

use serde_json::Value;

use crate::media::allow_list::input_args;
use crate::media::container::Container;
use crate::media::error::{Damage, Error};
use crate::media::gate::Child;
use crate::media::invocation::Invocation;
use crate::media::limits::Limits;
use crate::media::read_options::ReadOptions;
use crate::media::tools::{Tool, installed};
use flockreel_core::raster::{ColorSpec, Matrix, Range};

/// Accepted codecs, by ffprobe's names.
const CODECS: [&str; 23] = [
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
    "mpeg1video",
    "huffyuv",
    "ffvhuff",
    "png",
    "theora",
    "flv1",
    "h263", // the codec of many .3gp files
    "gif",
    "apng",
];

/// The entries requested from ffprobe.
const HEADER_ENTRIES: &str = "stream=index,codec_name,codec_type,codec_tag_string,\
    width,height,pix_fmt,sample_aspect_ratio,r_frame_rate,avg_frame_rate,time_base,color_range,color_space,color_transfer,\
    field_order:stream_disposition=attached_pic:stream_tags=enc_key_id,alpha_mode:stream_side_data=displaymatrix";

/// Maximum length of ffprobe's header output, bytes. Free choice.
const MAX_HEADER_BYTES: usize = 1 << 20;

/// Transformation of the stored picture for display.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(in crate::media) struct Orientation {
    /// Whether rows and columns are exchanged, as the first step.
    pub(in crate::media) transpose: bool,
    /// Whether left and right are exchanged afterwards.
    pub(in crate::media) flip_x: bool,
    /// Whether top and bottom are exchanged afterwards.
    pub(in crate::media) flip_y: bool,
}

pub(super) fn read_header(
    container: Container,
    path: &Path,
    limits: &Limits,
) -> Result<Value, Error> {
    let mut args = vec![
        "-show_entries".into(),
        HEADER_ENTRIES.into(),
        "-of".into(),
        "json".into(),
    ];
    args.extend(input_args(container, path, limits));
    let invocation = Invocation::new(installed(Tool::Ffprobe)?, args, limits, 0);
    let mut child = Child::reading(invocation.with_input(path))?;
    let mut json = vec![0; MAX_HEADER_BYTES];
    let n_read = child.read_full(&mut json)?;
    if n_read == json.len() {
        return Err(Error::NotAVideo(
            "the header of the file is too large".into(),
        ));
    }
    let exit = child.finish()?;
    let says = |what| exit.stderr_tail.contains(what);
    if says("Number of streams exceeds") {
        return Err(Error::TooManyStreams {
            limit: limits.max_streams,
        });
    }
    if says("moov atom not found") {
        return Err(Error::Truncated(Damage::NoIndex));
    }
    if let Some(codec) = disallowed_codec(&exit.stderr_tail) {
        return Err(Error::CodecNotAllowed(codec.to_owned()));
    }
    match exit.check() {
        Ok(_) => parse_header(&json[..n_read]),
        Err(Error::Crashed {
            status,
            stderr_tail,
        }) if status.starts_with("exit") => Err(Error::NotAVideo(stderr_tail)),
        Err(error) => Err(error),
    }
}

/// Parses the headers that ffprobe writes as JSON.
pub(super) fn parse_header(json: &[u8]) -> Result<Value, Error> {
    serde_json::from_slice(json).map_err(|error| Error::NotAVideo(error.to_string()))
}

/// Returns the codec that ffprobe was not allowed to open, from its error message.
fn disallowed_codec(stderr_tail: &str) -> Option<&str> {
    let line = stderr_tail
        .lines()
        .find(|line| line.contains(") not on whitelist"))?;
    Some(line.split_once("Codec (")?.1.split_once(')')?.0)
}

/// Returns all video streams, at least one.
pub(super) fn video_streams<'a>(
    header: &'a Value,
    limits: &Limits,
) -> Result<Vec<&'a Value>, Error> {
    let streams = array(&header["streams"]);
    limits.check_n_streams(streams.len())?;
    let films = streams.iter().filter(|s| text(&s["codec_type"]) == "video");
    let films: Vec<&Value> = films.collect();
    if films.is_empty() {
        Err(Error::NoVideoStream)
    } else {
        Ok(films)
    }
}

pub(super) fn check_codec(stream: &Value) -> Result<(), Error> {
    let codec = text(&stream["codec_name"]);
    let tag = text(&stream["codec_tag_string"]);
    if tag == "encv" || !stream["tags"]["enc_key_id"].is_null() {
        return Err(Error::Encrypted);
    }
    if CODECS.contains(&codec) {
        Ok(())
    } else {
        Err(Error::CodecNotAllowed(codec.to_owned()))
    }
}

/// Returns the displayed width and height, pixels.
pub(super) fn shown_size(stream: &Value, options: &ReadOptions) -> [u64; 2] {
    let side = |name: &str| number(&stream[name]).unwrap_or(0.0);
    let stored_aspect = ratio(text(&stream["sample_aspect_ratio"]), ':');
    let aspect = options.pixel_aspect.or(stored_aspect);
    let [width, height] = square_pixels([side("width"), side("height")], aspect);
    let size = if orientation_of(stream).transpose {
        [height, width]
    } else {
        [width, height]
    };
    size.map(|side| side as u64)
}

/// Returns the size in square pixels. The smaller dimension is stretched, so that no measured detail is lost.
pub(in crate::media) fn square_pixels([width, height]: [f64; 2], aspect: Option<f64>) -> [f64; 2] {
    match aspect {
        Some(aspect) if aspect > 1.0 => [(width * aspect).round(), height],
        Some(aspect) if aspect > 0.0 => [width, (height / aspect).round()],
        _ => [width, height],
    }
}

/// Returns the rotation of a display matrix, rounded to a quarter turn.
pub(super) fn orientation_of(stream: &Value) -> Orientation {
    let matrix = array(&stream["side_data_list"])
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
        return Orientation {
            transpose: false,
            flip_x: false,
            flip_y: false,
        };
    };
    // A stored point (x, y) is displayed at (a x + c y, b x + d y).
    let transpose = f64::abs(b) > f64::abs(a);
    Orientation {
        transpose,
        flip_x: if transpose { c < 0.0 } else { a < 0.0 },
        flip_y: if transpose { b < 0.0 } else { d < 0.0 },
    }
}

pub(super) fn is_interlaced(stream: &Value) -> bool {
    ["tt", "bb", "tb", "bt"].contains(&text(&stream["field_order"]))
}

pub(super) fn index_of(stream: &Value) -> u64 {
    number(&stream["index"]).unwrap_or(0.0) as u64
}

pub(super) fn color_of(stream: &Value) -> ColorSpec {
    let pix_fmt = text(&stream["pix_fmt"]);
    let matrix = match text(&stream["color_space"]) {
        // `decode` converts the wider gamuts to BT.709.
        "bt709" | "bt2020nc" | "bt2020c" if !is_rgb(pix_fmt) => Matrix::Bt709,
        _ => Matrix::Bt601,
    };
    let full = pix_fmt.starts_with("yuvj")
        || pix_fmt.starts_with("gray")
        || (text(&stream["color_range"]) == "pc" && !is_rgb(pix_fmt));
    let range = if full { Range::Full } else { Range::Limited };
    ColorSpec { matrix, range }
}

/// Returns the standard of a film of high dynamic range; `None` for other films.
pub(super) fn hdr_transfer(stream: &Value) -> Option<&'static str> {
    match text(&stream["color_transfer"]) {
        "smpte2084" => Some("PQ"),
        "arib-std-b67" => Some("HLG"),
        _ => None,
    }
}

/// Returns the bits of a gray pixel format, by ffmpeg's name, if they are more than 8.
pub(in crate::media) fn gray_bits(pix_fmt: &str) -> Option<u32> {
    let bits = pix_fmt.strip_prefix("gray")?;
    let bits = bits.strip_suffix("le").or(bits.strip_suffix("be"))?;
    bits.parse().ok().filter(|bits| (9..=16).contains(bits))
}

/// Returns whether a pixel format, by ffmpeg's name, holds red, green and blue.
pub(in crate::media) fn is_rgb(pix_fmt: &str) -> bool {
    [
        "rgb", "bgr", "gbr", "argb", "abgr", "0rgb", "0bgr", "pal8", "x2rgb", "x2bgr", "mono",
    ]
    .iter()
    .any(|start| pix_fmt.starts_with(start))
}

/// Returns whether a stream has an alpha channel: in its pixel format, or in separate packets as in WebM.
pub(super) fn has_alpha(stream: &Value) -> bool {
    let of_format = [
        "yuva", "rgba", "bgra", "argb", "abgr", "gbrap", "ya8", "ya16",
    ];
    let pix_fmt = text(&stream["pix_fmt"]);
    of_format.iter().any(|start| pix_fmt.starts_with(start))
        || number(&stream["tags"]["alpha_mode"]) == Some(1.0)
        || number(&stream["tags"]["ALPHA_MODE"]) == Some(1.0)
}

/// Returns the decoder that reads alpha from separate packets, which ffmpeg's native decoder ignores.
pub(super) fn alpha_decoder(stream: &Value) -> Option<&'static str> {
    match text(&stream["codec_name"]) {
        "vp8" => Some("libvpx"),
        "vp9" => Some("libvpx-vp9"),
        _ => None,
    }
}

fn array(value: &Value) -> &[Value] {
    value.as_array().map_or(&[], Vec::as_slice)
}

pub(super) fn text(value: &Value) -> &str {
    value.as_str().unwrap_or_default()
}

/// Returns a number, which ffprobe may have quoted.
pub(super) fn number(value: &Value) -> Option<f64> {
    value.as_f64().or_else(|| value.as_str()?.parse().ok())
}

/// Parses `30000/1001` or `4:3`; returns `None` for `0/0` and the like.
pub(super) fn ratio(text: &str, sign: char) -> Option<f64> {
    let (over, under) = text.split_once(sign)?;
    let value = over.parse::<f64>().ok()? / under.parse::<f64>().ok()?;
    value.is_finite().then_some(value)
}
