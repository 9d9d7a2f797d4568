//! The ffmpeg filters after a decoder: deinterlacing, frame selection, gray range, rotation, square pixels,
//! colors. The last filters fix size and format, so that a picture size that changes within the film cannot
//! shift the bytes of later frames.

use super::selection::FrameSelection;
use crate::media::gray_range::GrayRange;
use crate::media::probe::Probe;
use crate::media::probe::header::{Orientation, is_rgb};
use flockreel_core::raster::{Matrix, Range};

/// Returns the filter chain of a film in ffmpeg's syntax. The frames have the given width and height, square pixels.
pub(super) fn filters(
    probe: &Probe,
    [width, height]: [u32; 2],
    gray_range: Option<&GrayRange>,
    selection: &FrameSelection,
) -> String {
    let matrix = match probe.color.matrix {
        Matrix::Bt601 => "bt601",
        Matrix::Bt709 => "bt709",
    };
    let (range, format) = match probe.color.range {
        Range::Limited => ("tv", "yuv420p"),
        Range::Full => ("pc", "yuvj420p"),
    };
    let mut filters = Vec::new();
    if probe.interlaced {
        filters.push("bwdif=mode=send_frame:deint=interlaced".to_owned());
    }
    filters.extend(selection.filter());
    filters.extend(probe.alpha_as_gray.then(|| "alphaextract".to_owned()));
    filters.extend(gray_range.map(GrayRange::filter));
    let orientation = orientation_filters(probe.orientation);
    filters.extend(orientation.into_iter().map(str::to_owned));
    // Bit-exact scaling gives the same bytes on every processor.
    let mut scale = format!("scale={width}:{height}:flags=bicubic+accurate_rnd+bitexact");
    if is_rgb(&probe.pix_fmt) && !probe.alpha_as_gray {
        scale += ":out_range=tv:out_color_matrix=bt601"
    } else {
        let stored = match &*probe.color_space {
            "bt2020nc" | "bt2020c" => "bt2020",
            space @ ("smpte240m" | "fcc") => space,
            _ => matrix,
        };
        scale += &format!(
            ":in_range={range}:out_range={range}:in_color_matrix={stored}:out_color_matrix={matrix}"
        );
    }
    filters.push(scale);
    filters.push(format!("format={format}"));
    filters.join(",")
}

fn orientation_filters(orientation: Orientation) -> Vec<&'static str> {
    match (
        orientation.transpose,
        orientation.flip_x,
        orientation.flip_y,
    ) {
        (true, true, false) => vec!["transpose=clock"],
        (true, false, true) => vec!["transpose=cclock"],
        (true, true, true) => vec!["transpose=clock_flip"],
        (true, false, false) => vec!["transpose=cclock_flip"],
        (false, x, y) => [(x, "hflip"), (y, "vflip")]
            .into_iter()
            .filter_map(|(is_flipped, filter)| is_flipped.then_some(filter))
            .collect(),
    }
}
