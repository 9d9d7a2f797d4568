//! Detection of the container from the first bytes of a file, never from its name. A playlist or a script
//! with the name of a video must not be opened as one (docs/explanation/promises.md, "Bad input"). The
//! detected demuxer is forced on ffmpeg, so that ffmpeg does not guess.

use super::error::Error;

/// Number of bytes that [`Container::detect`] needs.
pub(super) const HEAD_BYTES: usize = 4096;

/// Accepted containers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Container {
    /// MP4, QuickTime and related formats.
    Mov,
    /// Matroska and WebM.
    Matroska,
    /// RIFF AVI.
    Avi,
    /// MPEG transport stream.
    MpegTs,
    /// ASF, WMV.
    Asf,
    /// MPEG program stream: MPEG-1 and MPEG-2 files, DVD.
    MpegPs,
    /// Flash video.
    Flv,
    /// Ogg.
    Ogg,
    /// GIF: animated, or a still picture.
    Gif,
    /// Animated PNG.
    Apng,
    /// H.264 elementary stream: no container and no timestamps.
    H264,
    /// H.265 elementary stream: no container and no timestamps.
    Hevc,
}

/// Signatures of files that are not video: (offset, bytes, kind).
const PICTURES: [(usize, &[u8], &str); 5] = [
    (0, b"\x89PNG", "a still image"),
    (0, b"\xff\xd8\xff", "a still image"),
    (0, b"BM", "a still image"),
    (8, b"WEBP", "a still image"),
    (0, b"%PDF", "a document"),
];

/// Signatures of audio files.
const SOUNDS: [(usize, &[u8]); 6] = [
    (8, b"WAVE"),
    (0, b"fLaC"),
    (0, b"ID3"),
    (0, b"\xff\xfb"),
    (0, b"\xff\xf1"),
    (8, b"AIFF"),
];

/// Signatures of containers that are not accepted.
const OTHER_CONTAINERS: [(usize, &[u8], &str); 6] = [
    (0, b"DKIF", "ivf"),
    (0, b"YUV4MPEG2", "yuv4mpeg"),
    (
        0,
        b"\0\0\x01\xb3",
        "an MPEG-1 or MPEG-2 stream without a container",
    ),
    (0, b"\0\0\x01\xb0", "an MPEG-4 stream without a container"),
    (0, b"\x06\x0e\x2b\x34", "mxf"),
    (0, b".RMF", "realmedia"),
];

/// Brands of still images in the MP4 container.
const STILL_BRANDS: [&[u8; 4]; 6] = [b"heic", b"heix", b"mif1", b"msf1", b"avif", b"avis"];

impl Container {
    /// Returns the container of a file. `head` is its first [`HEAD_BYTES`] bytes, or the whole file if
    /// shorter.
    pub(super) fn detect(head: &[u8]) -> Result<Container, Error> {
        let has = |at: usize, magic: &[u8]| head.get(at..at + magic.len()) == Some(magic);
        if has(0, b"\x1a\x45\xdf\xa3") {
            return Ok(Container::Matroska);
        }
        if has(0, b"RIFF") && has(8, b"AVI ") {
            return Ok(Container::Avi);
        }
        if has(0, b"\x30\x26\xb2\x75\x8e\x66\xcf\x11\xa6\xd9") {
            return Ok(Container::Asf);
        }
        if is_mov(head) {
            return if STILL_BRANDS.iter().any(|b| has(4, b"ftyp") && has(8, *b)) {
                Err(Error::NotAVideo("a still image".into()))
            } else {
                Ok(Container::Mov)
            };
        }
        if is_transport_stream(head) {
            return Ok(Container::MpegTs);
        }
        if has(0, b"\0\0\x01\xba") {
            return Ok(Container::MpegPs);
        }
        if has(0, b"FLV\x01") {
            return Ok(Container::Flv);
        }
        if has(0, b"OggS\0") {
            return Ok(Container::Ogg);
        }
        if has(0, b"GIF87a") || has(0, b"GIF89a") {
            return Ok(Container::Gif);
        }
        if is_animated_png(head) {
            return Ok(Container::Apng);
        }
        if let Some(stream) = elementary_stream(head) {
            return Ok(stream);
        }
        if let Some((_, _, name)) = OTHER_CONTAINERS.iter().find(|c| has(c.0, c.1)) {
            return Err(Error::ContainerNotAllowed(name));
        }
        if SOUNDS.iter().any(|s| has(s.0, s.1)) {
            return Err(Error::NoVideoStream);
        }
        let kind = match PICTURES.iter().find(|p| has(p.0, p.1)) {
            Some((_, _, kind)) => kind,
            None if head.is_empty() => "the file is empty",
            None if std::str::from_utf8(head).is_ok() => "a text",
            None => "the file format is unknown",
        };
        Err(Error::NotAVideo(kind.into()))
    }

