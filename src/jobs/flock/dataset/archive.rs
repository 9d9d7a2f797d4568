//! ZIP archive of a data set, in pieces that are stored apart: the entries of each flock, then those of the other files with
//! the directory. One after the other, the pieces are the archive, so it is sent without a second copy
//! (docs/reference/formats.md, "Data sets"). Files are stored, not deflated: most are compressed pictures. All have the same
//! date, so equal files give equal archives. Large archives use Zip64 (PKWARE, APPNOTE 6.3, sections 4.3 and 4.5).

use std::fs::File;
use std::io::{self, Read, Write};
use std::path::Path;

use serde::{Deserialize, Serialize};

use super::files::Record;

/// Name of a piece in the folder of a part and in that of the data set.
pub const PIECE: &str = "entries";
/// Least value that a field of 32 bits cannot hold: it says that the value is in the extra field.
const IN_EXTRA: u64 = u32::MAX as u64;
/// The same of a field of 16 bits.
const MANY: u64 = u16::MAX as u64;
/// The first of January 1980, the first date that the format knows.
const DATE: u16 = 1 << 5 | 1;
/// Version of the format that readers need: 2.0, or 4.5 with Zip64.
const VERSIONS: [u16; 2] = [20, 45];
/// Permissions of a file on Unix, in the upper half of the attributes: a regular file that its owner may write.
const ATTRIBUTES: u32 = 0o100_644 << 16;

/// A file in a piece.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(super) struct Entry {
    record: Record,
    crc32: u32,
}

/// Appends a file below `root` to a piece.
pub(super) fn append(piece: &mut impl Write, root: &Path, record: Record) -> io::Result<Entry> {
    let path = root.join(&record.path);
    let crc32 = crc32_of(&path)?;
    let entry = Entry { record, crc32 };
    piece.write_all(&entry.local_header())?;
    let n_bytes = io::copy(&mut File::open(&path)?, piece)?;
    if n_bytes == entry.record.bytes {
        Ok(entry)
    } else {
        Err(io::Error::other("a file of the data set has changed"))
    }
}

/// Appends the directory of an archive to its last piece. `entries` are those of all pieces, in their order.
pub(super) fn finish(
    piece: &mut impl Write,
    entries: impl Iterator<Item = io::Result<Entry>>,
) -> io::Result<()> {
    let mut headers = Vec::new();
    let (mut offset, mut n) = (0, 0);
    for entry in entries {
        let entry = entry?;
        headers.extend(entry.central_header(offset));
        offset += entry.n_bytes();
        n += 1;
    }
    piece.write_all(&headers)?;
    piece.write_all(&end(n, headers.len() as u64, offset))
}

impl Entry {
    /// Returns path, size and hash of the file.
    pub(super) fn record(&self) -> Record {
        self.record.clone()
    }

    /// Returns the size of the header and the content, bytes.
    fn n_bytes(&self) -> u64 {
        self.local_header().len() as u64 + self.record.bytes
    }

    fn is_large(&self) -> bool {
        self.record.bytes >= IN_EXTRA
    }

    fn local_header(&self) -> Vec<u8> {
        let mut header = b"PK\x03\x04".to_vec();
        self.add_common(&mut header, self.is_large());
        let extra = if self.is_large() {
            extra(&[self.record.bytes; 2])
        } else {
            Vec::new()
        };
        header.extend((extra.len() as u16).to_le_bytes());
        header.extend(self.record.path.as_bytes());
        header.extend(extra);
        header
    }

    fn central_header(&self, offset: u64) -> Vec<u8> {
        let mut values = Vec::new();
        if self.is_large() {
            values.extend([self.record.bytes; 2]);
        }
        if offset >= IN_EXTRA {
            values.push(offset);
        }
        let extra = extra(&values);
        let mut header = b"PK\x01\x02".to_vec();
        // Made on Unix, by the newest version.
        header.extend((3 << 8 | VERSIONS[1]).to_le_bytes());
        self.add_common(&mut header, !values.is_empty());
        header.extend((extra.len() as u16).to_le_bytes());
        // No comment, the first disk, and no internal attributes.
        header.extend([0; 6]);
        header.extend(ATTRIBUTES.to_le_bytes());
        header.extend(in_32_bits(offset));
        header.extend(self.record.path.as_bytes());
        header.extend(extra);
        header
    }

    /// Adds what both headers have: from the version up to the length of the name.
    fn add_common(&self, header: &mut Vec<u8>, has_extra: bool) {
        header.extend(VERSIONS[usize::from(has_extra)].to_le_bytes());
        // No flags, stored, at midnight.
        header.extend([0; 6]);
        header.extend(DATE.to_le_bytes());
        header.extend(self.crc32.to_le_bytes());
        header.extend(in_32_bits(self.record.bytes));
        header.extend(in_32_bits(self.record.bytes));
        header.extend((self.record.path.len() as u16).to_le_bytes());
    }
}

