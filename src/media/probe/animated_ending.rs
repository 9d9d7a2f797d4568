//! Detection of animated pictures that are cut off: walks over the blocks of a GIF and the chunks of an APNG.

use std::fs::File;
use std::io::{self, BufReader, ErrorKind, Read, Seek};

/// Maximum number of blocks or chunks examined. A picture of a GIF has one per 255 bytes.
const MAX_BLOCKS: usize = 20_000_000;

/// Returns whether a GIF is cut off. Fails only if reading fails.
pub(super) fn is_cut_gif(file: &File) -> io::Result<bool> {
    is_cut(walk_gif(BufReader::new(file)))
}

/// Returns whether an APNG is cut off. Fails only if reading fails.
pub(super) fn is_cut_apng(file: &File) -> io::Result<bool> {
    is_cut(walk_apng(BufReader::new(file)))
}

fn is_cut(walk: io::Result<()>) -> io::Result<bool> {
    match walk {
        Ok(()) => Ok(false),
        Err(error) if error.kind() == ErrorKind::UnexpectedEof => Ok(true),
        Err(error) => Err(error),
    }
}

/// Reads to the trailer of a GIF (GIF89a, appendix B): header, colors, then extensions and pictures, each with its
/// data in blocks that begin with their length. The last block of each is empty.
fn walk_gif(mut file: BufReader<&File>) -> io::Result<()> {
    file.rewind()?;
    let header: [u8; 13] = array(&mut file)?;
    skip(&mut file, bytes_of_colors(header[10]))?;
    let mut n_blocks = 0;
    loop {
        match array(&mut file)? {
            [b'!'] => skip(&mut file, 1)?, // the label of an extension
            [b','] => {
                let picture: [u8; 9] = array(&mut file)?;
                skip(&mut file, bytes_of_colors(picture[8]) + 1)?;
            }
            _ => return Ok(()), // the trailer, or what no reader takes for a picture
        }
        while let [length @ 1..=255] = array(&mut file)? {
            skip(&mut file, length.into())?;
            n_blocks += 1;
            if n_blocks > MAX_BLOCKS {
                return Ok(());
            }
        }
    }
}

/// Returns the size of the table of colors that the flags announce, bytes.
fn bytes_of_colors(flags: u8) -> u64 {
    if flags & 0x80 > 0 {
        3 << ((flags & 7) + 1)
    } else {
        0
    }
}

/// Reads to the chunk `IEND` of a PNG: length, name, contents and checksum of each chunk.
fn walk_apng(mut file: BufReader<&File>) -> io::Result<()> {
    file.rewind()?;
    skip(&mut file, 8)?;
    for _ in 0..MAX_BLOCKS {
        let [a, b, c, d, name @ ..]: [u8; 8] = array(&mut file)?;
        skip(&mut file, u64::from(u32::from_be_bytes([a, b, c, d])) + 4)?;
        if &name == b"IEND" {
            break;
        }
    }
    Ok(())
}

fn array<const N: usize>(file: &mut impl Read) -> io::Result<[u8; N]> {
    let mut bytes = [0; N];
    file.read_exact(&mut bytes)?;
    Ok(bytes)
}

/// Skips bytes. Fails if the file ends before.
fn skip(file: &mut BufReader<&File>, n_bytes: u64) -> io::Result<()> {
    let Some(n_before_last) = n_bytes.checked_sub(1) else {
        return Ok(());
    };
    file.seek_relative(n_before_last as i64)?;
    array::<1>(file).map(drop)
}
