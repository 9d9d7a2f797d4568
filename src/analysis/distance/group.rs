//! Sprites in groups of 48, cut into blocks, as the kernels read them (ALGORITHMS.md 5).
//!
//! Inside a group the sprites are cut into blocks of 16 x 16 pixels, and block 0 of all 48 comes before
//! block 1: a tile of 48 x 48 distances then reads two runs of 48 KB at a time, without the cache conflicts
//! of sprites whose size is a multiple of 4 KB. Bytes beyond the last sprite and beyond the last pixel, up
//! to whole blocks, are 0.

use crate::scratch::{Full, Scratch};

/// Sprites in a group: the side of a tile of distances.
pub(super) const GROUP: usize = 48;
/// Bytes in a block.
pub(super) const BLOCK: usize = 1024;

/// Side of the square of pixels that a block holds: an animal fills few of them, and of two blank blocks
/// nothing need be compared.
pub(super) const SIDE: usize = 16;
/// Bytes of one row of a block.
const ROW: usize = SIDE * 4;

/// 16 x 16 pixels of a sprite, on cache lines of their own.
#[derive(Clone, Copy)]
#[repr(C, align(64))]
pub(super) struct Block(pub(super) [u8; BLOCK]);

const BLANK: Block = Block([0; BLOCK]);

/// The blocks of some groups, and what the bytes of each add up to.
#[derive(Default)]
pub(super) struct GroupMemory {
    pub(super) blocks: Vec<Block>,
    sums: Vec<u32>,
    filled: Vec<u64>,
    packed: Vec<u8>,
}

impl GroupMemory {
    /// So many blank blocks.
    pub(super) fn clear(&mut self, n_blocks: usize) {
        self.blocks.clear();
        self.blocks.resize(n_blocks, BLANK);
        self.sums.clear();
        self.sums.resize(n_blocks, 0);
    }

    /// Adds up the bytes of every block, once they are all there.
    pub(super) fn sum_up(&mut self) {
        for (sum, block) in self.sums.iter_mut().zip(&self.blocks) {
            *sum = block.0.iter().map(|&byte| u32::from(byte)).sum();
        }
        self.mark_filled();
    }

    fn mark_filled(&mut self) {
        let bits = |sums: &[u32]| {
            let each = (0..).zip(sums);
            each.fold(0, |bits, (k, &sum)| bits | u64::from(sum > 0) << k)
        };
        self.filled.clear();
        self.filled.extend(self.sums.chunks(GROUP).map(bits));
    }

    /// What is in it, as a group of so many sprites.
    pub(super) fn lend(&self, n_sprites: usize) -> Group<'_> {
        Group {
            n_sprites,
            blocks: &self.blocks,
            sums: &self.sums,
            filled: &self.filled,
        }
    }

    /// Puts the blocks that are not blank aside: their sums, and where they lie.
    pub(super) fn put_aside(mut self, scratch: &dyn Scratch) -> Result<(Vec<u32>, u64), Full> {
        self.packed.clear();
        for (block, &sum) in self.blocks.iter().zip(&self.sums) {
            if sum > 0 {
                self.packed.extend_from_slice(&block.0);
            }
        }
        let at = scratch.put(&self.packed)?;
        Ok((self.sums, at))
    }

    /// Has the blocks back.
    pub(super) fn have_back(&mut self, sums: &[u32], at: u64, scratch: &dyn Scratch) {
        self.clear(sums.len());
        self.sums.copy_from_slice(sums);
        self.mark_filled();
        let n_packed = sums.iter().filter(|&&sum| sum > 0).count();
        self.packed.resize(n_packed * BLOCK, 0);
        scratch.get(at, &mut self.packed);
        let kept = self
            .blocks
            .iter_mut()
            .zip(sums)
            .filter(|(_, sum)| **sum > 0);
        for ((block, _), packed) in kept.zip(self.packed.as_chunks::<BLOCK>().0) {
            block.0 = *packed;
        }
    }
}

/// 48 sprites, the last ones blank where the footage ends.
#[derive(Clone, Copy)]
pub(super) struct Group<'a> {
    pub(super) n_sprites: usize,
    /// Block 0 of each sprite, then block 1 of each.
    blocks: &'a [Block],
    sums: &'a [u32],
    filled: &'a [u64],
}

impl<'a> Group<'a> {
    /// Blocks in each sprite.
    pub(super) fn n_blocks(&self) -> usize {
        self.blocks.len() / GROUP
    }

    /// One block of one of the 48 sprites.
    pub(super) fn block(&self, block: usize, sprite: usize) -> &'a Block {
        &self.blocks[block * GROUP + sprite]
    }

    /// Which of the 48 sprites have anything in that block: bit k is sprite k.
    #[inline]
    pub(super) fn filled(&self, block: usize) -> u64 {
        self.filled[block]
    }

    /// What the bytes of that block add up to.
    pub(super) fn sum(&self, block: usize, sprite: usize) -> u32 {
        self.sums[block * GROUP + sprite]
    }
}

/// d of a sprite of one group and a sprite of another.
pub(super) fn sad(a: Group<'_>, i: usize, b: Group<'_>, j: usize) -> u64 {
    (0..a.n_blocks())
        .map(|block| super::kernel::scalar::sad_block(a.block(block, i), b.block(block, j)))
        .sum()
}

/// Writes one sprite's bytes to its place in a group.
pub(super) fn scatter(bytes: &[u8], width: usize, sprite: usize, group: &mut [Block]) {
    for (first, block, at) in pieces(bytes.len(), width) {
        let n = ROW.min(width * 4 - first % (width * 4));
        group[block * GROUP + sprite].0[at..at + n].copy_from_slice(&bytes[first..first + n]);
    }
}

/// Reads one sprite's bytes from a group.
pub(super) fn gather(group: Group<'_>, width: usize, sprite: usize, bytes: &mut [u8]) {
    for (first, block, at) in pieces(bytes.len(), width) {
        let n = ROW.min(width * 4 - first % (width * 4));
        bytes[first..first + n].copy_from_slice(&group.block(block, sprite).0[at..at + n]);
    }
}

/// The rows of all blocks: where each begins in a sprite's bytes, its block, and where in that.
fn pieces(n_bytes: usize, width: usize) -> impl Iterator<Item = (usize, usize, usize)> {
    let n_columns = width.div_ceil(SIDE);
    let row_bytes = (width * 4).max(1);
    (0..n_bytes / row_bytes).flat_map(move |y| {
        (0..n_columns).map(move |column| {
            let first = y * row_bytes + column * ROW;
            (first, y / SIDE * n_columns + column, y % SIDE * ROW)
        })
    })
}
