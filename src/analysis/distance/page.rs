//! One sprite in blocks, before it comes to its group (ALGORITHMS.md 5): drawn, or another one's mirror image.
//!
//! Only blocks that something is drawn to are looked at: most of a large sprite is blank.

use super::group::{BLANK, BLOCK, Block, Group, SIDE};

/// How a sprite is mirrored.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Flip {
    /// Columns reversed: the side view's left-right mirror.
    Columns,
    /// Rows reversed: an animal that heads along +x, mirrored across its own axis.
    Rows,
}

/// A sprite of width x height pixels, four bytes each, in blocks by rows; what is beyond its edges is 0.
pub(super) struct Page {
    width: usize,
    height: usize,
    blocks: Vec<Block>,
    /// Whether a block holds anything of this sprite, or what is left of another.
    drawn: Vec<bool>,
}

impl Page {
    /// For sprites of that size.
    pub(super) fn new([width, height]: [usize; 2]) -> Page {
        let n_blocks = width.div_ceil(SIDE) * height.div_ceil(SIDE);
        Page {
            width,
            height,
            blocks: vec![BLANK; n_blocks],
            drawn: vec![false; n_blocks],
        }
    }

    /// Forgets the sprite.
    pub(super) fn clear(&mut self) {
        self.drawn.fill(false);
    }

    /// The blocks that were drawn to, and which they are.
    pub(super) fn drawn(&self) -> impl Iterator<Item = (usize, &Block)> {
        let blocks = self.blocks.iter().enumerate().zip(&self.drawn);
        blocks.filter(|(_, drawn)| **drawn).map(|(block, _)| block)
    }

    /// Draws a sprite's bytes, row by row.
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

    /// Draws a sprite of a group mirrored.
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

    /// Draws the pixels of a row of a block in that column of blocks to where they stand in the mirror image.
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

    /// Row `y` of the blocks in that column of blocks.
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