    /// Returns the name of the demuxer for ffmpeg's `-f`.
    pub(super) fn demuxer(self) -> &'static str {
        match self {
            Container::Mov => "mov",
            Container::Matroska => "matroska",
            Container::Avi => "avi",
            Container::MpegTs => "mpegts",
            Container::Asf => "asf",
            Container::MpegPs => "mpeg",
            Container::Flv => "flv",
            Container::Ogg => "ogg",
            Container::Gif => "gif",
            Container::Apng => "apng",
            Container::H264 => "h264",
            Container::Hevc => "hevc",
        }
    }

    /// Returns whether the file is an elementary stream, without timestamps. Its frame rate is in the stream
    /// header or unknown.
    pub(super) fn is_elementary_stream(self) -> bool {
        matches!(self, Container::H264 | Container::Hevc)
    }
}

/// Returns the codec of an elementary stream, which begins with a start code and has a parameter set near the
/// start.
///
/// H.264 (ITU-T H.264, 7.3.1): the unit header is one byte with type 7 in the low five bits; a known profile
/// follows. H.265 (ITU-T H.265, 7.3.1.2): the unit header is two bytes, type 32 or 33 in bits 1 to 6, layer
/// 0, temporal id 1.
fn elementary_stream(head: &[u8]) -> Option<Container> {
    const H264_PROFILES: [u8; 10] = [44, 66, 77, 88, 100, 110, 118, 122, 128, 244];
    let starts = head.windows(3).enumerate();
    let starts = starts.filter(|(_, bytes)| *bytes == b"\0\0\x01");
    let mut units = starts.map(|(at, _)| (at, &head[at + 3..])).peekable();
    if head[..units.peek()?.0].iter().any(|&byte| byte != 0) || units.peek()?.0 > 1 {
        return None;
    }
    units.find_map(|(_, unit)| match *unit {
        [0x40 | 0x42, 0x01, ..] => Some(Container::Hevc),
        [kind, profile, ..] if kind & 0x9f == 7 && H264_PROFILES.contains(&profile) => {
            Some(Container::H264)
        }
        _ => None,
    })
}

/// Returns whether a PNG has the chunk `acTL` of an animation before its first picture.
fn is_animated_png(head: &[u8]) -> bool {
    let mut rest = head.strip_prefix(b"\x89PNG\r\n\x1a\n");
    while let Some([a, b, c, d, name @ ..]) = rest {
        if name.starts_with(b"acTL") {
            return true;
        }
        let length = u32::from_be_bytes([*a, *b, *c, *d]) as usize;
        // Length, name and checksum take 12 bytes.
        let is_before_picture = !name.starts_with(b"IDAT");
        rest = rest.filter(|_| is_before_picture);
        rest = rest.and_then(|chunk| chunk.get(length.saturating_add(12)..));
    }
    false
}

