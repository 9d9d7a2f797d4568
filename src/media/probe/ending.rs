//! Detection of files that are cut off (docs/explanation/promises.md, "Bad input"). The duration in the
//! header does not show this: it may be that of the audio, or a recorder may not have updated it. Instead,
//! the module looks for a box, chunk or page that extends beyond the end of the file, and at its contents.

use std::fs::File;
use std::io;
use std::os::unix::fs::FileExt;

use super::animated_ending;
use crate::media::container::Container;

/// The end of a file in relation to its structure.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Ending {
    /// The file is complete, or its container has no structure that could be missing.
    Whole,
    /// The file ends after the pictures, for example inside an index.
    AfterPictures,
    /// The file ends inside samples that an index lists. Reading the packets shows which are missing.
    InsideSamples,
    /// The file ends inside the data that holds pictures and audio.
    InsideData,
}

/// Maximum number of structures examined. In a file with more, each is far smaller than any picture.
const MAX_STEPS: usize = 2_000_000;

/// Boxes besides `mdat` and `moof` that may come last (ISO/IEC 14496-12, table 1; QuickTime File Format).
const TRAILING_BOXES: [&[u8; 4]; 13] = [
    b"moov", b"free", b"skip", b"wide", b"udta", b"meta", b"uuid", b"mfra", b"sidx", b"styp",
    b"ftyp", b"pdin", b"emsg",
];

/// Largest Ogg page, bytes: a header of 27, 255 lengths, 255 segments of 255.
const MAX_OGG_PAGE: u64 = 27 + 255 + 255 * 255;

impl Ending {
    /// Returns how a file ends whose pictures are `cut` or go on to its end.
    fn of_data(cut: bool) -> Ending {
        if cut {
            Ending::InsideData
        } else {
            Ending::Whole
        }
    }

    /// Returns how `file` of `n_bytes` ends. Fails only if reading fails.
    pub(super) fn detect(container: Container, file: &File, n_bytes: u64) -> io::Result<Ending> {
        let bytes = Bytes { file, n_bytes };
        match container {
            Container::Mov => bytes.ending_of_mov(),
            Container::Matroska => bytes.ending_of_matroska(),
            Container::Avi => bytes.ending_of_avi(),
            Container::Asf => bytes.ending_of_asf(),
            Container::Flv => bytes.ending_of_flv(),
            Container::Ogg => bytes.ending_of_ogg(),
            Container::Gif => animated_ending::is_cut_gif(file).map(Ending::of_data),
            Container::Apng => animated_ending::is_cut_apng(file).map(Ending::of_data),
            // A sequence of packets without an overall structure.
            Container::MpegTs | Container::MpegPs | Container::H264 | Container::Hevc => {
                Ok(Ending::Whole)
            }
        }
    }
}

/// A file that is read at given offsets.
struct Bytes<'a> {
    file: &'a File,
    n_bytes: u64,
}

/// Header of a Matroska element.
struct EbmlHeader {
    id: u64,
    /// Size of the contents, bytes; `None` if unknown.
    size: Option<u64>,
    /// Length of the header, bytes.
    n_bytes: u64,
}

