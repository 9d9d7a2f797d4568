//! Animated WebP files. ffmpeg reads the other animated pictures, GIF and APNG, but not these before version 8.

use std::fs::File;
use std::io::{BufReader, ErrorKind, Read, Seek, SeekFrom};
use std::path::Path;

use image::codecs::webp::WebPDecoder;
use image::{AnimationDecoder, DynamicImage, Frames, ImageDecoder, ImageError, RgbaImage};

use crate::media::error::Error;
use crate::media::limits::Limits;

/// Number of bytes that [`is_animated_webp`] needs.
pub(super) const HEAD_BYTES: usize = 21;
/// Flag of an animation in the first byte of the chunk `VP8X`.
const IS_ANIMATED: u8 = 2;
/// Durations of pictures up to this one, milliseconds, stand for [`UNSET_MS`] in browsers.
const MAX_UNSET_MS: u32 = 10;
/// Duration of a picture whose duration is not set, milliseconds, in browsers.
const UNSET_MS: u32 = 100;

/// Returns whether a file begins like an animated WebP.
pub(super) fn is_animated_webp(head: &[u8]) -> bool {
    let has_chunks = head.starts_with(b"RIFF") && head.get(8..16) == Some(b"WEBPVP8X");
    has_chunks && head.get(20).is_some_and(|flags| flags & IS_ANIMATED > 0)
}

/// Returns the time of each picture, seconds from the first. Fails if the file is cut off.
///
/// Each picture is a chunk `ANMF`. Its bytes 12 to 14 are the duration of the picture.
pub(super) fn times_s(file: &mut (impl Read + Seek), limits: &Limits) -> Result<Vec<f64>, Error> {
    let n_bytes = file.seek(SeekFrom::End(0)).map_err(from_io)?;
    let mut head = [0; 23];
    let mut read_at = |place, bytes: &mut [u8]| {
        file.seek(SeekFrom::Start(place))
            .and_then(|_| file.read_exact(bytes))
            .map_err(from_io)
    };
    let length_in =
        |head: &[u8]| u64::from(u32::from_le_bytes([head[4], head[5], head[6], head[7]]));
    read_at(0, &mut head[..8])?;
    let end = 8 + length_in(&head);
    if end > n_bytes {
        return Err(Error::NotAVideo("the WebP is cut off".to_owned()));
    }
    let (mut times_s, mut time_ms, mut place) = (Vec::new(), 0_u64, 12);
    while place + 8 <= end {
        read_at(place, &mut head[..8])?;
        if &head[..4] == b"ANMF" {
            read_at(place, &mut head)?;
            times_s.push(time_ms as f64 / 1000.0);
            limits.check_n_frames(times_s.len())?;
            let duration_ms = u32::from_le_bytes([head[20], head[21], head[22], 0]);
            let is_unset = duration_ms <= MAX_UNSET_MS;
            time_ms += u64::from(if is_unset { UNSET_MS } else { duration_ms });
        }
        let length = length_in(&head);
        place += 8 + length + length % 2;
    }
    Ok(times_s)
}

/// A reader of the pictures of an animation, from the first to the last. Loops are not repeated.
pub(super) struct Animation<'a> {
    path: &'a Path,
    frames: Frames<'static>,
    has_alpha: bool,
    n_decoded: usize,
    /// The last decoded picture.
    last: RgbaImage,
}

impl<'a> Animation<'a> {
    pub(super) fn open(path: &'a Path, limits: &Limits) -> Result<Animation<'a>, Error> {
        let file = File::open(path).map_err(Error::io("opening the pictures"))?;
        let decoder = WebPDecoder::new(BufReader::new(file)).map_err(from_image)?;
        let (width, height) = decoder.dimensions();
        limits.check_size(width.into(), height.into())?;
        Ok(Animation {
            path,
            has_alpha: decoder.color_type().has_alpha(),
            frames: decoder.into_frames(),
            n_decoded: 0,
            last: RgbaImage::default(),
        })
    }

    /// Decodes a picture. Begins again at the first if the picture is before the last decoded one.
    pub(super) fn picture(&mut self, idx: usize, limits: &Limits) -> Result<DynamicImage, Error> {
        if idx + 1 < self.n_decoded {
            *self = Animation::open(self.path, limits)?;
        }
        while self.n_decoded <= idx {
            let frame = self.frames.next();
            let missing = || Error::NotAVideo("the WebP lacks a picture".to_owned());
            self.last = frame
                .ok_or_else(missing)?
                .map_err(from_image)?
                .into_buffer();
            self.n_decoded += 1;
        }
        let image = DynamicImage::ImageRgba8(self.last.clone());
        Ok(if self.has_alpha {
            image
        } else {
            image.into_rgb8().into()
        })
    }
}

fn from_image(error: ImageError) -> Error {
    match error {
        ImageError::IoError(error) => from_io(error),
        error => Error::NotAVideo(format!("the WebP cannot be read: {error}")),
    }
}

fn from_io(error: std::io::Error) -> Error {
    match error.kind() {
        ErrorKind::UnexpectedEof | ErrorKind::InvalidInput | ErrorKind::InvalidData => {
            Error::NotAVideo(format!("the WebP cannot be read: {error}"))
        }
        _ => Error::io("reading the pictures")(error),
    }
}

#[cfg(test)]
mod tests {
    use std::io::Cursor;

    use super::*;

    /// Returns a WebP of chunks: names and contents.
    fn webp(chunks: &[(&[u8; 4], &[u8])]) -> Vec<u8> {
        let mut bytes = b"RIFF\0\0\0\0WEBP".to_vec();
        for (name, contents) in chunks {
            bytes.extend(*name);
            bytes.extend((contents.len() as u32).to_le_bytes());
            bytes.extend(*contents);
            bytes.extend(&[0][..contents.len() % 2]);
        }
        let n_bytes = bytes.len() as u32 - 8;
        bytes[4..8].copy_from_slice(&n_bytes.to_le_bytes());
        bytes
    }

    fn shown_for(ms: u8) -> [u8; 19] {
        let mut contents = [0; 19];
        contents[12] = ms;
        contents
    }

    #[test]
    fn flag_tells_an_animation_from_a_still_picture() {
        let with = |flags| webp(&[(b"VP8X", &[flags, 0, 0, 0, 0, 0, 0, 0, 0, 0])]);
        assert!(is_animated_webp(&with(0x12)));
        assert!(!is_animated_webp(&with(0x10)));
        assert!(!is_animated_webp(&webp(&[(b"VP8L", &[2; 8])])));
    }

    #[test]
    fn times_follow_from_durations_and_unset_ones_are_those_of_browsers() {
        let pictures = [40, 0, 70, 10, 50].map(shown_for);
        let pictures = pictures.iter().map(|picture| (b"ANMF", &picture[..]));
        let chunks: Vec<(&[u8; 4], &[u8])> = [(b"ICCP", &[1; 7][..])]
            .into_iter()
            .chain(pictures)
            .collect();
        let bytes = webp(&chunks);
        let times = |bytes: &[u8]| times_s(&mut Cursor::new(bytes), &Limits::default());
        assert_eq!(times(&bytes).ok(), Some(vec![0.0, 0.04, 0.14, 0.21, 0.31]));
        assert!(matches!(
            times(&bytes[..bytes.len() - 2]),
            Err(Error::NotAVideo(_))
        ));
        let limits = Limits {
            max_frames: 4,
            ..Limits::default()
        };
        let refused = times_s(&mut Cursor::new(&bytes), &limits);
        assert!(matches!(refused, Err(Error::TooManyFrames { limit: 4 })));
    }
}
