//! Affine map from the picture to a sprite: mirroring, rotation, scale and position
//! (docs/explanation/algorithms.md, "Compositing").

use std::ops::Range;

use super::Placement;
use super::premultiplied::{PAD, Premultiplied, REACH};
use super::step::Step;
use crate::geometry::Rect;

/// Maps picture coordinates to coordinates in a padded sprite, whose first pixel is (0, 0).
pub(super) struct Map<'a> {
    pub(super) sprite: &'a Premultiplied,
    origin: [f64; 2],
    pub(super) per_column: [f64; 2],
    per_row: [f64; 2],
    /// Picture columns per sprite pixel along each axis; infinite if a picture row is constant along the
    /// axis.
    columns: [f64; 2],
    place: Placement,
}

impl<'a> Map<'a> {
    pub(super) fn new(sprite: &'a Premultiplied, place: &Placement) -> Map<'a> {
        // Size of a pixel of this mipmap level in sprite pixels.
        let unit = f64::from(1u32 << sprite.level);
        let cos = libm::cos(place.rotation_rad) / (place.scale * unit);
        let sin = libm::sin(place.rotation_rad) / (place.scale * unit);
        let flip = if place.mirrored { -1.0 } else { 1.0 };
        let (per_column, per_row) = ([flip * cos, -sin], [flip * sin, cos]);
        let [x, y] = place.center_px;
        let origin = std::array::from_fn(|k| {
            // The center of pixel k of a level is at k + 0.5 level pixels.
            let middle = sprite.middle_px[k] / unit - 0.5;
            middle + PAD as f64 - per_column[k] * x - per_row[k] * y
        });
        Map {
            sprite,
            origin,
            per_column,
            per_row,
            columns: per_column.map(f64::recip),
            place: *place,
        }
    }

    /// Returns the step in the sprite from one pixel of a picture row to the next.
    pub(super) fn step(&self) -> Step {
        Step::new(self.per_column.map(fixed))
    }

    /// Returns the displacement in the sprite for `n` picture rows, in 1/65536 of a sprite pixel.
    pub(super) fn offset_of_rows(&self, n: f64) -> [i32; 2] {
        self.per_row.map(|step| fixed(n * step))
    }

    /// Returns the position in the sprite of a picture point.
    pub(super) fn source(&self, x: f64, y: f64) -> [f64; 2] {
        std::array::from_fn(|k| self.origin[k] + self.per_column[k] * x + self.per_row[k] * y)
    }

    /// Returns the box of the picture that the sprite may touch.
    pub(super) fn bounding_box(&self, [w, h]: [u32; 2]) -> Rect {
        let sprite = self.sprite;
        if sprite.is_empty() {
            return Rect::default();
        }
        let unit = f64::from(1u32 << sprite.level);
        let [width, height] = sprite.size.map(|side| side as f64);
        let [middle_x, middle_y] = sprite.middle_px;
        let reach = REACH as f64;
        let (mut least, mut greatest) = ([f64::INFINITY; 2], [f64::NEG_INFINITY; 2]);
        for u in [-reach, width + reach] {
            for v in [-reach, height + reach] {
                let corner = self.place.point([u * unit - middle_x, v * unit - middle_y]);
                for axis in 0..2 {
                    least[axis] = least[axis].min(corner[axis]);
                    greatest[axis] = greatest[axis].max(corner[axis]);
                }
            }
        }
        let [left, top] = least.map(|edge| edge.floor() as i64);
        let [right, bottom] = greatest.map(|edge| edge.ceil() as i64);
        Rect::clipped(left, top, right, bottom, w, h)
    }

    /// Returns those of `n` columns of a picture row that map into the sprite; empty if none does. `start` is
    /// the position of the first column in the sprite.
    pub(super) fn columns_within(&self, n: usize, start: [f64; 2]) -> Range<usize> {
        let (mut from, mut to) = (0.0f64, n as f64);
        for axis in 0..2 {
            let extent = self.sprite.size[axis] as f64;
            let (low, high) = ((PAD - REACH) as f64, (PAD + REACH) as f64 + extent - 1.0);
            let step = self.per_column[axis];
            if step.abs() < 1e-12 {
                if start[axis] <= low || start[axis] >= high {
                    return 0..0;
                }
                continue;
            }
            let [a, b] = [low, high].map(|edge| (edge - start[axis]) * self.columns[axis]);
            from = from.max(a.min(b).floor() + 1.0);
            to = to.min(a.max(b).ceil());
        }
        if from < to {
            from as usize..to as usize
        } else {
            0..0
        }
    }
}

/// Converts a coordinate to 1/65536 of a pixel.
pub(super) fn fixed(coordinate: f64) -> i32 {
    (coordinate * 65536.0).round() as i32
}
