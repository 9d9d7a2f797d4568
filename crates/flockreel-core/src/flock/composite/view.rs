//! Mapping from pixels of the footage, in which a flock is placed, to pixels of the film.
//!
//! The whole picture of the footage is scaled to fit the film and centered. If the aspect ratios differ,
//! bars remain beside the picture, or above and below it (docs/explanation/algorithms.md, "Compositing").

use crate::geometry::Rect;

/// Position and scale of the footage's picture in the film.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct View {
    /// Width and height of the film, in pixels.
    pub(super) size_px: [u32; 2],
    /// Film pixels per footage pixel.
    pub(super) scale: f64,
    /// Upper left corner of the picture, in pixels of the film.
    pub(super) offset_px: [f64; 2],
}

impl View {
    /// Returns the view that shows the whole picture as large as possible in the middle of the film.
    pub(super) fn fitted(footage_px: [u32; 2], size_px: [u32; 2]) -> View {
        if footage_px == size_px {
            return View {
                size_px,
                scale: 1.0,
                offset_px: [0.0; 2],
            };
        }
        let [w, h] = footage_px.map(f64::from);
        let [width, height] = size_px.map(f64::from);
        let scale = (width / w).min(height / h);
        View {
            size_px,
            scale,
            offset_px: [(width - w * scale) / 2.0, (height - h * scale) / 2.0],
        }
    }

    /// Converts a point from footage pixels to film pixels.
    pub(super) fn point(&self, [x, y]: [f64; 2]) -> [f64; 2] {
        [
            self.offset_px[0] + x * self.scale,
            self.offset_px[1] + y * self.scale,
        ]
    }

    /// Returns the rectangle of the film that shows the picture.
    pub(super) fn rect(&self) -> Rect {
        let [width, height] = self.size_px;
        let [left, top] = self.offset_px.map(|px| px.round() as i64);
        let (right, bottom) = (i64::from(width) - left, i64::from(height) - top);
        Rect::clipped(left, top, right, bottom, width, height)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn picture_keeps_its_shape_in_the_middle_of_any_film() {
        let view = View::fitted([640, 480], [1920, 1080]);
        assert_eq!((view.scale, view.offset_px), (2.25, [240.0, 0.0]));
        assert_eq!(view.point([320.0, 240.0]), [960.0, 540.0]);
        let (x, y, w, h) = (240, 0, 1440, 1080);
        assert_eq!(view.rect(), Rect { x, y, w, h });
        let same = View::fitted([641, 481], [641, 481]);
        assert_eq!(same.point([12.5, 7.25]), [12.5, 7.25]);
        assert_eq!(same.rect(), Rect::of_size(641, 481));
    }
}
