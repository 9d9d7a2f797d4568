//! Check of the index of an MP4 or QuickTime file (docs/explanation/promises.md, "Bad input"). ffmpeg repairs
//! or ignores a damaged index without an error: it drops the sound, or ends the film early.
//!
//! The index of a track is whole if its boxes fit into their parents, its sample tables (`stts`, `stsc`,
//! `stsz`, `stco`) hold as many entries as they say, and no chunk starts after the end of the file. The check
//! does not compare the tables with each other, because recorders disagree about that. It does not read the
//! fragments of a fragmented film, which [`Ending`](super::ending::Ending) covers.

use std::fs::File;
use std::io;
use std::os::unix::fs::FileExt;

/// Maximum number of boxes whose headers are read. A film of an hour in fragments of a second has 8000. In a
/// file with more, the rest counts as whole.
const MAX_BOXES: usize = 100_000;
/// Maximum number of chunk offsets that are read, of all tracks. Ten tracks of an hour with a chunk for every
/// frame have fewer. Further offsets count as good.
const MAX_OFFSETS: u64 = 4 << 20;
/// Number of bytes that are read at once from a table of chunk offsets.
const PIECE_BYTES: usize = 64 << 10;

/// The boxes around the sample tables of a track, from the outside (ISO/IEC 14496-12, table 1).
const PATH: [&[u8; 4]; 3] = [b"mdia", b"minf", b"stbl"];
/// Sample tables that every track has, with an alternative name.
const REQUIRED: [[&[u8; 4]; 2]; 4] = [
    [b"stts", b"stts"],
    [b"stsc", b"stsc"],
    [b"stsz", b"stz2"],
    [b"stco", b"co64"],
];

/// The state of the index: for each track, in the order of the file, whether its part is damaged. ffmpeg
/// numbers the streams in this order.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(super) struct MovIndex {
    damaged: Vec<bool>,
}

impl MovIndex {
    /// Reads the index of `file` of `n_bytes`. A file without an index has no damaged tracks. Fails only if
    /// reading fails.
    pub(super) fn read(file: &File, n_bytes: u64) -> io::Result<MovIndex> {
        let mut reader = Reader {
            file,
            n_bytes,
            n_boxes_left: MAX_BOXES,
            n_offsets_left: MAX_OFFSETS,
        };
        let whole_file = Part {
            start: 0,
            end: n_bytes,
            is_whole: true,
        };
        let Some(moov) = reader.find(whole_file, b"moov")? else {
            return Ok(MovIndex::default());
        };
        let boxes = reader.boxes(moov)?;
        // Films in fragments may omit the empty tables.
        let needs_tables = !boxes.iter().any(|(name, _)| name == b"mvex");
        let tracks = boxes.iter().filter(|(name, _)| name == b"trak");
        let damaged = tracks.map(|&(_, track)| Ok(!reader.is_whole_track(track, needs_tables)?));
        Ok(MovIndex {
            damaged: damaged.collect::<io::Result<_>>()?,
        })
    }

    /// Returns whether the index of any track is damaged.
    pub(super) fn is_damaged(&self) -> bool {
        self.damaged.contains(&true)
    }

    /// Returns whether the index of a stream is damaged.
    pub(super) fn is_damaged_for(&self, stream_idx: u64) -> bool {
        let stream_idx = usize::try_from(stream_idx).unwrap_or(usize::MAX);
        self.damaged.get(stream_idx) == Some(&true)
    }
}

/// The contents of a box, as far as they are inside its parent.
#[derive(Clone, Copy, Debug)]
struct Part {
    start: u64,
    end: u64,
    /// Whether the box ends within its parent.
    is_whole: bool,
}

/// A file of which a bounded number of boxes and offsets is read.
struct Reader<'a> {
    file: &'a File,
    n_bytes: u64,
    n_boxes_left: usize,
    n_offsets_left: u64,
}

