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
    /// Returns the rectangle that covers an image of `w` by `h` pixels.
    pub fn of_size(w: u32, h: u32) -> Rect {
        Rect { x: 0, y: 0, w, h }
    }

    /// Returns the part of the rectangle `left..right`, `top..bottom` that lies in an image of `w` by `h`
    /// pixels.
    pub fn clipped(left: i64, top: i64, right: i64, bottom: i64, w: u32, h: u32) -> Rect {
        let clip = |v: i64, limit: u32| v.clamp(0, i64::from(limit)) as u32;
        let (x0, x1) = (clip(left, w), clip(right, w));
        let (y0, y1) = (clip(top, h), clip(bottom, h));
        Rect {
            x: x0,
            y: y0,
            w: x1.saturating_sub(x0),
            h: y1.saturating_sub(y0),
        }
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
        Rect::clipped(
            i64::from(self.x) - m,
            i64::from(self.y) - m,
            i64::from(self.right()) + m,
            i64::from(self.bottom()) + m,
            w,
            h,
        )
    }

    /// Returns the smallest rectangle that contains both. An empty rectangle adds nothing.
    pub fn union(&self, other: &Rect) -> Rect {
        if self.is_empty() {
            return *other;
        }
        if other.is_empty() {
            return *self;
        }
        let (x, y) = (self.x.min(other.x), self.y.min(other.y));
        let (right, bottom) = (
            self.right().max(other.right()),
            self.bottom().max(other.bottom()),
        );
        Rect {
            x,
            y,
            w: right - x,
            h: bottom - y,
        }
    }

    /// Returns the pixels common to both; empty if they do not overlap.
    pub fn intersection(&self, other: &Rect) -> Rect {
        let (x, y) = (self.x.max(other.x), self.y.max(other.y));
        let (right, bottom) = (
            self.right().min(other.right()),
            self.bottom().min(other.bottom()),
        );
        Rect {
            x,
            y,
            w: right.saturating_sub(x),
            h: bottom.saturating_sub(y),
        }
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
        let rect = Rect {
            x: 2,
            y: 3,
            w: 4,
            h: 5,
        };
        assert_eq!(
            rect.inflated(3, 8, 100),
            Rect {
                x: 0,
                y: 0,
                w: 8,
                h: 11
            }
        );
    }

    #[test]
    fn union_and_intersection_hold_what_their_names_say() {
        let (a, b) = (
            Rect {
                x: 0,
                y: 0,
                w: 4,
                h: 4,
            },
            Rect {
                x: 2,
                y: 3,
                w: 5,
                h: 5,
            },
        );
        assert_eq!(
            a.union(&b),
            Rect {
                x: 0,
                y: 0,
                w: 7,
                h: 8
            }
        );
        assert_eq!(
            a.intersection(&b),
            Rect {
                x: 2,
                y: 3,
                w: 2,
                h: 1
            }
        );
        assert!(
            a.intersection(&Rect {
                x: 9,
                y: 9,
                w: 1,
                h: 1
            })
            .is_empty()
        );
    }
}
