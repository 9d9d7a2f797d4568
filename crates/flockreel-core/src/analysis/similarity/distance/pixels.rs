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

use super::super::group::{BlockGrid, GROUP, Group, GroupBuffer, SpilledGroup};
use super::super::kernel::{Tile, Wanted, sad_tile};
use super::Side;
use super::bounds::{Bounds, SpriteSums};
use super::rotation::Canvas;
use crate::analysis::params::Planes;
use crate::cpu::Level;
use crate::library::{Poses, Sprites, View};
use crate::scratch::{Full, Scratch};

/// Size of the blocks that stay in memory, bytes. The rest goes to the temporary storage. Free choice.
const MEMORY_BYTES: usize = 64 << 20;

/// The U of all frames.
pub struct ComparedSprites {
    n_frames: usize,
    grid: BlockGrid,
    mirror_axis: MirrorAxis,
    groups: Vec<StoredGroup>,
    /// Bounds of the unmirrored sprites.
    plain: Bounds,
    /// Bounds of the mirrored sprites.
    mirrored: Bounds,
    scratch: Arc<dyn Scratch>,
}

/// Storage of a group.
enum StoredGroup {
    InMemory(GroupBuffer),
    Spilled(SpilledGroup),
}

impl ComparedSprites {
    /// Computes U of every frame: unrotated in side view, rotated to heading 0 in top view.
    ///
    /// Missing sprites are blank. In top view, sprites of unknown heading are blank too. Fails when the
    /// temporary storage is full.
    pub fn new(sprites: &Sprites, poses: &Poses, planes: Planes) -> Result<Self, Full> {
        ComparedSprites::with_memory(MEMORY_BYTES, sprites, poses, planes)
    }

    /// Works like `new`, but keeps at most `memory_bytes` of blocks in memory.
    pub(super) fn with_memory(
        memory_bytes: usize,
        sprites: &Sprites,
        poses: &Poses,
        planes: Planes,
    ) -> Result<Self, Full> {
        let (canvas, mirror_axis) = match poses.view {
            View::Side => (None, MirrorAxis::Vertical),
            View::Top => (Some(Canvas::new(sprites, poses)), MirrorAxis::Horizontal),
        };
        let (width, height) = match &canvas {
            None => (sprites.width() as usize, sprites.height() as usize),
            Some(canvas) => (canvas.width, canvas.height),
        };
        let mut compared = ComparedSprites {
            n_frames: sprites.n_frames(),
            grid: BlockGrid { width, height },
            mirror_axis,
            groups: Vec::new(),
            plain: Bounds::default(),
            mirrored: Bounds::default(),
            scratch: Arc::clone(sprites.scratch()),
        };
        let n_groups = compared.n_frames.div_ceil(GROUP);
        // Thread timing decides which groups stay in memory. The distances do not depend on it.
        let n_bytes = AtomicUsize::new(0);
        let source = Source {
            sprites,
            poses,
            planes,
            canvas: canvas.as_ref(),
        };
        let built = (0..n_groups)
            .into_par_iter()
            .map(|group_idx| {
                let (group, sums) = compared.build_group(group_idx, &source);
                let n_before = n_bytes.fetch_add(group.n_bytes(), Ordering::Relaxed);
                let stored = if n_before + group.n_bytes() <= memory_bytes {
                    StoredGroup::InMemory(group.shrunk())
                } else {
                    StoredGroup::Spilled(group.spill(&*compared.scratch)?)
                };
                Ok((stored, sums))
            })
            .collect::<Result<Vec<_>, Full>>()?;
        let (groups, sums): (Vec<_>, Vec<_>) = built.into_iter().unzip();
        let (plain, mirrored): (Vec<_>, Vec<_>) = sums.into_iter().flatten().unzip();
        compared.groups = groups;
        compared.plain = Bounds::new(&plain);
        compared.mirrored = Bounds::new(&mirrored);
        Ok(compared)
    }