/// Returns the end of an archive with `n` entries, whose directory has `n_bytes` and begins at `offset`.
fn end(n: u64, n_bytes: u64, offset: u64) -> Vec<u8> {
    let mut end = Vec::new();
    if n >= MANY || n_bytes >= IN_EXTRA || offset >= IN_EXTRA {
        end.extend(b"PK\x06\x06");
        // Bytes that follow.
        end.extend(44u64.to_le_bytes());
        end.extend((3 << 8 | VERSIONS[1]).to_le_bytes());
        end.extend(VERSIONS[1].to_le_bytes());
        // One disk.
        end.extend([0; 8]);
        for value in [n, n, n_bytes, offset] {
            end.extend(value.to_le_bytes());
        }
        end.extend(b"PK\x06\x07");
        end.extend([0; 4]);
        end.extend((offset + n_bytes).to_le_bytes());
        end.extend(1u32.to_le_bytes());
    }
    end.extend(b"PK\x05\x06");
    end.extend([0; 4]);
    for _ in 0..2 {
        end.extend((n.min(MANY) as u16).to_le_bytes());
    }
    end.extend(in_32_bits(n_bytes));
    end.extend(in_32_bits(offset));
    // No comment.
    end.extend([0; 2]);
    end
}

/// Returns the extra field of Zip64 with these values; empty without values.
fn extra(values: &[u64]) -> Vec<u8> {
    if values.is_empty() {
        return Vec::new();
    }
    let mut extra = 1u16.to_le_bytes().to_vec();
    extra.extend((8 * values.len() as u16).to_le_bytes());
    extra.extend(values.iter().flat_map(|value| value.to_le_bytes()));
    extra
}

fn in_32_bits(value: u64) -> [u8; 4] {
    (value.min(IN_EXTRA) as u32).to_le_bytes()
}

fn crc32_of(path: &Path) -> io::Result<u32> {
    let mut file = File::open(path)?;
    let (mut hasher, mut buffer) = (crc32fast::Hasher::new(), vec![0; 1 << 16]);
    loop {
        let n = file.read(&mut buffer)?;
        if n == 0 {
            return Ok(hasher.finalize());
        }
        hasher.update(&buffer[..n]);
    }
}

#[cfg(test)]
mod tests {
    use std::fs;

    use super::super::files::write_hashed;
    use super::*;

    #[test]
    fn pieces_are_an_archive_together() {
        let root = tempfile::tempdir().unwrap();
        let contents = [
            ("a/1.txt", vec![b'x'; 70_000]),
            ("b.txt", b"b".to_vec()),
            ("c", vec![]),
        ];
        let (mut pieces, mut entries) = (Vec::new(), Vec::new());
        for (path, content) in &contents {
            let record = write_hashed(root.path(), path, content).unwrap();
            entries.push(append(&mut pieces, root.path(), record).unwrap());
        }
        finish(&mut pieces, entries.into_iter().map(Ok)).unwrap();
        let mut archive = zip::ZipArchive::new(io::Cursor::new(pieces)).unwrap();
        assert_eq!(archive.len(), contents.len());
        for (path, content) in contents {
            let mut found = Vec::new();
            archive
                .by_name(path)
                .unwrap()
                .read_to_end(&mut found)
                .unwrap();
            assert_eq!(found, content);
        }
    }

    #[test]
    fn more_than_65534_files_need_zip64() {
        let root = tempfile::tempdir().unwrap();
        let file = fs::write(root.path().join("0"), b"x");
        file.unwrap();
        let (mut pieces, mut entries) = (Vec::new(), Vec::new());
        let record = write_hashed(root.path(), "0", b"x").unwrap();
        let first = append(&mut pieces, root.path(), record).unwrap();
        for k in 0..70_000 {
            let mut entry = first.clone();
            entry.record.path = k.to_string();
            pieces.extend(entry.local_header());
            pieces.push(b'x');
            entries.push(entry);
        }
        entries.insert(0, first);
        finish(&mut pieces, entries.into_iter().map(Ok)).unwrap();
        let archive = zip::ZipArchive::new(io::Cursor::new(pieces)).unwrap();
        assert!(archive.len() >= 70_000, "{}", archive.len());
    }

    #[test]
    fn values_beyond_32_bits_are_in_the_extra_field() {
        let record = |bytes| Record {
            path: "x".into(),
            bytes,
            sha256: String::new(),
        };
        let entry = |bytes| Entry {
            record: record(bytes),
            crc32: 7,
        };
        assert_eq!(entry(1).local_header().len(), 31);
        assert_eq!(entry(1 << 32).local_header().len(), 31 + 20);
        assert_eq!(entry(1).central_header(IN_EXTRA - 1).len(), 47);
        assert_eq!(entry(1).central_header(1 << 32).len(), 47 + 12);
        let header = entry(1 << 33).central_header(1 << 34);
        let values: Vec<u8> = [1u64 << 33, 1 << 33, 1 << 34]
            .iter()
            .flat_map(|v| v.to_le_bytes())
            .collect();
        assert_eq!(header[47 + 4..], values);
        assert_eq!(end(3, 10, IN_EXTRA).len(), 56 + 20 + 22);
        assert_eq!(end(3, 10, 20).len(), 22);
    }
}
