//! The pixels that distances compare (ALGORITHMS.md 5), laid out for the kernels.
//!
//! Each sprite becomes U: four bytes a pixel, color premultiplied as `(A*C + 127) div 255`, then A;
//! with `planes: rgb` the byte of A is 0 in every sprite and adds nothing. They are kept in
//! groups (`group`), in memory or put aside, together with the sums that bound their distances (`bounds`).

use std::sync::Arc;

use rayon::prelude::*;

use super::Side;
use super::bounds::{Bounds, Sums};
use super::group::{BLOCK, GROUP, Group, GroupMemory, SIDE, gather, sad, scatter};
use super::upright::Canvas;
use crate::analysis::params::Planes;
use crate::library::{Poses, Sprites, View};
use crate::scratch::{Full, Scratch};

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
                    false => {
                        let (sums, at) = group.put_aside(&*compared.scratch)?;
                        Stored::Aside { sums, at }
                    }
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
        group.sum_up();
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
        memory.sum_up();
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
