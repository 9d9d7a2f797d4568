//! Decoders and encoders of the installed ffmpeg, and the effect of each missing one. Distributions may leave
//! out patented codecs.

use std::collections::BTreeSet;

use super::error::Error;
use super::tools::{answer, whole_place};

/// Decoders by the format they read. The first one available is used.
const DECODERS: [(&str, &[&str]); 14] = [
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
pub struct Coders {
    /// Names of the available ones.
    pub has: Vec<&'static str>,
    /// Names of the missing ones, each with the effect.
    pub lacks: Vec<(&'static str, String)>,
}

impl Coders {
    /// Queries the installed ffmpeg.
    pub fn installed() -> Result<Coders, Error> {
        let place = whole_place()?;
        let decoders = answer(place, &["-hide_banner", "-decoders"], false)?;
        let encoders = answer(place, &["-hide_banner", "-encoders"], false)?;
        Ok(Coders::of(&decoders, &encoders))
    }

    fn of(decoders: &str, encoders: &str) -> Coders {
        let (decoders, encoders) = (names(decoders), names(encoders));
        let mut coders = Coders {
            has: Vec::new(),
            lacks: Vec::new(),
        };
        for (film, names) in DECODERS {
            match names.iter().find(|name| decoders.contains(*name)) {
                Some(name) => coders.has.push(name),
                None => {
                    let meaning = format!("footage in {film} is refused");
                    coders.lacks.push((names[0], meaning));
                }
            }
        }
        for (name, meaning) in ENCODERS {
            match encoders.contains(name) {
                true => coders.has.push(name),
                false => coders.lacks.push((name, meaning.to_owned())),
            }
        }
        coders
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
    fn a_build_without_patents_lacks_h264_and_says_what_that_means() {
        let decoders = " V....D vp9    Google VP9\n V....D libaom-av1   libaom AV1 (codec av1)\n";
        let coders = Coders::of(decoders, " V..... gif    GIF\n");
        assert_eq!(coders.has, ["vp9", "libaom-av1", "gif"]);
        let h264 = coders.lacks.iter().find(|(name, _)| *name == "h264");
        assert_eq!(h264.unwrap().1, "footage in H.264 is refused");
        assert_eq!(coders.lacks.len(), 14 + 5 - 3);
    }
}
