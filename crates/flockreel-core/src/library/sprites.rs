//! Mattes and sprites. A matte is the animal as cut out of one frame, pixel for pixel. Sprites all have one
//! size, with the centroid at the middle (the clips U of Okabe et al.).
//!
//! Flocks are drawn from mattes, so that each picture is interpolated only once. Distances and exports use
//! sprites, which are computed from mattes on request. The pixels lie in a [`Scratch`], because a long
//! footage has many.

use std::sync::Arc;

use rayon::prelude::*;

use crate::cpu::Level;
use crate::geometry::Rect;
use crate::raster::canvas::straight;
use crate::raster::resample::{Placement, Premultiplied, Resampled, Viewport, bounds_of};
use crate::scratch::{Full, InMemory, Scratch};

/// The animal in every frame of the footage, in straight-alpha RGBA.
///
/// A frame without the animal has no matte, and its sprite is fully transparent.
#[derive(Clone, Debug)]
pub struct Sprites {
    width: u32,
    height: u32,
    mattes: Vec<Option<Matte>>,
    /// Scale of each frame's sprite relative to the footage; `None` if all are 1.
    scales: Option<Vec<f64>>,
    scratch: Arc<dyn Scratch>,
}

/// The animal cut out of one frame, with the pixels of that frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Matte {
    /// Width and height, pixels.
    pub size: [u32; 2],
    /// Centroid of the animal, pixels from the upper left corner, rounded to 3 decimals as in files.
    pub center_px: [f64; 2],
    /// Offset of the RGBA bytes in the scratch.
    pub at: u64,
}

impl Matte {
    /// Returns the distance from the centroid to the farthest corner, pixels.
    pub fn reach_px(&self) -> f64 {
        let farthest = |k: usize| {
            let after = f64::from(self.size[k]) - self.center_px[k];
            self.center_px[k].abs().max(after.abs())
        };
        libm::hypot(farthest(0), farthest(1))
    }
}

impl Sprites {
    /// Returns `n_frames` missing sprites of `width` by `height` pixels.
    pub fn missing(width: u32, height: u32, n_frames: usize) -> Sprites {
        let scratch = Arc::new(InMemory::default());
        Sprites::new([width, height], vec![None; n_frames], None, scratch)
    }

    /// Makes sprites of `size` pixels from mattes stored in `scratch`. `scales` holds one scale per frame;
    /// `None` means 1.
    pub fn new(
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

    /// Draws a sprite for every frame, in parallel, and stores its visible part in `scratch` as a matte.
    ///
    /// `draw` gets the frame index and a fully transparent picture. It returns whether the frame has a
    /// sprite.
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
            let mut bounds = bounds_of(picture, width);
            if bounds.is_empty() {
                bounds = Rect::of_size(1, 1);
            }
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
        Ok(Sprites::new([width, height], mattes, None, scratch))
    }

    /// Returns the width of each sprite, pixels.
    pub fn width(&self) -> u32 {
        self.width
    }

    /// Returns the height of each sprite, pixels.
    pub fn height(&self) -> u32 {
        self.height
    }

    /// Returns the size of one sprite, bytes: width * height * 4.
    pub fn n_bytes(&self) -> usize {
        self.width as usize * self.height as usize * 4
    }

    /// Adds frames without a sprite before the first frame and after the last.
    pub(super) fn pad(&mut self, n_before: usize, n_after: usize) {
        let n_frames = n_before + self.mattes.len() + n_after;
        self.mattes.splice(0..0, (0..n_before).map(|_| None));
        self.mattes.resize(n_frames, None);
        if let Some(scales) = &mut self.scales {
            scales.splice(0..0, (0..n_before).map(|_| 1.0));
            scales.resize(n_frames, 1.0);
        }
    }

    /// Returns the number of frames of the footage, including frames without a sprite.
    pub fn n_frames(&self) -> usize {
        self.mattes.len()
    }

    /// Returns whether frame `frame_idx` has a sprite. Panics beyond the last frame.
    pub fn is_present(&self, frame_idx: usize) -> bool {
        self.mattes[frame_idx].is_some()
    }

    /// Returns the scale of each frame's sprite relative to the footage; `None` if all are 1.
    pub fn scales(&self) -> Option<&[f64]> {
        self.scales.as_deref()
    }

