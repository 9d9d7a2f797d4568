//! Archive of pictures of the frames of a footage (docs/reference/formats.md, "mattes.zip"): a zip with
//! uncompressed entries 000000.png ... Any tool opens it, and one picture can be read without the others. A
//! frame may have none.

use std::io::{Read, Seek, Write};

use rayon::prelude::*;
use zip::write::SimpleFileOptions;

/// Reasons why a file is not such an archive.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// The file is damaged.
    #[error("{0}")]
    Zip(#[from] zip::result::ZipError),
    /// The file has unexpected contents.
    #[error("{0}")]
    Mismatch(&'static str),
}

/// Position of a picture in an archive.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Entry {
    /// Offset of its first byte.
    pub at: u64,
    /// Length, bytes.
    pub n_bytes: usize,
}

/// Number of pictures that are encoded in parallel and held in memory. Free choice.
const BATCH: usize = 256;

/// Returns the name of a frame's picture in archives and folders.
pub fn frame_name(frame_idx: usize) -> String {
    format!("{frame_idx:06}.png")
}

/// Writes the pictures of the given frames, in order, as made by `encode`. Returns the writer.
pub fn write<W: Write + Seek>(
    out: W,
    frames: impl Iterator<Item = usize>,
    encode: impl Fn(usize) -> Vec<u8> + Sync,
) -> Result<W, zip::result::ZipError> {
    let mut archive = zip::ZipWriter::new(out);
    let stored = SimpleFileOptions::default().compression_method(zip::CompressionMethod::Stored);
    let frames: Vec<usize> = frames.collect();
    for batch in frames.chunks(BATCH) {
        let pictures: Vec<Vec<u8>> = batch.par_iter().map(|&idx| encode(idx)).collect();
        for (&idx, bytes) in batch.iter().zip(pictures) {
            archive.start_file(frame_name(idx), stored)?;
            archive.write_all(&bytes)?;
        }
    }
    archive.finish()
}

/// Returns the position of each of `n_frames` frames' pictures in an archive of `n_bytes`.
pub fn entries(
    archive: impl Read + Seek,
    n_bytes: u64,
    n_frames: usize,
) -> Result<Vec<Option<Entry>>, Error> {
    let mut archive = zip::ZipArchive::new(archive)?;
    let mut entries = vec![None; n_frames];
    for idx in 0..archive.len() {
        let entry = archive.by_index(idx)?;
        let frame_idx = (entry.name()?.strip_suffix(".png")).and_then(|stem| stem.parse().ok());
        let slot = frame_idx.and_then(|idx: usize| entries.get_mut(idx));
        let slot = slot.ok_or(Error::Mismatch(
            "the archive has an entry that is no frame of the footage",
        ))?;
        let stored = entry.compression() == zip::CompressionMethod::Stored;
        let ends = |at: &u64| at.checked_add(entry.size());
        let at =
            (entry.data_start()).filter(|at| stored && ends(at).is_some_and(|end| end <= n_bytes));
        let at = at.ok_or(Error::Mismatch(
            "an entry of the archive is compressed or incomplete",
        ))?;
        *slot = Some(Entry {
            at,
            n_bytes: entry.size() as usize,
        });
    }
    check_overlap(&entries)?;
    Ok(entries)
}

/// Checks that no two entries share bytes. A small archive could otherwise expand to any number of pictures.
fn check_overlap(entries: &[Option<Entry>]) -> Result<(), Error> {
    let mut spans: Vec<(u64, usize)> = (entries.iter().flatten())
        .map(|entry| (entry.at, entry.n_bytes))
        .collect();
    spans.sort_unstable();
    let overlap = |pair: &[(u64, usize)]| pair[0].0 + pair[0].1 as u64 > pair[1].0;
    if spans.windows(2).any(overlap) {
        return Err(Error::Mismatch("entries of the archive overlap"));
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use std::io::Cursor;

    use super::*;

    #[test]
    fn entries_locate_the_pictures_and_other_archives_are_refused() {
        let encode = |idx: usize| vec![idx as u8; idx + 1];
        let archive = write(Cursor::new(Vec::new()), [0, 2, 3].into_iter(), encode);
        let bytes = archive.expect("memory has room").into_inner();
        let read = |n_bytes, n_frames| entries(Cursor::new(&bytes), n_bytes, n_frames);
        let all = bytes.len() as u64;
        let found = read(all, 4).expect("our own archive");
        assert_eq!(found[1], None);
        for idx in [0, 2, 3] {
            let Entry { at, n_bytes } = found[idx].expect("an entry");
            assert_eq!(bytes[at as usize..][..n_bytes], encode(idx));
        }
        assert!(matches!(read(all, 3), Err(Error::Mismatch(_))));
        assert!(matches!(read(40, 4), Err(Error::Mismatch(_))));
        let cut_off = entries(Cursor::new(&bytes[..50]), 50, 4);
        assert!(matches!(cut_off, Err(Error::Zip(_))));
    }

    #[test]
    fn entries_that_share_bytes_are_refused() {
        let entry = |at, n_bytes| Some(Entry { at, n_bytes });
        assert!(check_overlap(&[entry(10, 5), None, entry(4, 6), entry(15, 0)]).is_ok());
        for overlapping in [[entry(4, 6), entry(4, 6)], [entry(9, 1), entry(4, 6)]] {
            assert!(check_overlap(&overlapping).is_err(), "{overlapping:?}");
        }
    }
}
