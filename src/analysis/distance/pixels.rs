//! The pixels that distances compare (ALGORITHMS.md 5), laid out for the kernels.
//!
//! Each sprite becomes U: four bytes a pixel, color premultiplied as `(A*C + 127) div 255`, then A;
//! with `planes: rgb` the byte of A is 0 in every sprite and adds nothing. Sprites stand in groups
//! of 48. Inside a group the sprites are cut into blocks of 16 x 16 pixels, and block 0 of all 48 comes
//! before block 1: a tile of 48 x 48 distances then reads two runs of 48 KB at a time, without the
//! cache conflicts of sprites whose size is a multiple of 4 KB. Bytes beyond the last sprite and
//! beyond the last pixel, up to whole blocks, are 0.

use std::sync::Arc;

use rayon::prelude::*;

use super::Side;
use super::bounds::{Bounds, Sums};
use super::upright::Canvas;
use crate::analysis::params::Planes;
use crate::library::{Poses, Sprites, View};
use crate::scratch::{Full, Scratch};

/// Sprites in a group: the side of a tile of distances.
pub(super) const GROUP: usize = 48;
/// Bytes in a block.
pub(super) const BLOCK: usize = 1024;

/// Side of the square of pixels that a block holds: an animal fills few of them, and of two blank blocks
/// nothing need be compared.
const SIDE: usize = 16;
/// Bytes of one row of a block.
const ROW: usize = SIDE * 4;

/// 16 x 16 pixels of a sprite, on cache lines of their own.
#[derive(Clone, Copy)]
#[repr(C, align(64))]
pub(super) struct Block(pub(super) [u8; BLOCK]);

const BLANK: Block = Block([0; BLOCK]);

/// How a sprite is mirrored.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Flip {
    /// Columns reversed: the side view's left-right mirror.
    Columns,
    /// Rows reversed: an animal that heads along +x, mirrored across its own axis.
    Rows,
}

/// Bytes of all blocks up to which they stay in memory; those of a longer footage are put aside.
const HELD_BYTES: usize = 64 << 20;

/// Every frame's U.
pub struct ComparedSprites {
    n_frames: usize,
    width: usize,
    height: usize,
    flip: Flip,
    groups: Vec<Stored>,
    /// Of the sprites as they are.
    plain: Bounds,
    /// Of the sprites mirrored.
    mirrored: Bounds,
    scratch: Arc<dyn Scratch>,
}

/// Where a group is.
enum Stored {
    Held(GroupMemory),
    /// The sums, and those blocks that are not blank.
    Aside {
        sums: Vec<u32>,
        at: u64,
    },
}

/// The blocks of some groups, and what the bytes of each add up to.
#[derive(Default)]
pub(super) struct GroupMemory {
    blocks: Vec<Block>,
    sums: Vec<u32>,
    packed: Vec<u8>,
}

impl GroupMemory {
    fn clear(&mut self, n_blocks: usize) {
        self.blocks.clear();
        self.blocks.resize(n_blocks, BLANK);
        self.sums.clear();
        self.sums.resize(n_blocks, 0);
    }

    fn lend(&self, n_sprites: usize) -> Group<'_> {
        Group {
            n_sprites,
            blocks: &self.blocks,
            sums: &self.sums,
        }
    }

    /// Puts the blocks that are not blank aside.
    fn put_aside(mut self, scratch: &dyn Scratch) -> Result<Stored, Full> {
        self.packed.clear();
        for (block, &sum) in self.blocks.iter().zip(&self.sums) {
            if sum > 0 {
                self.packed.extend_from_slice(&block.0);
            }
        }
        let at = scratch.put(&self.packed)?;
        let sums = self.sums;
        Ok(Stored::Aside { sums, at })
    }

    /// Has the blocks back.
    fn have_back(&mut self, sums: &[u32], at: u64, scratch: &dyn Scratch) {
        self.clear(sums.len());
        self.sums.copy_from_slice(sums);
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

fn sum_up(blocks: &[Block], sums: &mut [u32]) {
    for (sum, block) in sums.iter_mut().zip(blocks) {
        *sum = block.0.iter().map(|&byte| u32::from(byte)).sum();
    }
}

/// 48 sprites, the last ones blank where the footage ends.
#[derive(Clone, Copy)]
pub(super) struct Group<'a> {
    pub(super) n_sprites: usize,
    /// Block 0 of each sprite, then block 1 of each.
    blocks: &'a [Block],
    sums: &'a [u32],
}

