//! Conversion of a canvas to the planes of an encoder: luma of every pixel, chroma of 2 x 2 blocks
//! (docs/explanation/algorithms.md, "Compositing").

use super::Canvas;
use crate::cpu::Level;
use crate::geometry::Rect;
use crate::raster::Frame;
use crate::raster::color::FromQuads;
use crate::raster::resample::Quad;

impl Frame {
    /// Writes a box of an opaque canvas into the planes: the pixels and chroma of every 2 x 2 block that the
    /// box touches.
    ///
    /// Panics if the sizes of canvas and frame differ.
    pub fn draw_canvas(&mut self, canvas: &Canvas, rect: Rect, cpu: Level) {
        let sizes = [(canvas.width, canvas.height), (self.width, self.height)];
        assert_eq!(sizes[0], sizes[1], "sizes differ");
        if rect.is_empty() {
            return;
        }
        let from = self.color.from_quads();
        let (width, height) = (self.width as usize, self.height as usize);
        let chroma_width = self.chroma_width() as usize;
        let (luma, chroma) = self.planes.split_at_mut(width * height);
        let (u_plane, v_plane) = chroma.split_at_mut(chroma.len() / 2);
        let (x0, x1) = (rect.x as usize / 2, (rect.right() as usize).div_ceil(2));
        let (left, right) = (2 * x0, (2 * x1).min(width));
        for by in rect.y as usize / 2..(rect.bottom() as usize).div_ceil(2) {
            // At an odd bottom edge the last row is used twice.
            let lines = [2 * by, (2 * by + 1).min(height - 1)];
            let rows = lines.map(|y| &canvas.pixels[y * width + left..y * width + right]);
            for (row, y) in rows.iter().zip(lines) {
                let luma = &mut luma[y * width + left..y * width + right];
                luma_row(&from, row, luma, cpu);
            }
            let out = by * chroma_width + x0..by * chroma_width + x1;
            let planes = [&mut u_plane[out.clone()], &mut v_plane[out]];
            chroma_row(&from, rows, planes, cpu);
        }
    }
}

fn luma_row(from: &FromQuads, row: &[Quad], luma: &mut [u8], cpu: Level) {
    let n_done = match cpu {
        #[cfg(target_arch = "x86_64")]
        Level::Avx2 | Level::Avx512 if is_x86_feature_detected!("avx2") => {
            #[expect(unsafe_code, reason = "a kernel for AVX2")]
            // SAFETY: the match guard checked AVX2, the only feature that the callee requires.
            unsafe {
                super::avx2::luma_row(from, row, luma)
            }
        }
        _ => 0,
    };
    for (luma, pixel) in luma.iter_mut().zip(row).skip(n_done) {
        *luma = from.luma([pixel[0], pixel[1], pixel[2]]);
    }
}

fn chroma_row(from: &FromQuads, rows: [&[Quad]; 2], [us, vs]: [&mut [u8]; 2], cpu: Level) {
    let n_done = match cpu {
        #[cfg(target_arch = "x86_64")]
        Level::Avx2 | Level::Avx512 if is_x86_feature_detected!("avx2") => {
            #[expect(unsafe_code, reason = "a kernel for AVX2")]
            // SAFETY: the match guard checked AVX2, the only feature that the callee requires.
            unsafe {
                super::avx2::chroma_row(from, rows, [us, vs])
            }
        }
        _ => 0,
    };
    let last = rows[0].len() - 1;
    for (k, (u, v)) in us.iter_mut().zip(vs).enumerate().skip(n_done) {
        // At an odd right edge the last pixel is used twice.
        let columns = [2 * k, (2 * k + 1).min(last)];
        let block = columns.map(|x| rows.map(|row| row[x]));
        let sum =
            std::array::from_fn(|c| block.as_flattened().iter().map(|p| i32::from(p[c])).sum());
        [*u, *v] = from.chroma_of_block(sum);
    }
}
