//! Stores sprites in groups of 48, divided into blocks, in the layout that the kernels read.
//!
//! A block has 16 x 16 pixels. Block 0 of all 48 sprites precedes block 1. A tile of 48 x 48 distances
//! therefore reads two runs of at most 48 KB at a time. Most of a large sprite is blank; all blank blocks
//! share one copy. Bytes after the last sprite and after the last pixel of a block are 0.

use std::ops::Range;

use crate::scratch::{Full, Scratch};

/// Number of sprites in a group, which is the side of a tile of distances.
pub(super) const GROUP: usize = 48;
/// Size of a block, bytes.
pub(super) const BLOCK_BYTES: usize = BLOCK_SIDE * BLOCK_SIDE * 4;
/// Side of a block, pixels. Small, because the animal then fills few blocks and two blank blocks need no
/// comparison.
const BLOCK_SIDE: usize = 16;

/// 16 x 16 pixels of a sprite, aligned to cache lines.
#[derive(Clone, Copy)]
#[repr(C, align(64))]
pub(super) struct Block(pub(super) [u8; BLOCK_BYTES]);

const BLANK: Block = Block([0; BLOCK_BYTES]);

/// The division of a sprite with four bytes per pixel into blocks, row by row.
#[derive(Clone, Copy)]
pub(super) struct BlockGrid {
    /// Width of the sprite, pixels.
    pub(super) width: usize,
    /// Height of the sprite, pixels.
    pub(super) height: usize,
}

impl BlockGrid {
    /// Returns the size of the sprite, bytes.
    pub(super) fn n_bytes(self) -> usize {
        self.width * self.height * 4
    }

    fn n_blocks(self) -> usize {
        self.width.div_ceil(BLOCK_SIDE) * self.height.div_ceil(BLOCK_SIDE)
    }

    /// Returns the pixel rows of a block as ranges of bytes, in the block and in the sprite.
    fn rows(self, block: usize) -> impl Iterator<Item = (Range<usize>, Range<usize>)> {
        let n_columns = self.width.div_ceil(BLOCK_SIDE);
        let (left, top) = (
            block % n_columns * BLOCK_SIDE,
            block / n_columns * BLOCK_SIDE,
        );
        let n_bytes = 4 * BLOCK_SIDE.min(self.width - left);
        (0..BLOCK_SIDE.min(self.height - top)).map(move |y| {
            let in_block = 4 * BLOCK_SIDE * y;
            let in_sprite = 4 * ((top + y) * self.width + left);
            (in_block..in_block + n_bytes, in_sprite..in_sprite + n_bytes)
        })
    }
}

/// The blocks of a group, with buffers that the next group reuses.
#[derive(Default)]
pub(super) struct GroupBuffer {
    /// One blank block, then the blocks that are not blank.
    blocks: Vec<Block>,
    /// Index into `blocks`, by block, then by sprite.
    places: Vec<u32>,
    /// Sum of the bytes of each block, in the same order as `places`.
    sums: Vec<u32>,
    /// For each block, the sprites in which it is not blank: bit k is sprite k.
    filled: Vec<u64>,
    /// Buffers: blocks in the order of the sprites, and bytes for the temporary storage.
    by_sprite: Vec<Block>,
    packed: Vec<u8>,
}

impl GroupBuffer {
    /// Replaces the content with `n_sprites` sprites. `draw` writes all bytes of a sprite, row by row.
    pub(super) fn fill(
        &mut self,
        n_sprites: usize,
        grid: BlockGrid,
        mut draw: impl FnMut(usize, &mut [u8]),
    ) {
        self.by_sprite.clear();
        for list in [&mut self.places, &mut self.sums] {
            list.clear();
            list.resize(grid.n_blocks() * GROUP, 0);
        }
        let mut bytes = vec![0; grid.n_bytes()];
        for sprite in 0..n_sprites {
            draw(sprite, &mut bytes);
            for k in 0..grid.n_blocks() {
                let mut block = BLANK;
                for (in_block, in_sprite) in grid.rows(k) {
                    block.0[in_block].copy_from_slice(&bytes[in_sprite]);
                }
                let sum: u32 = block.0.iter().map(|&byte| u32::from(byte)).sum();
                if sum > 0 {
                    self.sums[k * GROUP + sprite] = sum;
                    self.places[k * GROUP + sprite] = self.by_sprite.len() as u32;
                    self.by_sprite.push(block);
                }
            }
        }
        self.blocks.clear();
        self.blocks.push(BLANK);
        let filled = self
            .places
            .iter()
            .zip(&self.sums)
            .filter(|(_, sum)| **sum > 0);
        let blocks = filled.map(|(place, _)| self.by_sprite[*place as usize]);
        self.blocks.extend(blocks);
        self.find_places();
    }