impl ComparedSprites {
    /// U of every frame: as the sprites stand in side view, turned to heading 0 in top view.
    ///
    /// Missing sprites are blank; so are, in top view, those of unknown heading.
    pub fn new(sprites: &Sprites, poses: &Poses, planes: Planes) -> Result<Self, Full> {
        ComparedSprites::holding(HELD_BYTES, sprites, poses, planes)
    }

    /// As `new`, with the blocks in memory only if they take no more than `held_bytes`.
    pub(super) fn holding(
        held_bytes: usize,
        sprites: &Sprites,
        poses: &Poses,
        planes: Planes,
    ) -> Result<Self, Full> {
        let canvas = match poses.view {
            View::Side => None,
            View::Top => Some(Canvas::around(sprites, poses)),
        };
        let (width, height, flip) = match &canvas {
            None => (
                sprites.width() as usize,
                sprites.height() as usize,
                Flip::Columns,
            ),
            Some(canvas) => (canvas.width, canvas.height, Flip::Rows),
        };
        let mut compared = ComparedSprites {
            n_frames: sprites.n_frames(),
            width,
            height,
            flip,
            groups: Vec::new(),
            plain: Bounds::default(),
            mirrored: Bounds::default(),
            scratch: Arc::clone(sprites.scratch()),
        };
        let n_groups = compared.n_frames.div_ceil(GROUP);
        let held = n_groups * GROUP * compared.n_blocks() * BLOCK <= held_bytes;
        let source = Source {
            sprites,
            poses,
            planes,
            canvas: canvas.as_ref(),
        };
        let gathered = (0..n_groups)
            .into_par_iter()
            .map(|group_idx| {
                let (group, sums) = compared.gathered(group_idx, &source);
                let stored = match held {
                    true => Stored::Held(group),
                    false => group.put_aside(&*compared.scratch)?,
                };
                Ok((stored, sums))
            })
            .collect::<Result<Vec<_>, Full>>()?;
        let (groups, sums): (Vec<_>, Vec<_>) = gathered.into_iter().unzip();
        let (plain, mirrored): (Vec<_>, Vec<_>) = sums.into_iter().flatten().unzip();
        compared.groups = groups;
        compared.plain = Bounds::of(&plain);
        compared.mirrored = Bounds::of(&mirrored);
        Ok(compared)
    }

    /// The blocks of one group, made of its sprites, and the sums of each, as it is and mirrored.
    fn gathered(&self, group_idx: usize, source: &Source<'_>) -> (GroupMemory, Vec<(Sums, Sums)>) {
        let mut group = GroupMemory::default();
        group.clear(GROUP * self.n_blocks());
        let mut bytes = vec![0; self.n_bytes()];
        let mut sums = Vec::with_capacity(GROUP);
        let first = group_idx * GROUP;
        for frame_idx in first..self.n_frames.min(first + GROUP) {
            source.draw(frame_idx, &mut bytes);
            scatter(&bytes, self.width, frame_idx - first, &mut group.blocks);
            let mirrored = Sums::of_mirrored(&bytes, self.width, self.flip);
            sums.push((Sums::of(&bytes, self.width), mirrored));
        }
        sum_up(&group.blocks, &mut group.sums);
        (group, sums)
    }

    /// Frames of the footage.
    pub fn n_frames(&self) -> usize {
        self.n_frames
    }

    /// Bytes that one pair of sprites compares.
    pub fn n_bytes(&self) -> usize {
        self.width * self.height * 4
    }

    /// d(i, i + 1) of every frame but the last.
    pub fn steps(&self) -> Vec<u64> {
        let of_group = |group_idx: usize| {
            let (mut one, mut other) = (GroupMemory::default(), GroupMemory::default());
            let group = self.group(group_idx, &mut one);
            let mut steps: Vec<u64> = (1..group.n_sprites)
                .map(|k| sad(group, k - 1, group, k))
                .collect();
            if group_idx + 1 < self.n_groups() {
                let next = self.group(group_idx + 1, &mut other);
                steps.push(sad(group, GROUP - 1, next, 0));
            }
            steps
        };
        let steps: Vec<Vec<u64>> = (0..self.n_groups()).into_par_iter().map(of_group).collect();
        steps.concat()
    }

    /// The sums over squares of all sprites, as they are or mirrored.
    pub(super) fn bounds(&self, side: Side) -> &Bounds {
        match side {
            Side::Plain => &self.plain,
            Side::Mirrored => &self.mirrored,
        }
    }

    pub(super) fn n_groups(&self) -> usize {
        self.groups.len()
    }

