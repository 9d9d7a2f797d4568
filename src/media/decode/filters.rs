//! The ffmpeg filters after a decoder: deinterlacing, frame selection, gray range, rotation, square pixels,
//! colors. The last filters fix size and format, so that a picture size that changes within the film cannot
//! shift the bytes of later frames.

use super::wanted::Wanted;
use crate::media::probe::Probe;
use crate::media::probe::header::{Turn, is_rgb};
use crate::media::stretch::Stretch;
use crate::raster::{Matrix, Range};

/// Returns the filter chain of a film in ffmpeg's syntax.
pub(super) fn filters(probe: &Probe, stretch: Option<&Stretch>, wanted: &Wanted) -> String {
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
    filters.extend(wanted.filter());
    filters.extend(probe.of_alpha.then(|| "alphaextract".to_owned()));
    filters.extend(stretch.map(Stretch::filter));
    let turn = turn_filters(probe.turn);
    filters.extend(turn.iter().map(|&filter| filter.to_owned()));
    // Bit-exact scaling gives the same bytes on every processor.
    let mut scale = format!(
        "scale={}:{}:flags=bicubic+accurate_rnd+bitexact",
        probe.width, probe.height
    );
    match is_rgb(&probe.pix_fmt) && !probe.of_alpha {
        true => scale += ":out_range=tv:out_color_matrix=bt601",
        false => {
            let stored = if probe.color_space.starts_with("bt2020") {
                "bt2020"
            } else {
                matrix
            };
            scale += &format!(
                ":in_range={range}:out_range={range}:in_color_matrix={stored}:out_color_matrix={matrix}"
            );
        }
    }
    filters.push(scale);
    filters.push(format!("format={format}"));
    filters.join(",")
}

fn turn_filters(turn: Turn) -> Vec<&'static str> {
    match (turn.transpose, turn.flip_x, turn.flip_y) {
        (true, true, false) => vec!["transpose=clock"],
        (true, false, true) => vec!["transpose=cclock"],
        (true, true, true) => vec!["transpose=clock_flip"],
        (true, false, false) => vec!["transpose=cclock_flip"],
        (false, x, y) => [(x, "hflip"), (y, "vflip")]
            .into_iter()
            .filter_map(|(wanted, filter)| wanted.then_some(filter))
            .collect(),
    }
}