/// Returns whether the file begins with a known QuickTime box of a plausible size.
fn is_mov(head: &[u8]) -> bool {
    let Some((size, name)) = head.get(..8).map(|b| b.split_at(4)) else {
        return false;
    };
    let size = u32::from_be_bytes([size[0], size[1], size[2], size[3]]);
    let known: [&[u8]; 7] = [
        b"ftyp", b"moov", b"mdat", b"wide", b"free", b"skip", b"styp",
    ];
    // The brand list is short. This excludes a text that contains these letters.
    let longest = if name == b"ftyp" { 4096 } else { u32::MAX };
    known.contains(&name) && (8..=longest).contains(&size) || (name == b"mdat" && size <= 1)
}

/// Returns whether sync bytes repeat at the distance of a packet (188 or 192 bytes), at least four times.
fn is_transport_stream(head: &[u8]) -> bool {
    [(188, 0), (192, 4)].iter().any(|&(step, first)| {
        let mut syncs = head.iter().skip(first).step_by(step);
        head.len() > first + 3 * step && syncs.all(|&byte| byte == 0x47)
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use flockreel_core::code::Code;

    fn code_of(head: &[u8]) -> Code {
        Container::detect(head)
            .expect_err("these bytes are no accepted container")
            .code()
    }

    #[test]
    fn accepted_containers_are_detected_by_their_first_bytes() {
        let mut packets = vec![0; 188 * 6];
        packets.iter_mut().step_by(188).for_each(|b| *b = 0x47);
        let cases: [(&[u8], Container); 10] = [
            (b"\0\0\0\x20ftypisom", Container::Mov),
            (b"\x1a\x45\xdf\xa3\x01", Container::Matroska),
            (b"RIFF\x10\0\0\0AVI LIST", Container::Avi),
            (&packets, Container::MpegTs),
            (b"\0\0\x01\xba\x44\0", Container::MpegPs),
            (b"FLV\x01\x05\0\0\0\x09", Container::Flv),
            (b"OggS\0\x02", Container::Ogg),
            (b"\0\0\0\x01\x27\x64\0\x28", Container::H264),
            (
                b"\0\0\0\x01\x09\x10\0\0\x01\x67\x42\xc0\x1e",
                Container::H264,
            ),
            (b"\0\0\0\x01\x40\x01\x0c\x01", Container::Hevc),
        ];
        for (head, container) in cases {
            assert_eq!(Container::detect(head).ok(), Some(container));
        }
    }

    #[test]
    fn other_files_have_the_code_of_their_kind() {
        assert_eq!(code_of(b""), Code::NotAVideo);
        assert_eq!(
            code_of(b"#EXTM3U\n#EXTINF:1,\nother.mp4\n"),
            Code::NotAVideo
        );
        assert_eq!(code_of(b"ffconcat version 1.0\n"), Code::NotAVideo);
        assert_eq!(code_of(b"\0\0\0\x20ftypheic"), Code::NotAVideo);
        assert_eq!(code_of(b"\x89PNG\r\n"), Code::NotAVideo);
        assert_eq!(code_of(b"RIFF\x10\0\0\0WAVEfmt "), Code::NoVideoStream);
        for head in [
            &b"DKIF\0\0\x20\0"[..],
            b"\0\0\x01\xb3\x28\x01",
            b"\0\0\x01\xb0\xf5\0",
        ] {
            assert_eq!(code_of(head), Code::ContainerNotAllowed);
        }
        // Start codes are not sufficient: a parameter set must follow, and nothing may precede them.
        assert_eq!(code_of(b"\0\0\x01\x05\xff\xff"), Code::NotAVideo);
        assert_eq!(code_of(b"\0\0\0\0\0\0\x01\x67\x64"), Code::NotAVideo);
        assert_eq!(code_of(b"\xff\0\0\x01\x67\x64"), Code::NotAVideo);
    }

    #[test]
    fn text_that_contains_a_box_name_is_no_mov() {
        assert_eq!(code_of(b"see ftyp"), Code::NotAVideo);
    }
}