    /// Returns the blocks of one group, and the square sums of each sprite, plain and mirrored.
    fn build_group(
        &self,
        group_idx: usize,
        source: &Source<'_>,
    ) -> (GroupBuffer, Vec<(SpriteSums, SpriteSums)>) {
        let mut group = GroupBuffer::default();
        let mut sums = Vec::with_capacity(GROUP);
        group.fill(self.n_sprites(group_idx), self.grid, |sprite, bytes| {
            source.draw(group_idx * GROUP + sprite, bytes);
            let mut mirrored = bytes.to_vec();
            self.mirror_axis.mirror(&mut mirrored, self.grid.width);
            let of_sprite = |bytes: &[u8]| SpriteSums::new(bytes, self.grid.width);
            sums.push((of_sprite(bytes), of_sprite(&mirrored)));
        });
        (group, sums)
    }

    /// Returns the number of frames of the footage.
    pub fn n_frames(&self) -> usize {
        self.n_frames
    }

    /// Returns the number of bytes compared per pair of sprites.
    pub fn n_bytes(&self) -> usize {
        self.grid.n_bytes()
    }

    /// Returns d(i, i + 1) for every frame but the last.
    pub fn steps(&self, cpu: Level) -> Vec<u64> {
        let of_group = |group_idx: usize| {
            let (mut buffer, mut next_buffer) = (GroupBuffer::default(), GroupBuffer::default());
            let rows = self.group(group_idx, &mut buffer);
            let tile = |columns: Group<'_>, wanted: Wanted| {
                let tile = Tile {
                    rows,
                    columns,
                    wanted: &wanted,
                };
                sad_tile(cpu, tile)
            };
            let next_sprite = |k: usize| if k + 1 < rows.n_sprites { 2 << k } else { 0 };
            let within = tile(rows, std::array::from_fn(next_sprite));
            let mut steps: Vec<u64> = (1..rows.n_sprites).map(|k| within[k - 1][k]).collect();
            if group_idx + 1 < self.n_groups() {
                let columns = self.group(group_idx + 1, &mut next_buffer);
                let last_and_first = |k: usize| u64::from(k + 1 == GROUP);
                let across = tile(columns, std::array::from_fn(last_and_first));
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

    /// Returns a group. If it is in the temporary storage, it is read into `buffer`.
    pub(super) fn group<'a>(&'a self, group_idx: usize, buffer: &'a mut GroupBuffer) -> Group<'a> {
        let n_sprites = self.n_sprites(group_idx);
        match &self.groups[group_idx] {
            StoredGroup::InMemory(group) => group.as_group(n_sprites),
            StoredGroup::Spilled(spilled) => {
                buffer.load(spilled, &*self.scratch);
                buffer.as_group(n_sprites)
            }
        }
    }

    /// Returns a group mirrored, in `buffer`.
    pub(super) fn mirrored_group<'a>(
        &self,
        group_idx: usize,
        buffer: &'a mut GroupBuffer,
    ) -> Group<'a> {
        let mut plain_buffer = GroupBuffer::default();
        let group = self.group(group_idx, &mut plain_buffer);
        buffer.fill(group.n_sprites, self.grid, |sprite, bytes| {
            group.copy_sprite(sprite, self.grid, bytes);
            self.mirror_axis.mirror(bytes, self.grid.width);
        });
        buffer.as_group(group.n_sprites)
    }

    fn n_sprites(&self, group_idx: usize) -> usize {
        (self.n_frames - group_idx * GROUP).min(GROUP)
    }
}

/// The axis across which sprites are mirrored.
#[derive(Clone, Copy, PartialEq, Eq)]
enum MirrorAxis {
    /// Left-right mirroring, in side view.
    Vertical,
    /// Mirroring across the body axis of an animal that heads along +x, in top view.
    Horizontal,
}

impl MirrorAxis {
    /// Mirrors a sprite with four bytes per pixel and `width` pixels per row.
    fn mirror(self, bytes: &mut [u8], width: usize) {
        let pixels = bytes.as_chunks_mut::<4>().0;
        if self == MirrorAxis::Horizontal {
            // This reverses both directions; the rows are then reversed back.
            pixels.reverse();
        }
        pixels
            .chunks_exact_mut(width.max(1))
            .for_each(<[_]>::reverse);
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
                canvas.rotate(&plain, self.poses.frames[frame_idx].heading_rad, bytes);
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
