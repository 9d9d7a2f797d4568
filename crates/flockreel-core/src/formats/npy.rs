//! distance.npy: the matrix D in NumPy's format, of shape (N-f+1, N-f+1), as u32, or u64 if a distance needs
//! it.
//!
//! The format is version 1.0 of NumPy's NEP 1. It has a magic number, a Python literal padded to a multiple
//! of 64 bytes, and the numbers in C order, little-endian.

use std::io::{self, Write};

use crate::analysis::similarity::distance::DistanceMatrix;
use crate::code::Code;

/// Maximum number of frames. Longer footage is refused, because its matrix would exceed 256 MB.
pub const MAX_FRAMES: usize = 8192;

/// Reasons why the matrix cannot be written.
#[derive(Debug, PartialEq, Eq, thiserror::Error)]
pub enum Error {
    /// The footage is too long for a whole matrix.
    #[error(
        "the library has {n_frames} frames, but a full matrix is limited to {MAX_FRAMES}: use distance.png, which has \
         no limit, or analyze a shorter part"
    )]
    TooManyFrames {
        /// Number of frames of the footage.
        n_frames: usize,
    },
}

impl Error {
    /// Returns the stable code.
    pub fn code(&self) -> Code {
        match self {
            Error::TooManyFrames { .. } => Code::TooManyFrames,
        }
    }
}

/// Checks that a footage is short enough for a whole matrix. Call it before computing the matrix.
pub fn check(n_frames: usize) -> Result<(), Error> {
    match n_frames {
        0..=MAX_FRAMES => Ok(()),
        _ => Err(Error::TooManyFrames { n_frames }),
    }
}

/// Writes the matrix. Fails only if the writer fails.
pub fn write(matrix: &DistanceMatrix, out: &mut impl Write) -> io::Result<()> {
    let n = matrix.n_clips();
    let wide = matrix.max() > u64::from(u32::MAX);
    out.write_all(&header(if wide { "<u8" } else { "<u4" }, n))?;
    let mut bytes = Vec::with_capacity(n * 8);
    for i in 0..n {
        bytes.clear();
        for j in 0..n {
            let distance = matrix.distance(i, j).to_le_bytes();
            bytes.extend_from_slice(if wide { &distance } else { &distance[..4] });
        }
        out.write_all(&bytes)?;
    }
    Ok(())
}

fn header(kind: &str, n: usize) -> Vec<u8> {
    const PREFIX: usize = 10;
    let mut text = format!("{{'descr': '{kind}', 'fortran_order': False, 'shape': ({n}, {n}), }}")
        .into_bytes();
    let padded = (PREFIX + text.len() + 1).next_multiple_of(64) - PREFIX;
    text.resize(padded - 1, b' ');
    text.push(b'\n');
    let mut header = b"\x93NUMPY\x01\x00".to_vec();
    header.extend_from_slice(&(padded as u16).to_le_bytes());
    header.extend_from_slice(&text);
    header
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::analysis::similarity::distance::tests::matrix_of_gray_levels;

    #[test]
    fn bytes_are_those_of_numpy() {
        let mut bytes = Vec::new();
        write(&matrix_of_gray_levels(&[0, 3, 1], 1), &mut bytes).expect("memory takes all");
        // The output of numpy.save for numpy.array([[0, 9, 3], [9, 0, 6], [3, 6, 0]], "<u4").
        let mut wanted = b"\x93NUMPY\x01\x00\x76\x00".to_vec();
        wanted.extend_from_slice(b"{'descr': '<u4', 'fortran_order': False, 'shape': (3, 3), }");
        wanted.resize(127, b' ');
        wanted.push(b'\n');
        for distance in [0u32, 9, 3, 9, 0, 6, 3, 6, 0] {
            wanted.extend_from_slice(&distance.to_le_bytes());
        }
        assert_eq!(bytes, wanted);
    }

    #[test]
    fn footage_above_8192_frames_is_refused() {
        assert_eq!(check(8192), Ok(()));
        let refusal = check(8193).expect_err("too long");
        assert_eq!(refusal.code(), Code::TooManyFrames);
        assert!(refusal.to_string().contains("distance.png"));
    }

    #[test]
    fn distances_beyond_32_bits_are_written_in_64() {
        let matrix = DistanceMatrix::from_triangle(2, vec![0, 1 << 40, 0]);
        let mut bytes = Vec::new();
        write(&matrix, &mut bytes).expect("memory takes all");
        assert!(matrix.max() > u64::from(u32::MAX));
        assert_eq!(
            bytes[128 + 8..128 + 16],
            matrix.distance(0, 1).to_le_bytes()
        );
    }
}