impl Reader<'_> {
    /// Returns the `N` bytes at an offset of a part; `None` if the part ends before.
    fn at<const N: usize>(&self, part: Part, offset: u64) -> io::Result<Option<[u8; N]>> {
        let place = part.start.saturating_add(offset);
        if place.saturating_add(N as u64) > part.end {
            return Ok(None);
        }
        let mut bytes = [0; N];
        self.file.read_exact_at(&mut bytes, place)?;
        Ok(Some(bytes))
    }

    fn number(&self, part: Part, offset: u64) -> io::Result<Option<u64>> {
        let bytes = self.at::<4>(part, offset)?;
        Ok(bytes.map(|bytes| u64::from(u32::from_be_bytes(bytes))))
    }

    /// Returns the first box of a part, and the part after it. `None` at the end, or where no box can start.
    fn next_box(&mut self, part: Part) -> io::Result<Option<([u8; 4], Part, Part)>> {
        let Some([a, b, c, d, name @ ..]) = self.at::<8>(part, 0)? else {
            return Ok(None);
        };
        if self.n_boxes_left == 0 {
            return Ok(None);
        }
        self.n_boxes_left -= 1;
        let (n_head, n_bytes) = match u32::from_be_bytes([a, b, c, d]) {
            0 => (8, part.end - part.start), // extends to the end of its parent
            1 => match self.at::<8>(part, 8)? {
                Some(size) => (16, u64::from_be_bytes(size)),
                None => return Ok(None),
            },
            size => (8, u64::from(size)),
        };
        if n_bytes < n_head {
            return Ok(None);
        }
        let end = part.start.saturating_add(n_bytes);
        let contents = Part {
            start: part.start + n_head,
            end: end.min(part.end),
            is_whole: end <= part.end,
        };
        let rest = Part {
            start: contents.end,
            ..part
        };
        Ok(Some((name, contents, rest)))
    }

    /// Returns the boxes of a part.
    fn boxes(&mut self, mut part: Part) -> io::Result<Vec<([u8; 4], Part)>> {
        let mut boxes = Vec::new();
        while let Some((name, contents, rest)) = self.next_box(part)? {
            boxes.push((name, contents));
            part = rest;
        }
        Ok(boxes)
    }

    /// Returns the first box of a part with this name.
    fn find(&mut self, mut part: Part, name: &[u8; 4]) -> io::Result<Option<Part>> {
        while let Some((found, contents, rest)) = self.next_box(part)? {
            if &found == name {
                return Ok(Some(contents));
            }
            part = rest;
        }
        Ok(None)
    }

    /// Returns whether the boxes and tables of a track are whole. Tables may be absent unless `needs_tables`.
    /// Always true once the bounds of the reader are reached.
    fn is_whole_track(&mut self, track: Part, needs_tables: bool) -> io::Result<bool> {
        let mut part = track;
        let mut is_whole = track.is_whole;
        for name in PATH {
            match self.find(part, name)? {
                Some(found) => part = found,
                None => return Ok(self.n_boxes_left == 0),
            }
            is_whole &= part.is_whole;
        }
        let tables = self.boxes(part)?;
        for (name, table) in &tables {
            is_whole &= self.is_whole_table(name, *table)?;
        }
        let has = |names: &[&[u8; 4]; 2]| tables.iter().any(|(name, _)| names.contains(&name));
        is_whole &= !needs_tables || REQUIRED.iter().all(has);
        Ok(is_whole || self.n_boxes_left == 0)
    }

    /// Returns whether a sample table holds as many entries as it says. True for other boxes.
    fn is_whole_table(&mut self, name: &[u8; 4], table: Part) -> io::Result<bool> {
        // Version and flags, or the size of all samples, precede the number of entries.
        let (count_at, entry_bits) = match name {
            b"stts" | b"ctts" => (4, 64),
            b"stsc" => (4, 96),
            b"stco" => (4, 32),
            b"co64" => (4, 64),
            b"stsz" => match self.number(table, 4)? {
                Some(0) => (8, 32),
                _ => (8, 0), // all samples have the same size
            },
            b"stz2" => (
                8,
                self.at::<1>(table, 7)?.map_or(0, |[bits]| u64::from(bits)),
            ),
            _ => return Ok(true),
        };
        let Some(n_entries) = self.number(table, count_at)? else {
            return Ok(false);
        };
        let n_entry_bytes = (n_entries * entry_bits).div_ceil(8);
        let entries = Part {
            start: table.start + count_at + 4,
            ..table
        };
        if !table.is_whole || entries.start + n_entry_bytes > table.end {
            return Ok(false);
        }
        match name {
            b"stco" => self.are_within_file::<4>(entries, n_entries),
            b"co64" => self.are_within_file::<8>(entries, n_entries),
            _ => Ok(true),
        }
    }

    /// Returns whether all chunks start within the file. `N` is the number of bytes of an offset.
    fn are_within_file<const N: usize>(&mut self, entries: Part, n: u64) -> io::Result<bool> {
        let n_read = n.min(self.n_offsets_left);
        self.n_offsets_left -= n_read;
        let end = entries.start + n_read * N as u64;
        let mut piece = vec![0; PIECE_BYTES];
        let mut place = entries.start;
        while place < end {
            let piece = &mut piece[..(end - place).min(PIECE_BYTES as u64) as usize];
            self.file.read_exact_at(piece, place)?;
            let offset = |bytes: &[u8]| {
                bytes
                    .iter()
                    .fold(0, |sum, &byte| sum << 8 | u64::from(byte))
            };
            if piece
                .chunks_exact(N)
                .any(|bytes| offset(bytes) > self.n_bytes)
            {
                return Ok(false);
            }
            place += piece.len() as u64;
        }
        Ok(true)
    }
}

