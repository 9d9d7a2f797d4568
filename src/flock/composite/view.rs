//! From pixels of the footage, in which a flock is placed, to pixels of the film: the same field of view
//! at any size (ALGORITHMS.md 8). A film of another shape has bars beside the view or above and below it.

use crate::geometry::Rect;

/// The footage's picture within a film.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct View {
    /// Width and height of the film.
    pub(super) size_px: [u32; 2],
    /// Pixels of the film to a pixel of the footage.
    pub(super) scale: f64,
    /// Where the view's upper left corner lies in the film.
    pub(super) offset_px: [f64; 2],
}

impl View {
    /// The whole of a footage as large as a film of `size_px` lets it be, in its middle.
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

    /// A point of the footage in the film.
    pub(super) fn point(&self, [x, y]: [f64; 2]) -> [f64; 2] {
        [
            self.offset_px[0] + x * self.scale,
            self.offset_px[1] + y * self.scale,
        ]
    }

    /// The pixels of the film that show the footage's picture.
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
    fn the_view_keeps_its_shape_in_the_middle_of_any_film() {
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