impl Bytes<'_> {
    /// Returns the `N` bytes at an offset; `None` if the file ends before.
    fn at<const N: usize>(&self, place: u64) -> io::Result<Option<[u8; N]>> {
        let mut bytes = [0; N];
        match self.file.read_exact_at(&mut bytes, place) {
            Ok(()) => Ok(Some(bytes)),
            Err(error) if error.kind() == io::ErrorKind::UnexpectedEof => Ok(None),
            Err(error) => Err(error),
        }
    }

    /// A sequence of boxes, each with its size (32 or 64 bits, big-endian) and name.
    fn ending_of_mov(&self) -> io::Result<Ending> {
        let mut place = 0_u64;
        for _ in 0..MAX_STEPS {
            if place == self.n_bytes {
                return Ok(Ending::Whole);
            }
            let Some([a, b, c, d, name @ ..]) = self.at::<8>(place)? else {
                return Ok(Ending::AfterPictures);
            };
            let n_bytes = match u32::from_be_bytes([a, b, c, d]) {
                0 => return Ok(Ending::Whole), // extends to the end of the file
                1 => match self.at::<8>(place + 8)? {
                    Some(size) => u64::from_be_bytes(size),
                    None => return Ok(Ending::InsideData),
                },
                size => u64::from(size),
            };
            let end = place.saturating_add(n_bytes.max(8));
            if end > self.n_bytes {
                return Ok(match &name {
                    b"mdat" => Ending::InsideSamples,
                    b"moof" => Ending::InsideData,
                    name if TRAILING_BOXES.contains(&name) => Ending::AfterPictures,
                    _ => Ending::Whole, // not a box: appended data
                });
            }
            place = end;
        }
        Ok(Ending::Whole)
    }

    /// The header, then a segment of known or unknown size, which contains clusters, indices and tags.
    fn ending_of_matroska(&self) -> io::Result<Ending> {
        const SEGMENT: u64 = 0x1853_8067;
        const CLUSTER: u64 = 0x1f43_b675;
        let mut place = 0_u64;
        let mut segment_end = None;
        for _ in 0..MAX_STEPS {
            let is_past = segment_end.flatten().is_some_and(|end| place >= end);
            if place == self.n_bytes || is_past {
                break;
            }
            let Some(header) = self.ebml_header(place)? else {
                return Ok(Ending::InsideData);
            };
            let contents = place.saturating_add(header.n_bytes);
            let end = header.size.map(|size| contents.saturating_add(size));
            match (header.id, end) {
                (SEGMENT, end) if segment_end.is_none() => {
                    segment_end = Some(end);
                    place = contents;
                }
                // The end of a cluster without a size is found by reading its packets.
                (_, None) => return Ok(Ending::Whole),
                (CLUSTER, Some(end)) if end > self.n_bytes => return Ok(Ending::InsideData),
                (_, Some(end)) if end > self.n_bytes => return Ok(Ending::AfterPictures),
                (_, Some(end)) => place = end,
            }
        }
        Ok(match segment_end.flatten() {
            Some(end) if end > self.n_bytes => Ending::InsideData,
            _ => Ending::Whole,
        })
    }

    fn ebml_header(&self, place: u64) -> io::Result<Option<EbmlHeader>> {
        let Some((id, n_id)) = self.ebml_number(place, false)? else {
            return Ok(None);
        };
        let Some((size, n_size)) = self.ebml_number(place + n_id, true)? else {
            return Ok(None);
        };
        let is_unknown = size == (1 << (7 * n_size)) - 1;
        Ok(Some(EbmlHeader {
            id,
            size: (!is_unknown).then_some(size),
            n_bytes: n_id + n_size,
        }))
    }

    /// Returns a number of variable length and its length in bytes. The leading zeros give the length. The
    /// marker bit after them is optionally removed.
    fn ebml_number(&self, place: u64, without_marker: bool) -> io::Result<Option<(u64, u64)>> {
        let Some([first]) = self.at::<1>(place)? else {
            return Ok(None);
        };
        let n_bytes = u64::from(first.leading_zeros()) + 1;
        if n_bytes > 8 {
            return Ok(None);
        }
        let marker = 0x80_u64 >> (n_bytes - 1);
        let mut number = u64::from(first) & if without_marker { marker - 1 } else { u64::MAX };
        for k in 1..n_bytes {
            let Some([byte]) = self.at::<1>(place + k)? else {
                return Ok(None);
            };
            number = number << 8 | u64::from(byte);
        }
        Ok(Some((number, n_bytes)))
    }

    /// One or more `RIFF` chunks, each with a list `movi` of pictures and audio. A size of 0 was never
    /// written.
    fn ending_of_avi(&self) -> io::Result<Ending> {
        let mut place = 0;
        let mut riff_end = 0;
        for _ in 0..MAX_STEPS {
            let (Some([a, b, c, d, size @ ..]), kind) =
                (self.at::<8>(place)?, self.at::<4>(place + 8)?)
            else {
                break;
            };
            let size = u32::from_le_bytes(size);
            let end = place + 8 + u64::from(size) + u64::from(size % 2);
            match (&[a, b, c, d], kind.as_ref()) {
                (b"RIFF", _) => {
                    riff_end = end;
                    place += 12;
                    continue;
                }
                (b"LIST", Some(b"movi")) if size == 0 => return Ok(Ending::Whole),
                (b"LIST", Some(b"movi")) if end > self.n_bytes => return Ok(Ending::InsideData),
                _ => {}
            }
            if place >= riff_end || end > self.n_bytes {
                break; // after the last RIFF, or cut off
            }
            place = end;
        }
        if riff_end > self.n_bytes + 1 {
            Ok(Ending::AfterPictures)
        } else {
            Ok(Ending::Whole)
        }
    }

    /// Objects with an identifier of 16 bytes and a size of 8. The second or a later one holds all packets.
    fn ending_of_asf(&self) -> io::Result<Ending> {
        const DATA: [u8; 16] = *b"\x36\x26\xb2\x75\x8e\x66\xcf\x11\xa6\xd9\x00\xaa\x00\x62\xce\x6c";
        let mut place = 0_u64;
        for _ in 0..MAX_STEPS {
            if place == self.n_bytes {
                break;
            }
            let Some(head) = self.at::<24>(place)? else {
                return Ok(Ending::AfterPictures);
            };
            let (id, size) = head.split_at(16);
            let mut eight = [0; 8];
            eight.copy_from_slice(size);
            let size = u64::from_le_bytes(eight);
            if size < 24 {
                break; // size was never written, as in a broadcast
            }
            let end = place.saturating_add(size);
            if end > self.n_bytes {
                return Ok(if id == DATA {
                    Ending::InsideData
                } else {
                    Ending::AfterPictures
                });
            }
            place = end;
        }
        Ok(Ending::Whole)
    }

    /// A header of 9 bytes, then tags: 11 bytes and their data. The size of each tag is repeated after it,
    /// but may be missing after the last one.
    fn ending_of_flv(&self) -> io::Result<Ending> {
        let mut place = 9_u64;
        for _ in 0..MAX_STEPS {
            if place == self.n_bytes || place + 4 == self.n_bytes {
                return Ok(Ending::Whole);
            }
            let Some([_, _, _, _, kind, length @ ..]) = self.at::<8>(place)? else {
                return Ok(Ending::InsideData);
            };
            if ![8, 9, 18].contains(&(kind & 0x1f)) {
                return Ok(Ending::Whole); // not a tag: appended data
            }
            place += 15 + u64::from(u32::from_be_bytes([0, length[0], length[1], length[2]]));
            if place > self.n_bytes {
                return Ok(Ending::InsideData);
            }
        }
        Ok(Ending::Whole)
    }

    /// Pages that contain their own length. The last page must end within the file.
    fn ending_of_ogg(&self) -> io::Result<Ending> {
        let from = self.n_bytes.saturating_sub(2 * MAX_OGG_PAGE);
        let mut tail = vec![0; (self.n_bytes - from) as usize];
        self.file.read_exact_at(&mut tail, from)?;
        let mut starts = tail.windows(5).enumerate().rev();
        let Some((at, _)) = starts.find(|(_, bytes)| *bytes == b"OggS\0") else {
            return Ok(Ending::InsideData);
        };
        let n_pieces = tail.get(at + 26).copied().unwrap_or(0) as usize;
        let Some(pieces) = tail.get(at + 27..at + 27 + n_pieces) else {
            return Ok(Ending::InsideData);
        };
        let n_bytes: usize = pieces.iter().map(|&piece| usize::from(piece)).sum();
        Ok(if at + 27 + n_pieces + n_bytes <= tail.len() {
            Ending::Whole
        } else {
            Ending::InsideData
        })
    }
}

