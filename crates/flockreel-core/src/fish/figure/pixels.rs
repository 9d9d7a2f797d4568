//! Matte of one frame, read by image position.

use crate::library::Library;

/// Pixels of one matte and its place in the footage.
#[derive(Clone)]
pub(in crate::fish) struct Pixels {
    /// Corner of the matte in the footage, pixels.
    pub(super) corner: [i64; 2],
    /// Width and height.
    pub(super) size: [usize; 2],
    /// Width and height of the footage.
    pub(super) image_size: [u32; 2],
    /// Straight-alpha RGBA.
    rgba: Vec<u8>,
}

impl Pixels {
    /// Returns the matte of a frame; `None` if it has none.
    pub(in crate::fish) fn read(library: &Library, frame_idx: usize) -> Option<Pixels> {
        let matte = library.sprites.matte(frame_idx)?;
        let centroid = library.poses.frames[frame_idx].centroid_px?;
        let mut rgba = Vec::new();
        library.sprites.read_matte(&matte, &mut rgba);
        Some(Pixels {
            corner: [0, 1].map(|c| (centroid[c] - matte.center_px[c]).round() as i64),
            size: matte.size.map(|side| side as usize),
            image_size: library.poses.image_size_px,
            rgba,
        })
    }

    /// Returns a matte of the given straight-alpha RGBA pixels.
    #[cfg(test)]
    pub(super) fn of(
        corner: [i64; 2],
        size: [usize; 2],
        image_size: [u32; 2],
        rgba: Vec<u8>,
    ) -> Pixels {
        Pixels {
            corner,
            size,
            image_size,
            rgba,
        }
    }

    /// Returns the alpha of a pixel of the footage, 0..=1.
    pub(super) fn alpha(&self, x: i64, y: i64) -> f32 {
        f32::from(self.pixel(x, y)[3]) / 255.0
    }

    /// Returns straight-alpha RGBA at a point of the footage, 0..=255, interpolated between four pixels.
    pub(super) fn sample(&self, [x, y]: [f64; 2]) -> [f32; 4] {
        let (left, top) = ((x - 0.5).floor(), (y - 0.5).floor());
        let (fx, fy) = ((x - 0.5 - left) as f32, (y - 0.5 - top) as f32);
        let mut sum = [0.0f32; 4];
        for (dx, dy, weight) in [
            (0, 0, (1.0 - fx) * (1.0 - fy)),
            (1, 0, fx * (1.0 - fy)),
            (0, 1, (1.0 - fx) * fy),
            (1, 1, fx * fy),
        ] {
            let [r, g, b, a] = self
                .pixel(
                    (left as i64).saturating_add(dx),
                    (top as i64).saturating_add(dy),
                )
                .map(f32::from);
            for (sum, value) in sum.iter_mut().zip([r * a, g * a, b * a, a]) {
                *sum += weight * value;
            }
        }
        let [r, g, b, a] = sum;
        let alpha = a.max(1e-6);
        [r / alpha, g / alpha, b / alpha, a]
    }

    /// Returns the mean brightness of the animal, 0..=255.
    pub(super) fn brightness(&self) -> f32 {
        let (mut sum, mut total) = (0.0f32, 1e-6f32);
        for pixel in self.rgba.chunks_exact(4) {
            let alpha = f32::from(pixel[3]);
            sum += alpha * (f32::from(pixel[0]) + f32::from(pixel[1]) + f32::from(pixel[2])) / 3.0;
            total += alpha;
        }
        sum / total
    }

    /// Returns the number of pixels that the animal covers by at least one half.
    pub(in crate::fish) fn n_covered(&self) -> usize {
        self.rgba
            .chunks_exact(4)
            .filter(|pixel| pixel[3] >= 128)
            .count()
    }

    /// Returns a pixel of the footage, straight-alpha RGBA; transparent outside the matte.
    pub(in crate::fish) fn pixel(&self, x: i64, y: i64) -> [u8; 4] {
        let (x, y) = (
            x.saturating_sub(self.corner[0]),
            y.saturating_sub(self.corner[1]),
        );
        let [w, h] = self.size.map(|side| side as i64);
        if !(0..w).contains(&x) || !(0..h).contains(&y) {
            return [0; 4];
        }
        let at = (y * w + x) as usize * 4;
        [0, 1, 2, 3].map(|c| self.rgba[at + c])
    }
}
