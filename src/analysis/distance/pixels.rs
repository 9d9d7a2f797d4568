//! Prepares the compared pixels and stores them in the layout of the kernels
//! (docs/explanation/algorithms.md, "Distances").
//!
//! Each sprite becomes U with four bytes per pixel: the colors premultiplied as `(A*C + 127) div 255`, then
//! A. With `planes: rgb` the byte of A is 0 in every sprite and adds nothing. The sprites are stored in
//! groups (`group`), in memory or in the temporary storage, together with the sums that bound their distances
//! (`bounds`).

use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};

use rayon::prelude::*;

use super::Side;
use super::bounds::{Bounds, Sums};
use super::group::{GROUP, Group, GroupMemory, SIDE};
use super::kernel::{Tile, sad_tile};
use super::page::{Flip, Page};
use super::upright::Canvas;
use crate::analysis::params::Planes;
use crate::cpu::Level;
use crate::library::{Poses, Sprites, View};
use crate::scratch::{Full, Scratch};

/// Size of the blocks that stay in memory, bytes. The rest goes to the temporary storage. Free choice.
const HELD_BYTES: usize = 64 << 20;

/// The U of all frames.
pub struct ComparedSprites {
    n_frames: usize,
    width: usize,
    height: usize,
    flip: Flip,
    groups: Vec<Stored>,
    /// Bounds of the unmirrored sprites.
    plain: Bounds,
    /// Bounds of the mirrored sprites.
    mirrored: Bounds,
    scratch: Arc<dyn Scratch>,
}

/// Storage of a group.
enum Stored {
    Held(GroupMemory),
    /// The sums, and the offset of the blocks that are not blank in the temporary storage.
    Aside {
        sums: Vec<u32>,
        at: u64,
    },
}

impl ComparedSprites {
    /// Computes U of every frame: unrotated in side view, rotated to heading 0 in top view.
    ///
    /// Missing sprites are blank. In top view, sprites of unknown heading are blank too. Fails when the
    /// temporary storage is full.
    pub fn new(sprites: &Sprites, poses: &Poses, planes: Planes) -> Result<Self, Full> {
        ComparedSprites::holding(HELD_BYTES, sprites, poses, planes)
    }

    /// Works like `new`, but keeps at most `held_bytes` of blocks in memory.
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
        // Thread timing decides which groups stay in memory. The distances do not depend on it.
        let n_held = AtomicUsize::new(0);
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
                let n_before = n_held.fetch_add(group.n_bytes(), Ordering::Relaxed);
                let stored = match n_before + group.n_bytes() <= held_bytes {
                    true => Stored::Held(group.hold()),
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

    /// Returns the blocks of one group, and the square sums of each sprite, plain and mirrored.
    fn gathered(&self, group_idx: usize, source: &Source<'_>) -> (GroupMemory, Vec<(Sums, Sums)>) {
        let mut group = GroupMemory::default();
        let mut bytes = vec![0; self.n_bytes()];
        let mut sums = Vec::with_capacity(GROUP);
        let size = [self.n_sprites(group_idx), self.n_blocks()];
        group.take_in(size, &mut self.page(), |sprite, page| {
            source.draw(group_idx * GROUP + sprite, &mut bytes);
            page.draw(&bytes);
            let mirrored = Sums::of_mirrored(&bytes, self.width, self.flip);
            sums.push((Sums::of(&bytes, self.width), mirrored));
        });
        (group, sums)
    }

    /// Returns the number of frames of the footage.
    pub fn n_frames(&self) -> usize {
        self.n_frames
    }

    /// Returns the number of bytes compared per pair of sprites.
    pub fn n_bytes(&self) -> usize {
        self.width * self.height * 4
    }

    /// Returns d(i, i + 1) for every frame but the last.
    pub fn steps(&self, cpu: Level) -> Vec<u64> {
        let of_group = |group_idx: usize| {
            let (mut one, mut other) = (GroupMemory::default(), GroupMemory::default());
            let group = self.group(group_idx, &mut one);
            let wanted = std::array::from_fn(|k| (k + 1 < group.n_sprites).then_some(2 << k));
            let wanted = wanted.map(Option::unwrap_or_default);
            let within = sad_tile(
                cpu,
                Tile {
                    rows: group,
                    columns: group,
                    wanted: &wanted,
                },
            );
            let mut steps: Vec<u64> = (1..group.n_sprites).map(|k| within[k - 1][k]).collect();
            if group_idx + 1 < self.n_groups() {
                let columns = self.group(group_idx + 1, &mut other);
                let wanted = std::array::from_fn(|k| u64::from(k + 1 == GROUP));
                let across = sad_tile(
                    cpu,
                    Tile {
                        rows: group,
                        columns,
                        wanted: &wanted,
                    },
                );
                steps.push(across[GROUP - 1][0]);
            }
            steps
        };
        let steps: Vec<Vec<u64>> = (0..self.n_groups()).into_par_iter().map(of_group).collect();
        steps.concat()
    }

    /// Returns the square sums of all sprites, plain or mirrored.
    pub(super) fn bounds(&self, side: Side) -> &Bounds {
        match side {
            Side::Plain => &self.plain,
            Side::Mirrored => &self.mirrored,
        }
    }

    pub(super) fn n_groups(&self) -> usize {
        self.groups.len()
    }

    /// Returns a group. If it is in the temporary storage, it is read into `memory`.
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

    /// Returns a group mirrored, in `memory`.
    pub(super) fn mirrored_group<'a>(
        &self,
        group_idx: usize,
        memory: &'a mut GroupMemory,
    ) -> Group<'a> {
        let mut aside = GroupMemory::default();
        let group = self.group(group_idx, &mut aside);
        let size = [group.n_sprites, self.n_blocks()];
        memory.take_in(size, &mut self.page(), |sprite, page| {
            page.draw_mirrored(group, sprite, self.flip);
        });
        memory.lend(group.n_sprites)
    }

    fn n_sprites(&self, group_idx: usize) -> usize {
        (self.n_frames - group_idx * GROUP).min(GROUP)
    }

    fn page(&self) -> Page {
        Page::new([self.width, self.height])
    }

    fn n_blocks(&self) -> usize {
        self.width.div_ceil(SIDE) * self.height.div_ceil(SIDE)
    }
}

/// The inputs of U.
struct Source<'a> {
    sprites: &'a Sprites,
    poses: &'a Poses,
    planes: Planes,
    canvas: Option<&'a Canvas>,
}

impl Source<'_> {
    /// Writes U of a frame.
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

/// Writes U of a sprite with straight alpha.
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
