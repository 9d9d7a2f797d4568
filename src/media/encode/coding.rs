//! The arguments of each kind of file that the encoder writes (ECOSYSTEM.md 5; ALGORITHMS.md 8): what
//! it is fed, how that becomes the codec's own form, and the color tags that say how to read it.
//!
//! Threads are fixed numbers, because bytes may depend on them.

use std::ffi::OsString;
use std::path::Path;

use super::{Quality, VideoFormat};
use crate::raster::{Matrix, Range};

/// A kind of moving picture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Coding {
    /// H.264 High in MP4, of planar frames: what browsers play.
    H264(Quality),
    /// VP9 in WebM, of RGBA.
    Vp9 {
        /// Keep the alpha, straight.
        alpha: bool,
    },
    /// ProRes 4444 in QuickTime, of RGBA: what editors take.
    ProRes {
        /// Keep the alpha, straight, 16 bits deep.
        alpha: bool,
    },
    /// An animated WebP of at most 480 columns and 15 frames a second, of RGBA.
    Webp,
    /// An animated GIF of at most 480 columns and 15 frames a second, of planar frames.
    Gif,
}

impl Coding {
    /// Whether frames are given as RGBA, not as planes.
    pub fn takes_rgba(self) -> bool {
        !matches!(self, Coding::H264(_) | Coding::Gif)
    }

    /// Whether sides must be even.
    pub(super) fn is_even(self) -> bool {
        matches!(self, Coding::H264(_))
    }

    /// Everything that ffmpeg is told, the file last.
    pub(super) fn args(self, part: &Path, format: &VideoFormat) -> Vec<OsString> {
        let even = |side: u32| match self.is_even() {
            true => side.next_multiple_of(2),
            false => side,
        };
        let size = format!("{}x{}", even(format.width), even(format.height));
        let (over, under) = fraction(format.fps);
        let words = format!(
            "-nostdin -protocol_whitelist pipe -f rawvideo -pixel_format {} -video_size {size} \
             -framerate {over}/{under} -i pipe:0 -map 0:0 -an -sn -dn {} \
             -fflags +bitexact -flags:v +bitexact -map_metadata -1 -y",
            self.pixel_format(format),
            self.output(format)
        );
        let mut args: Vec<OsString> = words.split_whitespace().map(Into::into).collect();
        // The one word that may hold spaces.
        let mut file = OsString::from("file:");
        file.push(part);
        args.push(file);
        args
    }

    fn pixel_format(self, format: &VideoFormat) -> &'static str {
        match format.color.range {
            _ if self.takes_rgba() => "rgba",
            Range::Limited => "yuv420p",
            Range::Full => "yuvj420p",
        }
    }

    fn output(self, format: &VideoFormat) -> String {
        match self {
            Coding::H264(quality) => h264(format, quality),
            Coding::Vp9 { alpha } => {
                let planes = if alpha { "yuva420p" } else { "yuv420p" };
                // With alpha there may be no hidden reference frames: the two layers would part.
                format!(
                    "-vf {} -c:v libvpx-vp9 -deadline realtime -cpu-used 5 -row-mt 1 -threads 4 \
                     -auto-alt-ref 0 -crf 26 -b:v 0 -f webm",
                    from_rgba(planes)
                )
            }
            Coding::ProRes { alpha } => {
                let planes = if alpha { "yuva444p10le" } else { "yuv444p10le" };
                let bits = if alpha { 16 } else { 0 };
                format!(
                    "-vf {} -c:v prores_ks -profile:v 4444 -alpha_bits {bits} -vendor apl0 \
                     -threads 4 -movflags +write_colr -f mov",
                    from_rgba(planes)
                )
            }
            Coding::Webp => format!(
                "-vf {SMALL} -c:v libwebp_anim -quality 75 -compression_level 3 -loop 0 -f webp"
            ),
            Coding::Gif => format!(
                "-vf {SMALL},split[a][b];[a]palettegen=stats_mode=full[p];\
                 [b][p]paletteuse=dither=bayer:bayer_scale=4 -c:v gif -loop 0 -f gif"
            ),
        }
    }
}

/// A preview's size and rate: never more than the film's own.
const SMALL: &str = "fps=fps='min(15,source_fps)',scale=w='min(480,iw)':h=-1:flags=area";

/// From RGBA to planes of BT.709, tagged as such.
fn from_rgba(planes: &str) -> String {
    format!(
        "scale=out_color_matrix=bt709:out_range=tv:flags=bicubic+accurate_rnd+full_chroma_int,\
         format={planes},\
         setparams=range=tv:colorspace=bt709:color_primaries=bt709:color_trc=bt709"
    )
}

fn h264(format: &VideoFormat, quality: Quality) -> String {
    let range = match format.color.range {
        Range::Limited => "tv",
        Range::Full => "pc",
    };
    let matrix = match format.color.matrix {
        Matrix::Bt601 => "smpte170m",
        Matrix::Bt709 => "bt709",
    };
    let Quality { crf, threads } = quality;
    // Our RGB is sRGB, whatever the luma weights: its primaries are those of BT.709. The filter on
    // the stream drops the message in which x264 writes its version and settings. Of motion it looks less closely than
    // the preset does (`subme`, `me`): most of a film is its plate, and a quarter of the encoder's time buys 5 to 9 % of
    // size there (docs/SPEED.md).
    format!(
        "-vf setparams=range={range}:colorspace={matrix}:color_primaries=bt709:color_trc=bt709 \
         -c:v libx264 -preset veryfast -profile:v high -crf {crf} -threads {threads} \
         -x264-params cpu-independent=1:subme=1:me=dia -bsf:v filter_units=remove_types=6 \
         -movflags +faststart -f mp4"
    )
}

/// The fraction nearest to a frame rate, with numbers that ffmpeg takes (up to 1,001,000).
fn fraction(fps: f64) -> (u64, u64) {
    const MOST: f64 = 1_001_000.0;
    let (mut before, mut last, mut rest) = ((0.0, 1.0), (1.0, 0.0), fps);
    // Continued fraction: each step is the best one with numbers of its size.
    loop {
        let whole = f64::floor(rest);
        let next = (whole * last.0 + before.0, whole * last.1 + before.1);
        if next.0 > MOST || next.1 > MOST {
            break;
        }
        (before, last) = (last, next);
        let left = rest - whole;
        if left < 1e-9 || (last.0 / last.1 - fps).abs() <= 1e-12 * fps {
            break;
        }
        rest = 1.0 / left;
    }
    (last.0.max(1.0) as u64, last.1.max(1.0) as u64)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn usual_and_odd_rates_become_their_own_fractions() {
        assert_eq!(fraction(25.0), (25, 1));
        assert_eq!(fraction(30000.0 / 1001.0), (30000, 1001));
        assert_eq!(fraction(1_000_000.0 / 33333.0), (1_000_000, 33333));
        assert_eq!(fraction(0.5), (1, 2));
    }
}