#[cfg(test)]
mod tests {
    use std::io::Write;
    use std::time::{Duration, Instant};

    use proptest::prelude::*;

    use super::*;

    fn read(bytes: &[u8]) -> MovIndex {
        let mut file = tempfile::tempfile().unwrap();
        file.write_all(bytes).unwrap();
        MovIndex::read(&file, bytes.len() as u64).unwrap()
    }

    fn boxed(name: &[u8; 4], contents: &[u8]) -> Vec<u8> {
        let n_bytes = u32::try_from(contents.len() + 8).unwrap();
        [&n_bytes.to_be_bytes(), &name[..], contents].concat()
    }

    fn table(name: &[u8; 4], numbers: &[u32]) -> Vec<u8> {
        let numbers: Vec<u8> = numbers.iter().flat_map(|n| n.to_be_bytes()).collect();
        boxed(name, &numbers)
    }

    fn track(tables: &[Vec<u8>]) -> Vec<u8> {
        let minf = boxed(b"minf", &boxed(b"stbl", &tables.concat()));
        boxed(
            b"trak",
            &[boxed(b"tkhd", &[0; 84]), boxed(b"mdia", &minf)].concat(),
        )
    }

    /// Tables of a track of two samples in one chunk at this offset.
    fn tables(chunk_at: u32) -> [Vec<u8>; 4] {
        [
            table(b"stts", &[0, 1, 2, 40]),
            table(b"stsc", &[0, 1, 1, 2, 1]),
            table(b"stsz", &[0, 0, 2, 10, 20]),
            table(b"stco", &[0, 1, chunk_at]),
        ]
    }

    fn film(tracks: &[Vec<u8>]) -> Vec<u8> {
        [
            boxed(b"ftyp", b"isom\0\0\0\0"),
            boxed(b"moov", &tracks.concat()),
        ]
        .concat()
    }

