//! ffmpeg's arguments for each output format (docs/explanation/algorithms.md, "Compositing"): pixel format of
//! the input, codec settings, and color tags. Thread counts are fixed, because the output bytes may depend on
//! them.

use std::ffi::OsString;
use std::path::Path;

use super::{Quality, VideoFormat};
use flockreel_core::raster::{Matrix, Range};

/// An output format.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Encoding {
    /// H.264 High in MP4, from planar frames; plays in browsers.
    H264(Quality),
    /// VP9 in WebM, from RGBA.
    Vp9 {
        /// Whether to keep the alpha, straight.
        alpha: bool,
    },
    /// ProRes 4444 in QuickTime, from RGBA; for video editors.
    ProRes {
        /// Whether to keep the alpha, straight, 16 bits.
        alpha: bool,
    },
    /// Animated WebP, at most 480 pixels wide and 15 frames per second, from RGBA.
    Webp,
    /// Still WebP, from RGBA with straight alpha.
    StillWebp,
    /// Still WebP, at most 320 pixels wide, from RGBA with straight alpha. Quality 0..=100.
    Thumb(u8),
    /// H.264 in MP4 for players that seek to every frame, from planar frames: at most 960 pixels wide, a key
    /// frame every 10 frames.
    Seekable,
    /// Animated GIF, at most 480 pixels wide and 15 frames per second, from planar frames.
    Gif,
}

impl Encoding {
    /// Returns whether frames are RGBA, not planar.
    pub fn takes_rgba(self) -> bool {
        !matches!(self, Encoding::H264(_) | Encoding::Seekable | Encoding::Gif)
    }

    /// Returns whether width and height must be even.
    pub(super) fn is_even(self) -> bool {
        matches!(self, Encoding::H264(_) | Encoding::Seekable)
    }

    /// Returns all arguments of ffmpeg. The output file is last.
    pub(super) fn args(self, part: &Path, format: &VideoFormat) -> Vec<OsString> {
        let even = |side: u32| {
            if self.is_even() {
                side.next_multiple_of(2)
            } else {
                side
            }
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
        // The only argument that may contain spaces.
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
            Encoding::H264(quality) => h264(format, quality),
            Encoding::Vp9 { alpha } => {
                let planes = if alpha { "yuva420p" } else { "yuv420p" };
                // With alpha, hidden reference frames are off, because they would make the two layers differ
                // in time.
                format!(
                    "-vf {} -c:v libvpx-vp9 -deadline realtime -cpu-used 5 -row-mt 1 -threads 4 \
                     -auto-alt-ref 0 -crf 26 -b:v 0 -f webm",
                    from_rgba(planes)
                )
            }
            Encoding::ProRes { alpha } => {
                let planes = if alpha { "yuva444p10le" } else { "yuv444p10le" };
                let bits = if alpha { 16 } else { 0 };
                format!(
                    "-vf {} -c:v prores_ks -profile:v 4444 -alpha_bits {bits} -vendor apl0 \
                     -threads 4 -movflags +write_colr -f mov",
                    from_rgba(planes)
                )
            }
            Encoding::Webp => format!(
                "-vf {SMALL} -c:v libwebp_anim -quality 75 -compression_level 3 -loop 0 -f webp"
            ),
            Encoding::StillWebp => {
                "-c:v libwebp -pix_fmt yuva420p -quality 82 -compression_level 4 -f webp".to_owned()
            }
            Encoding::Thumb(quality) => format!(
                "-vf scale=w='min(320,iw)':h=-1:flags=area -c:v libwebp -pix_fmt yuva420p \
                 -quality {quality} -compression_level 4 -f webp"
            ),
            Encoding::Seekable => seekable(format),
            Encoding::Gif => format!(
                "-vf {SMALL},split[a][b];[a]palettegen=stats_mode=full[p];\
                 [b][p]paletteuse=dither=bayer:bayer_scale=4 -c:v gif -loop 0 -f gif"
            ),
        }
    }
}

/// Size and rate of a preview, never larger than those of the video.
const SMALL: &str = "fps=fps='min(15,source_fps)',scale=w='min(480,iw)':h=-1:flags=area";

/// Returns the filter from RGBA to BT.709 planes, with matching tags.
fn from_rgba(planes: &str) -> String {
    format!(
        "scale=out_color_matrix=bt709:out_range=tv:flags=bicubic+accurate_rnd+full_chroma_int,\
         format={planes},\
         setparams=range=tv:colorspace=bt709:color_primaries=bt709:color_trc=bt709"
    )
}

/// Returns the color tags of planar frames, as a filter.
fn tags(format: &VideoFormat) -> String {
    let range = match format.color.range {
        Range::Limited => "tv",
        Range::Full => "pc",
    };
    let matrix = match format.color.matrix {
        Matrix::Bt601 => "smpte170m",
        Matrix::Bt709 => "bt709",
    };
    // The RGB values are sRGB whatever the luma weights, so the primaries are those of BT.709.
    format!("setparams=range={range}:colorspace={matrix}:color_primaries=bt709:color_trc=bt709")
}

/// Returns the settings of H.264 for seeking: `-g` sets the distance of key frames, and without B-frames each
/// frame is shown as soon as it is decoded.
fn seekable(format: &VideoFormat) -> String {
    format!(
        "-vf {},scale=w='min(960,iw)':h=-2:flags=area -c:v libx264 -preset veryfast -profile:v high -crf 24 \
         -g 10 -bf 0 -threads 4 -x264-params cpu-independent=1 -bsf:v filter_units=remove_types=6 \
         -movflags +faststart -f mp4",
        tags(format)
    )
}

fn h264(format: &VideoFormat, quality: Quality) -> String {
    let Quality { crf, threads } = quality;
    // The bitstream filter removes the message in which x264 writes its version and settings. `subme` and
    // `me` are set below the preset, because most of a video is background. A better motion search saves
    // 5 to 9 % of size there, for a quarter of the time (docs/measurements.md).
    format!(
        "-vf {} -c:v libx264 -preset veryfast -profile:v high -crf {crf} -threads {threads} \
         -x264-params cpu-independent=1:subme=1:me=dia -bsf:v filter_units=remove_types=6 \
         -movflags +faststart -f mp4",
        tags(format)
    )
}

/// Returns the fraction nearest to a frame rate whose terms ffmpeg accepts (up to 1,001,000).
fn fraction(fps: f64) -> (u64, u64) {
    const MAX_TERM: f64 = 1_001_000.0;
    let (mut before, mut last, mut rest) = ((0.0, 1.0), (1.0, 0.0), fps);
    // Continued fraction: each step is the best approximation with terms of its size.
    loop {
        let whole = f64::floor(rest);
        let next = (whole * last.0 + before.0, whole * last.1 + before.1);
        if next.0 > MAX_TERM || next.1 > MAX_TERM {
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
    fn common_and_odd_rates_become_exact_fractions() {
        assert_eq!(fraction(25.0), (25, 1));
        assert_eq!(fraction(30000.0 / 1001.0), (30000, 1001));
        assert_eq!(fraction(1_000_000.0 / 33333.0), (1_000_000, 33333));
        assert_eq!(fraction(0.5), (1, 2));
    }
}
