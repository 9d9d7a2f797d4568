//! The animal of every frame: cut out as it was filmed, pixel for pixel, and from that the sprites, all of
//! one size with the centroid at the middle (O's clip U).
//!
//! What is drawn into a flock is the matte, so that it is interpolated once; what is compared and exported
//! are sprites, put together when they are asked for. A long footage has many: their pixels lie in a
//! [`Scratch`].

use std::sync::Arc;

use rayon::prelude::*;

use crate::cpu::Level;
use crate::geometry::Rect;
use crate::raster::canvas::straight;
use crate::raster::resample::{Placement, Premultiplied, Resampled, Room, bounds_of};
use crate::scratch::{Full, InMemory, Scratch};

/// The animal of every frame of the footage, in straight-alpha RGBA.
///
/// A frame without the animal has no sprite: its picture is wholly transparent and it is not `present`.
#[derive(Clone, Debug)]
pub struct Sprites {
    width: u32,
    height: u32,
    mattes: Vec<Option<Matte>>,
    /// How large every frame's sprite is relative to the footage; `None` when all are as filmed.
    scales: Option<Vec<f64>>,
    scratch: Arc<dyn Scratch>,
}

/// The animal cut out of one frame, its pixels those of the frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Matte {
    /// Columns and rows.
    pub size: [u32; 2],
    /// The animal's centroid, from the upper left corner, to 3 decimals, as files hold it.
    pub center_px: [f64; 2],
    /// Where the RGBA bytes lie.
    pub at: u64,
}

impl Matte {
    /// How far its farthest corner is from the centroid, pixels.
    pub fn reach_px(&self) -> f64 {
        let farthest = |k: usize| {
            let after = f64::from(self.size[k]) - self.center_px[k];
            self.center_px[k].abs().max(after.abs())
        };
        libm::hypot(farthest(0), farthest(1))
    }
}

impl Sprites {
    /// `n_frames` missing sprites of `width` by `height`.
    pub fn missing(width: u32, height: u32, n_frames: usize) -> Sprites {
        Sprites::of(
            [width, height],
            vec![None; n_frames],
            None,
            Arc::new(InMemory::default()),
        )
    }

    /// Sprites of `size` pixels, of mattes that lie in `scratch`: as large as filmed, or of `scales`.
    pub fn of(
        [width, height]: [u32; 2],
        mattes: Vec<Option<Matte>>,
        scales: Option<Vec<f64>>,
        scratch: Arc<dyn Scratch>,
    ) -> Sprites {
        Sprites {
            width,
            height,
            mattes,
            scales,
            scratch,
        }
    }

    /// Draws a sprite for every frame, on all threads, and puts aside what each shows.
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
            let bounds = match bounds_of(picture, width) {
                nothing if nothing.is_empty() => Rect::of_size(1, 1),
                bounds => bounds,
            };
            packed.clear();
            for row in rows(bounds, width) {
                packed.extend_from_slice(&picture[row]);
            }
            Ok(Some(Matte {
                size: [bounds.w, bounds.h],
                center_px: [
                    f64::from(width) / 2.0 - f64::from(bounds.x),
                    f64::from(height) / 2.0 - f64::from(bounds.y),
                ],
                at: scratch.put(packed)?,
            }))
        };
        let mattes = (0..n_frames)
            .into_par_iter()
            .map_init(Default::default, cut)
            .collect::<Result<_, E>>()?;
        Ok(Sprites::of([width, height], mattes, None, scratch))
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
        self.mattes.len()
    }

    /// Whether frame `frame_idx` has a sprite.
    pub fn is_present(&self, frame_idx: usize) -> bool {
        self.mattes[frame_idx].is_some()
    }

    /// How large every frame's sprite is relative to the footage; `None` when all are as filmed.
    pub fn scales(&self) -> Option<&[f64]> {
        self.scales.as_deref()
    }

    /// What was cut out of a frame. Panics beyond the last frame.
    pub fn matte(&self, frame_idx: usize) -> Option<Matte> {
        self.mattes[frame_idx]
    }

    /// The RGBA bytes of a matte, by rows, in memory that the caller lends.
    pub fn read_matte(&self, matte: &Matte, rgba: &mut Vec<u8>) {
        let [width, height] = matte.size;
        rgba.clear();
        rgba.resize(width as usize * height as usize * 4, 0);
        self.scratch.get(matte.at, rgba);
    }

    /// The RGBA bytes of a frame's sprite, all zero when it is missing. Panics beyond the last frame.
    ///
    /// The centroid's sub-pixel rest is interpolated by Catmull and Rom's curve in premultiplied alpha; where
    /// there is none, pixels are those of the matte.
    pub fn sprite(&self, frame_idx: usize) -> Vec<u8> {
        let mut picture = vec![0; self.n_bytes()];
        let Some(matte) = self.mattes[frame_idx] else {
            return picture;
        };
        let mut rgba = Vec::new();
        self.read_matte(&matte, &mut rgba);
        let scale = self.scales().map_or(1.0, |scales| scales[frame_idx]);
        match self.whole_shift(&matte).filter(|_| scale == 1.0) {
            Some(shift) => self.copy(&rgba, matte.size, shift, &mut picture),
            None => self.interpolate(&rgba, &matte, scale, &mut picture),
        }
        picture
    }

    /// Where the corner of a matte comes to lie in its sprite, if that is on a whole pixel.
    fn whole_shift(&self, matte: &Matte) -> Option<[i64; 2]> {
        let middle = [self.width, self.height].map(|side| f64::from(side) / 2.0);
        let shift = [0, 1].map(|k| middle[k] - matte.center_px[k]);
        let is_whole = shift.iter().all(|px| px.fract() == 0.0);
        is_whole.then(|| shift.map(|px| px as i64))
    }

    fn copy(&self, rgba: &[u8], [w, h]: [u32; 2], [x, y]: [i64; 2], picture: &mut [u8]) {
        let (right, bottom) = (x + i64::from(w), y + i64::from(h));
        let seen = Rect::clipped(x, y, right, bottom, self.width, self.height);
        let left = (i64::from(seen.x) - x) as usize;
        let hidden = (i64::from(seen.y) - y) as usize;
        let from = rgba.chunks_exact(w.max(1) as usize * 4).skip(hidden);
        for (row, from) in rows(seen, self.width).zip(from) {
            let n = row.len();
            picture[row].copy_from_slice(&from[left * 4..left * 4 + n]);
        }
    }

    fn interpolate(&self, rgba: &[u8], matte: &Matte, scale: f64, picture: &mut [u8]) {
        let size = [self.width, self.height];
        let place = Placement {
            center_px: size.map(|side| f64::from(side) / 2.0),
            rotation_rad: 0.0,
            scale,
            mirrored: false,
        };
        let premultiplied = Premultiplied::of(rgba, matte.size, matte.center_px, scale);
        let mut placed = Resampled::default();
        let room = Room { size, nearer: None };
        placed.draw(&premultiplied, &place, room, Level::detect());
        for ([x, y], row) in placed.shown() {
            let at = (y * self.width + x) as usize * 4;
            let out = &mut picture[at..at + row.len() * 4];
            for (out, &pixel) in out.chunks_exact_mut(4).zip(row) {
                out.copy_from_slice(&visible(straight(pixel)));
            }
        }
    }

    /// Where more may be put aside that belongs to these sprites.
    pub fn scratch(&self) -> &Arc<dyn Scratch> {
        &self.scratch
    }
}