    /// Computes `places` and `filled` from the sums. The blocks that are not blank are in order.
    fn find_places(&mut self) {
        let mut n_filled = 0;
        let place = |&sum: &u32| {
            n_filled += u32::from(sum > 0);
            if sum > 0 { n_filled } else { 0 }
        };
        self.places.clear();
        self.places.extend(self.sums.iter().map(place));
        let bits = |sums: &[u32]| {
            let each = (0..).zip(sums);
            each.fold(0, |bits, (k, &sum)| bits | u64::from(sum > 0) << k)
        };
        self.filled.clear();
        self.filled.extend(self.sums.chunks(GROUP).map(bits));
    }

    /// Returns the content as a group of `n_sprites` sprites.
    pub(super) fn as_group(&self, n_sprites: usize) -> Group<'_> {
        Group {
            n_sprites,
            blocks: &self.blocks,
            places: &self.places,
            sums: &self.sums,
            filled: &self.filled,
        }
    }

    /// Returns the size of all blocks that are not blank, bytes.
    pub(super) fn n_bytes(&self) -> usize {
        (self.blocks.len() - 1) * BLOCK_BYTES
    }

    /// Frees the buffers.
    pub(super) fn shrunk(mut self) -> GroupBuffer {
        (self.by_sprite, self.packed) = Default::default();
        self.blocks.shrink_to_fit();
        self
    }

    /// Writes the blocks that are not blank to the temporary storage.
    pub(super) fn spill(mut self, scratch: &dyn Scratch) -> Result<SpilledGroup, Full> {
        self.packed.clear();
        let blocks = self.blocks[1..].iter();
        blocks.for_each(|block| self.packed.extend_from_slice(&block.0));
        let offset = scratch.put(&self.packed)?;
        Ok(SpilledGroup {
            sums: self.sums,
            offset,
        })
    }

    /// Reads the blocks back from the temporary storage.
    pub(super) fn load(&mut self, spilled: &SpilledGroup, scratch: &dyn Scratch) {
        self.sums.clone_from(&spilled.sums);
        self.find_places();
        let n_filled = self.sums.iter().filter(|&&sum| sum > 0).count();
        self.packed.resize(n_filled * BLOCK_BYTES, 0);
        scratch.get(spilled.offset, &mut self.packed);
        self.blocks.clear();
        self.blocks.push(BLANK);
        let packed = self.packed.as_chunks().0.iter();
        self.blocks.extend(packed.map(|bytes| Block(*bytes)));
    }
}

/// A group whose blocks are in the temporary storage.
pub(super) struct SpilledGroup {
    /// Sum of the bytes of each block, by block, then by sprite.
    sums: Vec<u32>,
    /// Offset of the blocks that are not blank in the temporary storage, bytes.
    offset: u64,
}

/// 48 sprites. The last group is padded with blank ones.
#[derive(Clone, Copy)]
pub(super) struct Group<'a> {
    pub(super) n_sprites: usize,
    blocks: &'a [Block],
    places: &'a [u32],
    sums: &'a [u32],
    filled: &'a [u64],
}

impl<'a> Group<'a> {
    /// Returns the number of blocks per sprite.
    pub(super) fn n_blocks(&self) -> usize {
        self.filled.len()
    }

    /// Returns one block of one of the 48 sprites.
    #[inline]
    pub(super) fn block(&self, block: usize, sprite: usize) -> &'a Block {
        &self.blocks[self.places[block * GROUP + sprite] as usize]
    }

    /// Returns the sprites in which a block is not blank: bit k is sprite k.
    #[inline]
    pub(super) fn filled(&self, block: usize) -> u64 {
        self.filled[block]
    }

    /// Returns the sum of all bytes of each sprite.
    pub(super) fn totals(&self) -> [u64; GROUP] {
        let mut totals = [0; GROUP];
        for sums in self.sums.as_chunks::<GROUP>().0 {
            let each = totals.iter_mut().zip(sums);
            each.for_each(|(total, &sum)| *total += u64::from(sum));
        }
        totals
    }

    /// Returns the sum of the bytes of a block.
    #[inline]
    pub(super) fn sum(&self, block: usize, sprite: usize) -> u32 {
        self.sums[block * GROUP + sprite]
    }

    /// Writes the bytes of a sprite, row by row.
    pub(super) fn copy_sprite(&self, sprite: usize, grid: BlockGrid, bytes: &mut [u8]) {
        for k in 0..grid.n_blocks() {
            let block = self.block(k, sprite);
            for (in_block, in_sprite) in grid.rows(k) {
                bytes[in_sprite].copy_from_slice(&block.0[in_block]);
            }
        }
    }
}