#[cfg(test)]
mod tests {
    use std::io::Write;

    use super::*;

    fn ending(container: Container, bytes: &[u8]) -> Ending {
        let mut file = tempfile::tempfile().unwrap();
        file.write_all(bytes).unwrap();
        Ending::detect(container, &file, bytes.len() as u64).unwrap()
    }

    #[test]
    fn mov_cut_in_its_index_keeps_its_pictures_and_one_cut_in_its_data_does_not() {
        let boxed = |name: &[u8], n_bytes: u32| {
            [&n_bytes.to_be_bytes(), name, &vec![0; n_bytes as usize - 8]].concat()
        };
        let film = [boxed(b"ftyp", 24), boxed(b"mdat", 100), boxed(b"moov", 60)].concat();
        for (n_kept, expected) in [
            (184, Ending::Whole),
            (170, Ending::AfterPictures),
            (124, Ending::Whole),
            (100, Ending::InsideSamples),
        ] {
            assert_eq!(
                ending(Container::Mov, &film[..n_kept]),
                expected,
                "{n_kept} bytes"
            );
        }
    }

    #[test]
    fn appended_data_does_not_count_as_a_cut() {
        let film = [b"\0\0\0\x10ftypisom\0\0\0\0".as_slice(), b"\nTEXT and more"].concat();
        assert_eq!(ending(Container::Mov, &film), Ending::Whole);
    }

    #[test]
    fn avi_of_unknown_size_is_whole() {
        let chunk =
            |name: &[u8], size: u32, inside: &[u8]| [name, &size.to_le_bytes(), inside].concat();
        let movi = |size| chunk(b"LIST", size, &[b"movi".as_slice(), &[0; 100]].concat());
        let avi = |riff, size| chunk(b"RIFF", riff, &[b"AVI ".to_vec(), movi(size)].concat());
        assert_eq!(ending(Container::Avi, &avi(116, 104)), Ending::Whole);
        assert_eq!(ending(Container::Avi, &avi(0, 0)), Ending::Whole);
        assert_eq!(
            ending(Container::Avi, &avi(300, 104)),
            Ending::AfterPictures
        );
        assert_eq!(ending(Container::Avi, &avi(300, 288)), Ending::InsideData);
    }

    #[test]
    fn malicious_sizes_do_not_loop() {
        for container in [
            Container::Mov,
            Container::Matroska,
            Container::Avi,
            Container::Asf,
            Container::Flv,
            Container::Ogg,
            Container::Gif,
            Container::Apng,
        ] {
            for byte in [0x00, 0x01, 0x7f, 0x80, 0xff] {
                ending(container, &[byte; 70_000]);
                ending(container, &[byte; 3]);
            }
        }
    }
}