    /// Returns the matte of a frame, if it has one. Panics beyond the last frame.
    pub fn matte(&self, frame_idx: usize) -> Option<Matte> {
        self.mattes[frame_idx]
    }

    /// Reads the RGBA bytes of a matte, row by row, into `rgba`, whose memory is reused.
    pub fn read_matte(&self, matte: &Matte, rgba: &mut Vec<u8>) {
        let [width, height] = matte.size;
        rgba.clear();
        rgba.resize(width as usize * height as usize * 4, 0);
        self.scratch.get(matte.at, rgba);
    }

    /// Returns the RGBA bytes of a frame's sprite, all zero if it is missing. Panics beyond the last frame.
    ///
    /// If the shift to the centroid is a whole number of pixels and the scale is 1, the pixels are those of
    /// the matte. Otherwise they are interpolated in premultiplied alpha (Catmull-Rom).
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

    /// Returns the position of the matte's corner in its sprite, if it is a whole number of pixels.
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
        let premultiplied = Premultiplied::new(rgba, matte.size, matte.center_px, scale);
        let mut placed = Resampled::default();
        let viewport = Viewport { size, nearer: None };
        placed.draw(&premultiplied, &place, viewport, Level::detect());
        for ([x, y], row) in placed.shown() {
            let at = (y * self.width + x) as usize * 4;
            let out = &mut picture[at..at + row.len() * 4];
            for (out, &pixel) in out.chunks_exact_mut(4).zip(row) {
                out.copy_from_slice(&visible(straight(pixel)));
            }
        }
    }

    /// Returns the scratch, which may store more data that belongs to these sprites.
    pub fn scratch(&self) -> &Arc<dyn Scratch> {
        &self.scratch
    }
}

/// Clears the color of a pixel whose alpha is 0.
fn visible(pixel: [u8; 4]) -> [u8; 4] {
    if pixel[3] > 0 { pixel } else { [0; 4] }
}

/// Returns the byte range of each row of a box in an RGBA picture of `width` columns.
fn rows(bounds: Rect, width: u32) -> impl Iterator<Item = std::ops::Range<usize>> {
    (bounds.y..bounds.bottom()).map(move |y| {
        let first = (y as usize * width as usize + bounds.x as usize) * 4;
        first..first + bounds.w as usize * 4
    })
}

/// Compares the pictures, not their storage.
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
    fn drawn_sprites_keep_their_transparent_border_and_missing_ones_are_empty() {
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

    /// Returns the alpha of a sprite of 4 x 2 pixels. It shows a white bar of 3 x 1 in a matte of 5 x 3.
    fn alpha_of_bar(center_px: [f64; 2], scales: Option<Vec<f64>>) -> Vec<u8> {
        let scratch = InMemory::default();
        let mut rgba = vec![0; 5 * 3 * 4];
        rgba[(5 + 1) * 4..(5 + 4) * 4].fill(255);
        let matte = Matte {
            size: [5, 3],
            center_px,
            at: scratch.put(&rgba).expect("memory has room"),
        };
        let sprites = Sprites::new([4, 2], vec![Some(matte)], scales, Arc::new(scratch));
        let sprite = sprites.sprite(0);
        sprite.chunks_exact(4).map(|pixel| pixel[3]).collect()
    }

    #[test]
    fn centroid_lies_in_the_middle_and_the_rest_is_clipped() {
        assert_eq!(
            alpha_of_bar([3.0, 1.0], None),
            [0, 0, 0, 0, 255, 255, 255, 0]
        );
        assert_eq!(alpha_of_bar([4.0, 2.0], None), [255, 255, 0, 0, 0, 0, 0, 0]);
    }

    #[test]
    fn fractional_shifts_and_scales_are_interpolated() {
        let half = alpha_of_bar([2.5, 1.0], None);
        assert_eq!(half[..4], [0; 4]);
        // Catmull-Rom weights half way up an edge: 9/16 - 1/16.
        assert_eq!(half[4..], [128, 255, 255, 128]);
        let large = alpha_of_bar([2.5, 1.5], Some(vec![2.0]));
        assert!(large.iter().all(|&alpha| alpha > 200), "{large:?}");
    }
}
