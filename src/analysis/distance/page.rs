//! A buffer for one sprite in blocks: a drawn sprite, or the mirror image of another. Only blocks with
//! content are processed, because most of a large sprite is blank.

use super::group::{BLANK, BLOCK, Block, Group, SIDE};

/// The way a sprite is mirrored.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Flip {
    /// Columns reversed: left-right mirroring in side view.
    Columns,
    /// Rows reversed: mirroring across the body axis of an animal that heads along +x.
    Rows,
}

/// A sprite of width x height pixels with four bytes each, in blocks by rows. Pixels outside it are 0.
pub(super) struct Page {
    width: usize,
    height: usize,
    blocks: Vec<Block>,
    /// True for blocks with content of the current sprite. Other blocks may hold content of an earlier
    /// sprite.
    drawn: Vec<bool>,
}

impl Page {
    /// Creates a buffer for sprites of a given size.
    pub(super) fn new([width, height]: [usize; 2]) -> Page {
        let n_blocks = width.div_ceil(SIDE) * height.div_ceil(SIDE);
        Page {
            width,
            height,
            blocks: vec![BLANK; n_blocks],
            drawn: vec![false; n_blocks],
        }
    }

    /// Removes the sprite.
    pub(super) fn clear(&mut self) {
        self.drawn.fill(false);
    }

    /// Returns the blocks with content, with their indices.
    pub(super) fn drawn(&self) -> impl Iterator<Item = (usize, &Block)> {
        let blocks = self.blocks.iter().enumerate().zip(&self.drawn);
        blocks.filter(|(_, drawn)| **drawn).map(|(block, _)| block)
    }

    /// Draws a sprite from its bytes, row by row.
    pub(super) fn draw(&mut self, bytes: &[u8]) {
        let rows = bytes.as_chunks().0.chunks_exact(self.width.max(1));
        for (y, row) in rows.enumerate() {
            for (column, pixels) in row.chunks(SIDE).enumerate() {
                if pixels.iter().any(|pixel| *pixel != [0; 4]) {
                    self.pixels([column, y])[..pixels.len()].copy_from_slice(pixels);
                }
            }
        }
    }

    /// Draws the mirror image of a sprite of a group.
    pub(super) fn draw_mirrored(&mut self, group: Group<'_>, sprite: usize, flip: Flip) {
        let n_columns = self.n_columns();
        let filled = |block: &usize| group.filled(*block) >> sprite & 1 == 1;
        for block in (0..self.blocks.len()).filter(filled) {
            let (column, top) = (block % n_columns, block / n_columns * SIDE);
            let rows = group
                .block(block, sprite)
                .0
                .as_chunks()
                .0
                .chunks_exact(SIDE);
            for (y, pixels) in (top..self.height).zip(rows) {
                match flip {
                    Flip::Rows => self
                        .pixels([column, self.height - 1 - y])
                        .copy_from_slice(pixels),
                    Flip::Columns => self.draw_reversed([column, y], pixels),
                }
            }
        }
    }

    /// Draws one pixel row of a block at its position in the left-right mirror image. `column` is the column
    /// of blocks, `y` the row of pixels.
    fn draw_reversed(&mut self, [column, y]: [usize; 2], pixels: &[[u8; 4]]) {
        let inside = SIDE.min(self.width - column * SIDE);
        let mut reversed = [[0; 4]; SIDE];
        let pairs = reversed.iter_mut().zip(pixels[..inside].iter().rev());
        pairs.for_each(|(to, from)| *to = *from);
        let first = self.width - column * SIDE - inside;
        let (column, x) = (first / SIDE, first % SIDE);
        let here = inside.min(SIDE - x);
        self.pixels([column, y])[x..x + here].copy_from_slice(&reversed[..here]);
        if here < inside {
            self.pixels([column + 1, y])[..inside - here].copy_from_slice(&reversed[here..inside]);
        }
    }

    /// Returns pixel row `y` of a column of blocks, and marks the block as drawn.
    fn pixels(&mut self, [column, y]: [usize; 2]) -> &mut [[u8; 4]] {
        let block = y / SIDE * self.n_columns() + column;
        if !self.drawn[block] {
            self.drawn[block] = true;
            self.blocks[block] = BLANK;
        }
        let bytes = &mut self.blocks[block].0[y % SIDE * BLOCK / SIDE..][..BLOCK / SIDE];
        bytes.as_chunks_mut().0
    }

    fn n_columns(&self) -> usize {
        self.width.div_ceil(SIDE)
    }
}
