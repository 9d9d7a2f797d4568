//! Pixel rectangles: half-open, x right, y down, within the image they belong to.

/// The pixels with columns `x..x + w` and rows `y..y + h`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub struct Rect {
    /// Leftmost column.
    pub x: u32,
    /// Topmost row.
    pub y: u32,
    /// Number of columns.
    pub w: u32,
    /// Number of rows.
    pub h: u32,
}

impl Rect {
    /// Returns the rectangle with its upper left pixel at (`x`, `y`) and `w` by `h` pixels.
    pub const fn new(x: u32, y: u32, w: u32, h: u32) -> Rect {
        Rect { x, y, w, h }
    }

    /// Returns the rectangle that covers an image of `w` by `h` pixels.
    pub fn of_size(w: u32, h: u32) -> Rect {
        Rect::new(0, 0, w, h)
    }

    /// Returns the pixels with columns `left..right` and rows `top..bottom`.
    pub fn from_edges(left: u32, top: u32, right: u32, bottom: u32) -> Rect {
        let (w, h) = (right.saturating_sub(left), bottom.saturating_sub(top));
        Rect::new(left, top, w, h)
    }

    /// Returns the part of the rectangle `left..right`, `top..bottom` that lies in an image of `w` by `h`
    /// pixels.
    pub fn clipped(left: i64, top: i64, right: i64, bottom: i64, w: u32, h: u32) -> Rect {
        let clip = |v: i64, limit: u32| v.clamp(0, i64::from(limit)) as u32;
        Rect::from_edges(clip(left, w), clip(top, h), clip(right, w), clip(bottom, h))
    }

    /// Returns the index after the last column.
    pub fn right(&self) -> u32 {
        self.x + self.w
    }

    /// Returns the index after the last row.
    pub fn bottom(&self) -> u32 {
        self.y + self.h
    }

    /// Returns the number of pixels.
    pub fn area(&self) -> u64 {
        u64::from(self.w) * u64::from(self.h)
    }

    /// Returns true if the rectangle has no pixels.
    pub fn is_empty(&self) -> bool {
        self.w == 0 || self.h == 0
    }

    /// Returns the rectangle grown by `margin_px` on every side and clipped to an image of `w` by `h`.
    pub fn inflated(&self, margin_px: u32, w: u32, h: u32) -> Rect {
        let m = i64::from(margin_px);
        let edges = [self.x, self.y, self.right(), self.bottom()];
        let [left, top, right, bottom] = edges.map(i64::from);
        Rect::clipped(left - m, top - m, right + m, bottom + m, w, h)
    }

    /// Returns the pixels that the rectangle touches in the image enlarged by `scale`.
    pub fn scaled(&self, scale: f64) -> Rect {
        let down = |v: u32| (f64::from(v) * scale).floor() as u32;
        let up = |v: u32| (f64::from(v) * scale).ceil() as u32;
        let (right, bottom) = (up(self.right()), up(self.bottom()));
        Rect::from_edges(down(self.x), down(self.y), right, bottom)
    }

    /// Returns the smallest rectangle that contains both. An empty rectangle adds nothing.
    pub fn union(&self, other: &Rect) -> Rect {
        if self.is_empty() {
            return *other;
        }
        if other.is_empty() {
            return *self;
        }
        let (left, top) = (self.x.min(other.x), self.y.min(other.y));
        let right = self.right().max(other.right());
        let bottom = self.bottom().max(other.bottom());
        Rect::from_edges(left, top, right, bottom)
    }

    /// Returns the pixels common to both; empty if they do not overlap.
    pub fn intersection(&self, other: &Rect) -> Rect {
        let (left, top) = (self.x.max(other.x), self.y.max(other.y));
        let right = self.right().min(other.right());
        let bottom = self.bottom().min(other.bottom());
        Rect::from_edges(left, top, right, bottom)
    }

    /// Returns whether the pixel (x, y) lies inside.
    pub fn contains(&self, x: u32, y: u32) -> bool {
        x >= self.x && x < self.right() && y >= self.y && y < self.bottom()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn inflating_stops_at_the_border() {
        assert_eq!(
            Rect::new(2, 3, 4, 5).inflated(3, 8, 100),
            Rect::new(0, 0, 8, 11)
        );
    }

    #[test]
    fn union_covers_both_and_intersection_is_common_to_both() {
        let (a, b) = (Rect::new(0, 0, 4, 4), Rect::new(2, 3, 5, 5));
        assert_eq!(a.union(&b), Rect::new(0, 0, 7, 8));
        assert_eq!(a.intersection(&b), Rect::new(2, 3, 2, 1));
        assert!(a.intersection(&Rect::new(9, 9, 1, 1)).is_empty());
    }
}
