//! Stores sprites in groups of 48, divided into blocks, in the layout that the kernels read.
//!
//! A block has 16 x 16 pixels. Block 0 of all 48 sprites precedes block 1. A tile of 48 x 48 distances
//! therefore reads two runs of at most 48 KB at a time. Most of a large sprite is blank; all blank blocks
//! share one copy. Bytes after the last sprite and after the last pixel of a block are 0.

use super::kernel;
use super::page::Page;
use crate::scratch::{Full, Scratch};

/// Number of sprites in a group, which is the side of a tile of distances.
pub(super) const GROUP: usize = 48;
/// Size of a block, bytes.
pub(super) const BLOCK: usize = SIDE * SIDE * 4;
/// Side of a block, pixels. Small, because the animal then fills few blocks and two blank blocks need no
/// comparison.
pub(super) const SIDE: usize = 16;

/// 16 x 16 pixels of a sprite, aligned to cache lines.
#[derive(Clone, Copy)]
#[repr(C, align(64))]
pub(super) struct Block(pub(super) [u8; BLOCK]);

pub(super) const BLANK: Block = Block([0; BLOCK]);

/// The blocks of a group, with buffers that the next group reuses.
#[derive(Default)]
pub(super) struct GroupMemory {
    /// One blank block, then the blocks that are not blank.
    blocks: Vec<Block>,
    /// Index into `blocks`, by block, then by sprite.
    places: Vec<u32>,
    /// Sum of the bytes of each block, in the same order as `places`.
    sums: Vec<u32>,
    /// For each block, the sprites in which it is not blank: bit k is sprite k.
    filled: Vec<u64>,
    /// Buffers: blocks in the order of the sprites, and bytes for the temporary storage.
    loose: Vec<Block>,
    packed: Vec<u8>,
}

impl GroupMemory {
    /// Replaces the content with `n_sprites` sprites of `n_blocks` blocks, drawn by `draw`.
    pub(super) fn take_in(
        &mut self,
        [n_sprites, n_blocks]: [usize; 2],
        page: &mut Page,
        mut draw: impl FnMut(usize, &mut Page),
    ) {
        self.loose.clear();
        for list in [&mut self.places, &mut self.sums] {
            list.clear();
            list.resize(n_blocks * GROUP, 0);
        }
        for sprite in 0..n_sprites {
            page.clear();
            draw(sprite, page);
            for (k, block) in page.drawn() {
                self.sums[k * GROUP + sprite] = kernel::scalar::sad_block(block, &BLANK) as u32;
                self.places[k * GROUP + sprite] = self.loose.len() as u32;
                self.loose.push(*block);
            }
        }
        self.blocks.clear();
        self.blocks.push(BLANK);
        for (place, _) in self
            .places
            .iter()
            .zip(&self.sums)
            .filter(|(_, sum)| **sum > 0)
        {
            self.blocks.push(self.loose[*place as usize]);
        }
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
    pub(super) fn lend(&self, n_sprites: usize) -> Group<'_> {
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
        (self.blocks.len() - 1) * BLOCK
    }

    /// Frees the buffers.
    pub(super) fn hold(mut self) -> GroupMemory {
        (self.loose, self.packed) = Default::default();
        self.blocks.shrink_to_fit();
        self
    }

    /// Writes the blocks that are not blank to the temporary storage. Returns the sums and the offset.
    pub(super) fn put_aside(mut self, scratch: &dyn Scratch) -> Result<(Vec<u32>, u64), Full> {
        self.packed.clear();
        let blocks = self.blocks[1..].iter();
        blocks.for_each(|block| self.packed.extend_from_slice(&block.0));
        let at = scratch.put(&self.packed)?;
        Ok((self.sums, at))
    }

    /// Reads the blocks back from the temporary storage.
    pub(super) fn have_back(&mut self, sums: &[u32], at: u64, scratch: &dyn Scratch) {
        self.sums.clear();
        self.sums.extend_from_slice(sums);
        self.find_places();
        let n_filled = sums.iter().filter(|&&sum| sum > 0).count();
        self.packed.resize(n_filled * BLOCK, 0);
        scratch.get(at, &mut self.packed);
        self.blocks.clear();
        self.blocks.push(BLANK);
        let packed = self.packed.as_chunks().0.iter();
        self.blocks.extend(packed.map(|bytes| Block(*bytes)));
    }
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
}
