//! Sprites in groups of 48, cut into blocks, as the kernels read them (ALGORITHMS.md 5).
//!
//! Inside a group the sprites are cut into blocks of 16 x 16 pixels, and block 0 of all 48 comes before
//! block 1: a tile of 48 x 48 distances then reads two runs of at most 48 KB at a time. Of blank blocks, which
//! most of a large sprite are, there is one for all. Bytes beyond the last sprite and beyond the last pixel, up to
//! whole blocks, are 0.

use super::kernel;
use super::page::Page;
use crate::scratch::{Full, Scratch};

/// Sprites in a group: the side of a tile of distances.
pub(super) const GROUP: usize = 48;
/// Bytes in a block.
pub(super) const BLOCK: usize = SIDE * SIDE * 4;
/// Side of the square of pixels that a block holds: an animal fills few of them, and of two blank blocks
/// nothing need be compared.
pub(super) const SIDE: usize = 16;

/// 16 x 16 pixels of a sprite, on cache lines of their own.
#[derive(Clone, Copy)]
#[repr(C, align(64))]
pub(super) struct Block(pub(super) [u8; BLOCK]);

pub(super) const BLANK: Block = Block([0; BLOCK]);

/// A group, and memory for the next.
#[derive(Default)]
pub(super) struct GroupMemory {
    /// The first is blank; after it those that are not.
    blocks: Vec<Block>,
    /// By blocks, then sprites: where it is among those.
    places: Vec<u32>,
    /// Likewise: what its bytes add up to.
    sums: Vec<u32>,
    /// Of every block, the sprites that have anything in it.
    filled: Vec<u64>,
    /// Before they are put in order, or bytes of them.
    loose: Vec<Block>,
    packed: Vec<u8>,
}

impl GroupMemory {
    /// Takes in so many sprites of so many blocks, as `draw` draws them.
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

    /// Where each block is among those that are not blank, which are in order.
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

    /// What is in it, as a group of so many sprites.
    pub(super) fn lend(&self, n_sprites: usize) -> Group<'_> {
        Group {
            n_sprites,
            blocks: &self.blocks,
            places: &self.places,
            sums: &self.sums,
            filled: &self.filled,
        }
    }

    /// Bytes of all blocks that are not blank.
    pub(super) fn n_bytes(&self) -> usize {
        (self.blocks.len() - 1) * BLOCK
    }

    /// Gives back what is not needed to hold it.
    pub(super) fn hold(mut self) -> GroupMemory {
        (self.loose, self.packed) = Default::default();
        self.blocks.shrink_to_fit();
        self
    }

    /// Puts the blocks that are not blank aside: their sums, and where they lie.
    pub(super) fn put_aside(mut self, scratch: &dyn Scratch) -> Result<(Vec<u32>, u64), Full> {
        self.packed.clear();
        let blocks = self.blocks[1..].iter();
        blocks.for_each(|block| self.packed.extend_from_slice(&block.0));
        let at = scratch.put(&self.packed)?;
        Ok((self.sums, at))
    }

    /// Has the blocks back.
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

/// 48 sprites, the last ones blank where the footage ends.
#[derive(Clone, Copy)]
pub(super) struct Group<'a> {
    pub(super) n_sprites: usize,
    blocks: &'a [Block],
    places: &'a [u32],
    sums: &'a [u32],
    filled: &'a [u64],
}

impl<'a> Group<'a> {
    /// Blocks in each sprite.
    pub(super) fn n_blocks(&self) -> usize {
        self.filled.len()
    }

    /// One block of one of the 48 sprites.
    #[inline]
    pub(super) fn block(&self, block: usize, sprite: usize) -> &'a Block {
        &self.blocks[self.places[block * GROUP + sprite] as usize]
    }

    /// Which of the 48 sprites have anything in that block: bit k is sprite k.
    #[inline]
    pub(super) fn filled(&self, block: usize) -> u64 {
        self.filled[block]
    }

    /// What all bytes of each sprite add up to.
    pub(super) fn totals(&self) -> [u64; GROUP] {
        let mut totals = [0; GROUP];
        for sums in self.sums.as_chunks::<GROUP>().0 {
            let each = totals.iter_mut().zip(sums);
            each.for_each(|(total, &sum)| *total += u64::from(sum));
        }
        totals
    }

    /// What the bytes of that block add up to.
    #[inline]
    pub(super) fn sum(&self, block: usize, sprite: usize) -> u32 {
        self.sums[block * GROUP + sprite]
    }
}
