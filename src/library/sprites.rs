//! Sprites: the animal cut out of each frame, all of one size, centred on its centroid (O's clip U).
//!
//! Most of a sprite is empty, and a long footage has many: only the box that shows anything is kept,
//! in a [`Scratch`], and the picture is put together when it is asked for.

use std::sync::Arc;

use rayon::prelude::*;

use crate::geometry::Rect;
use crate::raster::resample::bounds_of;
use crate::scratch::{Full, InMemory, Scratch};

/// Straight-alpha RGBA pictures of one common size, one for every frame of the footage.
///
/// The centroid lies at (width / 2, height / 2). A frame without the animal has no sprite: its
/// picture is wholly transparent and it is not `present`.
#[derive(Clone, Debug)]
pub struct Sprites {
    width: u32,
    height: u32,
    cuts: Vec<Option<Cut>>,
    scratch: Arc<dyn Scratch>,
}

/// What is kept of a sprite.
#[derive(Clone, Copy, Debug)]
struct Cut {
    /// Where the sprite shows anything; the pixels around it are 0.
    bounds: Rect,
    /// Where the bytes of that box lie.
    at: u64,
}

impl Sprites {
    /// `n_frames` missing sprites of `width` by `height`.
    pub fn missing(width: u32, height: u32, n_frames: usize) -> Sprites {
        Sprites {
            width,
            height,
            cuts: vec![None; n_frames],
            scratch: Arc::new(InMemory::default()),
        }
    }

    /// Draws a sprite for every frame, on all threads, and puts them aside.
    ///
    /// `draw` is given a frame's number and its picture, wholly transparent, and says whether the frame has a sprite.
    pub fn drawn<E: From<Full> + Send>(
        [width, height]: [u32; 2],
        n_frames: usize,
        scratch: Arc<dyn Scratch>,
        draw: impl Fn(usize, &mut [u8]) -> Result<bool, E> + Sync,
    ) -> Result<Sprites, E> {
        let n_bytes = width as usize * height as usize * 4;
        let cut = |(picture, packed): &mut (Vec<u8>, Vec<u8>), frame_idx| {
            picture.clear();
            picture.resize(n_bytes, 0);
            if !draw(frame_idx, picture)? {
                return Ok(None);
            }
            let bounds = bounds_of(picture, width);
            packed.clear();
            for row in rows(bounds, width) {
                packed.extend_from_slice(&picture[row]);
            }
            let at = scratch.put(packed)?;
            Ok(Some(Cut { bounds, at }))
        };
        let cuts = (0..n_frames)
            .into_par_iter()
            .map_init(Default::default, cut)
            .collect::<Result<_, E>>()?;
        Ok(Sprites {
            width,
            height,
            cuts,
            scratch,
        })
    }

    /// Columns of each sprite.
    pub fn width(&self) -> u32 {
        self.width
    }

    /// Rows of each sprite.
    pub fn height(&self) -> u32 {
        self.height
    }

    /// Bytes of one sprite: width * height * 4.
    pub fn n_bytes(&self) -> usize {
        self.width as usize * self.height as usize * 4
    }

    /// One for every frame of the footage, missing ones included.
    pub fn n_frames(&self) -> usize {
        self.cuts.len()
    }

    /// Whether frame `frame_idx` has a sprite.
    pub fn is_present(&self, frame_idx: usize) -> bool {
        self.cuts[frame_idx].is_some()
    }

    /// The box of a frame's sprite that shows anything; empty where nothing does.
    pub fn bounds(&self, frame_idx: usize) -> Rect {
        self.cuts[frame_idx].map_or(Rect::default(), |cut| cut.bounds)
    }

    /// The RGBA bytes of a frame, all zero when it is missing. Panics beyond the last frame.
    pub fn sprite(&self, frame_idx: usize) -> Vec<u8> {
        let mut picture = Vec::new();
        self.read(frame_idx, &mut picture);
        picture
    }

    /// As [`sprite`](Sprites::sprite), in memory that the caller lends.
    pub fn read(&self, frame_idx: usize, picture: &mut Vec<u8>) {
        picture.clear();
        picture.resize(self.n_bytes(), 0);
        let mut packed = Vec::new();
        let bounds = self.read_cut(frame_idx, &mut packed);
        let packed_rows = packed.chunks_exact(bounds.w.max(1) as usize * 4);
        for (row, packed_row) in rows(bounds, self.width).zip(packed_rows) {
            picture[row].copy_from_slice(packed_row);
        }
    }

    /// The box that shows anything, whose RGBA bytes alone become those of `packed`; empty for a missing
    /// sprite.
    pub fn read_cut(&self, frame_idx: usize, packed: &mut Vec<u8>) -> Rect {
        packed.clear();
        let Some(Cut { bounds, at }) = self.cuts[frame_idx] else {
            return Rect::default();
        };
        packed.resize(bounds.area() as usize * 4, 0);
        self.scratch.get(at, packed);
        bounds
    }

    /// Where more may be put aside that belongs to these sprites.
    pub fn scratch(&self) -> &Arc<dyn Scratch> {
        &self.scratch
    }
}

/// Where the rows of a box lie among the bytes of a picture of `width` columns.
fn rows(bounds: Rect, width: u32) -> impl Iterator<Item = std::ops::Range<usize>> {
    (bounds.y..bounds.bottom()).map(move |y| {
        let first = (y as usize * width as usize + bounds.x as usize) * 4;
        first..first + bounds.w as usize * 4
    })
}

/// The same pictures, wherever they lie.
impl PartialEq for Sprites {
    fn eq(&self, other: &Sprites) -> bool {
        let shape = |s: &Sprites| (s.width, s.height, s.n_frames());
        shape(self) == shape(other)
            && (0..self.n_frames()).all(|idx| {
                self.is_present(idx) == other.is_present(idx)
                    && self.sprite(idx) == other.sprite(idx)
            })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_sprite_comes_back_with_its_empty_rim_and_a_missing_one_empty() {
        let mut picture = vec![0; 6 * 5 * 4];
        for (x, y) in [(2, 1), (4, 3)] {
            picture[(y * 6 + x) * 4..][..4].copy_from_slice(&[10, 20, 30, 40]);
        }
        let draw = |frame_idx, rgba: &mut [u8]| {
            rgba.copy_from_slice(&picture);
            Ok::<_, Full>(frame_idx != 1)
        };
        let sprites = Sprites::drawn([6, 5], 3, Arc::new(InMemory::default()), draw);
        let sprites = sprites.expect("memory has room");
        assert_eq!(sprites.sprite(2), picture);
        let (x, y, w, h) = (2, 1, 3, 3);
        assert_eq!(sprites.bounds(2), Rect { x, y, w, h });
        assert!(!sprites.is_present(1) && sprites.bounds(1).is_empty());
        assert_eq!(sprites.sprite(1), vec![0; 120]);
    }
}
