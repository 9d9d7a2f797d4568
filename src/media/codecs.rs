//! Decoders and encoders of the installed ffmpeg, and the effect of each missing one. Distributions may leave
//! out patented codecs.

use std::collections::BTreeSet;

use super::error::Error;
use super::tools::query_ffmpeg;

/// Decoders by the format they read. The first one available is used.
const DECODERS: [(&str, &[&str]); 16] = [
    ("H.264", &["h264"]),
    ("H.265", &["hevc"]),
    ("VP8", &["vp8"]),
    ("VP9", &["vp9"]),
    ("AV1", &["libdav1d", "libaom-av1", "av1"]),
    ("MPEG-4", &["mpeg4"]),
    ("MPEG-2", &["mpeg2video"]),
    ("Motion JPEG", &["mjpeg"]),
    ("ProRes", &["prores"]),
    ("FFV1", &["ffv1"]),
    ("raw video", &["rawvideo"]),
    ("WMV 8", &["wmv2"]),
    ("WMV 9", &["wmv3"]),
    ("VC-1", &["vc1"]),
    ("GIF", &["gif"]),
    ("APNG", &["apng"]),
];

/// Encoders, each with the effect of its absence.
const ENCODERS: [(&str, &str); 5] = [
    (
        "libx264",
        "MP4 cannot be written, so flocks and overlays fail",
    ),
    ("libvpx-vp9", "WebM cannot be written"),
    ("prores_ks", "ProRes cannot be written"),
    ("libwebp_anim", "animated WebP cannot be written"),
    ("gif", "GIF cannot be written"),
];

/// Decoders and encoders of an ffmpeg, among those that flockreel uses.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Codecs {
    /// Names of the available ones.
    pub available: Vec<&'static str>,
    /// Names of the missing ones, each with the effect.
    pub missing: Vec<(&'static str, String)>,
}

impl Codecs {
    /// Queries the installed ffmpeg.
    pub fn installed() -> Result<Codecs, Error> {
        let decoders = query_ffmpeg(&["-hide_banner", "-decoders"])?;
        let encoders = query_ffmpeg(&["-hide_banner", "-encoders"])?;
        Ok(Codecs::from_listings(&decoders, &encoders))
    }

    fn from_listings(decoders: &str, encoders: &str) -> Codecs {
        let (decoders, encoders) = (names(decoders), names(encoders));
        let mut codecs = Codecs {
            available: Vec::new(),
            missing: Vec::new(),
        };
        for (film, names) in DECODERS {
            match names.iter().find(|name| decoders.contains(*name)) {
                Some(name) => codecs.available.push(name),
                None => {
                    let effect = format!("footage in {film} is refused");
                    codecs.missing.push((names[0], effect));
                }
            }
        }
        for (name, effect) in ENCODERS {
            if encoders.contains(name) {
                codecs.available.push(name)
            } else {
                codecs.missing.push((name, effect.to_owned()))
            }
        }
        codecs
    }
}

/// Returns the second word of each line of a list.
fn names(list: &str) -> BTreeSet<&str> {
    let words = list.lines().map(|line| line.split_whitespace().nth(1));
    words.flatten().collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn missing_codecs_are_listed_with_their_effect() {
        let decoders = " V....D vp9    Google VP9\n V....D libaom-av1   libaom AV1 (codec av1)\n";
        let codecs = Codecs::from_listings(decoders, " V..... gif    GIF\n");
        assert_eq!(codecs.available, ["vp9", "libaom-av1", "gif"]);
        let h264 = codecs.missing.iter().find(|(name, _)| *name == "h264");
        assert_eq!(h264.unwrap().1, "footage in H.264 is refused");
        assert_eq!(codecs.missing.len(), 16 + 5 - 3);
    }
}