    #[test]
    fn each_table_with_too_few_entries_damages_its_own_track() {
        let whole = track(&tables(16));
        assert_eq!(
            read(&film(&[whole.clone(), whole.clone()])).damaged,
            [false, false]
        );
        let wrong = [
            table(b"stts", &[0, 2, 2, 40]),
            table(b"stsc", &[0, 2, 1, 2, 1]),
            table(b"stsz", &[0, 0, 3, 10, 20]),
            table(b"stco", &[0, 2, 16]),
            table(b"stco", &[0, 1, 4000]),
            table(b"stz2", &[0, 16, 3, 0x000a_0014]),
            table(b"co64", &[0, 1, 1, 16]),
            table(b"free", &[0, 1]),
        ];
        for (k, wrong) in [0, 1, 2, 3, 3, 2, 3, 0].into_iter().zip(wrong) {
            let mut tables = tables(16);
            tables[k] = wrong.clone();
            let index = read(&film(&[whole.clone(), track(&tables)]));
            assert_eq!(index.damaged, [false, true], "{wrong:?}");
            assert!(index.is_damaged() && index.is_damaged_for(1) && !index.is_damaged_for(0));
        }
    }

    #[test]
    fn compact_and_long_tables_and_uniform_sizes_are_whole() {
        let mut tables = tables(16);
        for (k, table) in [
            (2, table(b"stsz", &[0, 4, 2000])),
            (2, table(b"stz2", &[0, 4, 3, 0x1230_0000])),
            (3, table(b"co64", &[0, 1, 0, 16])),
        ] {
            tables[k] = table;
            assert_eq!(read(&film(&[track(&tables)])).damaged, [false], "{k}");
        }
    }

    #[test]
    fn box_larger_than_its_parent_is_damaged() {
        let film = film(&[track(&tables(16)), track(&tables(16))]);
        for name in [b"trak", b"mdia", b"minf", b"stbl"] {
            let mut film = film.clone();
            let last = film.windows(4).rposition(|bytes| bytes == name).unwrap();
            film[last - 2] += 1;
            assert_eq!(read(&film).damaged, [false, true], "{name:?}");
        }
        for n_kept in film.len() - 20..film.len() {
            assert_eq!(read(&film[..n_kept]).damaged, [false, true], "{n_kept}");
        }
    }

    #[test]
    fn fragmented_film_needs_no_tables_and_other_data_have_no_index() {
        let empty = track(&[]);
        assert_eq!(read(&film(std::slice::from_ref(&empty))).damaged, [true]);
        assert_eq!(read(&film(&[empty, boxed(b"mvex", &[])])).damaged, [false]);
        assert_eq!(read(b"no boxes at all"), MovIndex::default());
        assert_eq!(read(b""), MovIndex::default());
    }

    #[test]
    fn hostile_boxes_cost_little() {
        let start = Instant::now();
        // A million empty boxes, a table of all bytes, and boxes of extreme sizes.
        let boxes = boxed(b"free", &[]).repeat(1 << 20);
        assert!(!read(&film(&[track(&[boxes])])).is_damaged());
        let offsets = [0_u32, u32::MAX]
            .iter()
            .chain(&[0; 1 << 22])
            .copied()
            .collect::<Vec<_>>();
        assert!(read(&film(&[track(&[table(b"stco", &offsets)])])).is_damaged());
        for size in [u64::MAX, u64::MAX - 8, 1 << 63, 16, 15, 0] {
            let huge = [&1_u32.to_be_bytes(), &b"trak"[..], &size.to_be_bytes()].concat();
            assert!(read(&film(&[huge])).damaged.len() <= 1);
        }
        assert!(start.elapsed() < Duration::from_secs(30));
    }

    proptest! {
        #[test]
        fn changed_bytes_never_panic(changes in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 1..20)) {
            let mut film = film(&[track(&tables(16)), track(&tables(16))]);
            for (at, byte) in changes {
                let at = at.index(film.len());
                film[at] = byte;
            }
            read(&film);
        }
    }
}