/// A pixel whose alpha rounds to nothing has no color either.
fn visible(pixel: [u8; 4]) -> [u8; 4] {
    match pixel[3] {
        0 => [0; 4],
        _ => pixel,
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
        let matte = |sprites: &Sprites, idx: usize| {
            let matte = sprites.matte(idx)?;
            let mut rgba = Vec::new();
            sprites.read_matte(&matte, &mut rgba);
            Some((matte.size, matte.center_px, rgba))
        };
        shape(self) == shape(other)
            && self.scales == other.scales
            && (0..self.n_frames()).all(|idx| matte(self, idx) == matte(other, idx))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_sprite_comes_back_with_its_empty_rim_and_a_missing_one_empty() {
        let mut picture = vec![0; 6 * 5 * 4];
        for (x, y) in [(2, 1), (4, 3)] {
            picture[(y * 6 + x) * 4..][..4].copy_from_slice(&[10, 20, 30, 1]);
        }
        let draw = |frame_idx, rgba: &mut [u8]| {
            rgba.copy_from_slice(&picture);
            Ok::<_, Full>(frame_idx != 1)
        };
        let sprites = Sprites::drawn([6, 5], 3, Arc::new(InMemory::default()), draw);
        let sprites = sprites.expect("memory has room");
        assert_eq!(sprites.sprite(2), picture);
        let matte = sprites.matte(2).expect("a sprite");
        assert_eq!((matte.size, matte.center_px), ([3, 3], [1.0, 1.5]));
        assert!(!sprites.is_present(1) && sprites.matte(1).is_none());
        assert_eq!(sprites.sprite(1), vec![0; 120]);
    }

    /// A white bar of 3 x 1 in a matte of 5 x 3, in a sprite of 4 x 2, as alpha.
    fn alpha_of_bar(center_px: [f64; 2], scales: Option<Vec<f64>>) -> Vec<u8> {
        let scratch = InMemory::default();
        let mut rgba = vec![0; 5 * 3 * 4];
        rgba[(5 + 1) * 4..(5 + 4) * 4].fill(255);
        let matte = Matte {
            size: [5, 3],
            center_px,
            at: scratch.put(&rgba).expect("memory has room"),
        };
        let sprites = Sprites::of([4, 2], vec![Some(matte)], scales, Arc::new(scratch));
        let sprite = sprites.sprite(0);
        sprite.chunks_exact(4).map(|pixel| pixel[3]).collect()
    }

    #[test]
    fn the_centroid_comes_to_lie_in_the_middle_and_what_has_no_room_is_left_out() {
        assert_eq!(
            alpha_of_bar([3.0, 1.0], None),
            [0, 0, 0, 0, 255, 255, 255, 0]
        );
        assert_eq!(alpha_of_bar([4.0, 2.0], None), [255, 255, 0, 0, 0, 0, 0, 0]);
    }

    #[test]
    fn between_pixels_a_sprite_is_interpolated_and_another_scale_shows_it_larger() {
        let half = alpha_of_bar([2.5, 1.0], None);
        assert_eq!(half[..4], [0; 4]);
        // Catmull and Rom's curve half way up an edge: 9 / 16 - 1 / 16.
        assert_eq!(half[4..], [128, 255, 255, 128]);
        let large = alpha_of_bar([2.5, 1.5], Some(vec![2.0]));
        assert!(large.iter().all(|&alpha| alpha > 200), "{large:?}");
    }
}