    /// A group, in memory that the caller lends if it was put aside.
    pub(super) fn group<'a>(&'a self, group_idx: usize, memory: &'a mut GroupMemory) -> Group<'a> {
        let n_sprites = self.n_sprites(group_idx);
        match &self.groups[group_idx] {
            Stored::Held(group) => group.lend(n_sprites),
            Stored::Aside { sums, at } => {
                memory.have_back(sums, *at, &*self.scratch);
                memory.lend(n_sprites)
            }
        }
    }

    /// The group mirrored, in memory that the caller lends.
    pub(super) fn mirrored_group<'a>(
        &self,
        group_idx: usize,
        memory: &'a mut GroupMemory,
    ) -> Group<'a> {
        let mut aside = GroupMemory::default();
        let group = self.group(group_idx, &mut aside);
        memory.clear(GROUP * self.n_blocks());
        let mut bytes = vec![0; self.n_bytes()];
        for sprite in 0..group.n_sprites {
            gather(group, self.width, sprite, &mut bytes);
            self.mirror(&mut bytes);
            scatter(&bytes, self.width, sprite, &mut memory.blocks);
        }
        sum_up(&memory.blocks, &mut memory.sums);
        memory.lend(group.n_sprites)
    }

    fn n_sprites(&self, group_idx: usize) -> usize {
        (self.n_frames - group_idx * GROUP).min(GROUP)
    }

    fn mirror(&self, bytes: &mut [u8]) {
        let row_bytes = self.width * 4;
        match self.flip {
            Flip::Columns => {
                for row in bytes.chunks_exact_mut(row_bytes) {
                    row.as_chunks_mut::<4>().0.reverse();
                }
            }
            Flip::Rows => {
                for y in 0..self.height / 2 {
                    let (upper, lower) = bytes.split_at_mut((self.height - 1 - y) * row_bytes);
                    upper[y * row_bytes..][..row_bytes].swap_with_slice(&mut lower[..row_bytes]);
                }
            }
        }
    }

    fn n_blocks(&self) -> usize {
        self.width.div_ceil(SIDE) * self.height.div_ceil(SIDE)
    }
}

/// d of a sprite of one group and a sprite of another.
fn sad(a: Group<'_>, i: usize, b: Group<'_>, j: usize) -> u64 {
    (0..a.n_blocks())
        .map(|block| super::kernel::scalar::sad_block(a.block(block, i), b.block(block, j)))
        .sum()
}

/// What U is made of.
struct Source<'a> {
    sprites: &'a Sprites,
    poses: &'a Poses,
    planes: Planes,
    canvas: Option<&'a Canvas>,
}

impl Source<'_> {
    /// U of a frame.
    fn draw(&self, frame_idx: usize, bytes: &mut [u8]) {
        let sprite = self.sprites.sprite(frame_idx);
        match self.canvas {
            None => premultiply(&sprite, self.planes, bytes),
            Some(canvas) => {
                let mut plain = vec![0; sprite.len()];
                premultiply(&sprite, self.planes, &mut plain);
                canvas.turn(&plain, self.poses.frames[frame_idx].heading_rad, bytes);
            }
        }
    }
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

    /// What the bytes of that block add up to.
    pub(super) fn sum(&self, block: usize, sprite: usize) -> u32 {
        self.sums[block * GROUP + sprite]
    }
}

/// U of a straight-alpha sprite.
fn premultiply(sprite: &[u8], planes: Planes, out: &mut [u8]) {
    let keep_alpha = match planes {
        Planes::Rgba => 255,
        Planes::Rgb => 0,
    };
    let pixels = out.as_chunks_mut::<4>().0.iter_mut();
    for (out, &[r, g, b, a]) in pixels.zip(sprite.as_chunks::<4>().0) {
        let times_alpha = |c: u8| ((u32::from(a) * u32::from(c) + 127) / 255) as u8;
        *out = [
            times_alpha(r),
            times_alpha(g),
            times_alpha(b),
            a & keep_alpha,
        ];
    }
}

/// Writes one sprite's bytes to its place in a group.
fn scatter(bytes: &[u8], width: usize, sprite: usize, group: &mut [Block]) {
    for (first, block, at) in pieces(bytes.len(), width) {
        let n = ROW.min(width * 4 - first % (width * 4));
        group[block * GROUP + sprite].0[at..at + n].copy_from_slice(&bytes[first..first + n]);
    }
}

/// Reads one sprite's bytes from a group.
fn gather(group: Group<'_>, width: usize, sprite: usize, bytes: &mut [u8]) {
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
