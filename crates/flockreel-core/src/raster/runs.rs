//! 8-connected components of a mask, found from runs of pixels with union-find in one pass.
//!
//! Source: He, Chao & Suzuki, "A run-based two-scan labeling algorithm", 2008. The second scan over pixels is
//! omitted, because a component is stored as its list of runs.

use super::Mask;
use crate::geometry::Rect;

/// The pixels `x0..x1` of row `y`, in image coordinates.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Run {
    /// The row.
    pub y: u32,
    /// First column.
    pub x0: u32,
    /// One past the last column.
    pub x1: u32,
}

/// One connected component.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Component {
    /// Runs, ordered from the top, then from the left.
    pub runs: Vec<Run>,
    /// Number of pixels.
    pub area: u64,
    /// Bounding box.
    pub rect: Rect,
}

impl Component {
    /// Returns the component as a mask over `rect`, clipped to it.
    pub fn mask(&self, rect: Rect) -> Mask {
        let mut mask = Mask::new(rect);
        let rows = rect.y..rect.bottom();
        for run in self.runs.iter().filter(|run| rows.contains(&run.y)) {
            let (x0, x1) = (run.x0.max(rect.x), run.x1.min(rect.right()));
            if x0 < x1 {
                let row = (run.y - rect.y) as usize * rect.w as usize;
                let (from, to) = ((x0 - rect.x) as usize, (x1 - rect.x) as usize);
                mask.bits[row + from..row + to].fill(1);
            }
        }
        mask
    }

    /// Returns the centroid of the pixel centers, pixels. Integer sums along the runs make it exact.
    ///
    /// ```
    /// use flockreel_core::{geometry::Rect, raster::{Mask, runs::components}};
    /// let mask = Mask { rect: Rect::of_size(3, 2), bits: vec![1, 0, 0, 0, 1, 0] };
    /// assert_eq!(components(&mask)[0].centroid_px(), [1.0, 1.0]);
    /// ```
    pub fn centroid_px(&self) -> [f64; 2] {
        let (mut twice_x, mut twice_y) = (0u64, 0u64);
        for run in &self.runs {
            let n = u64::from(run.x1 - run.x0);
            twice_x += n * u64::from(run.x0 + run.x1);
            twice_y += n * u64::from(2 * run.y + 1);
        }
        let twice_area = 2.0 * self.area as f64;
        [twice_x as f64 / twice_area, twice_y as f64 / twice_area]
    }
}

/// Returns the components of a mask, ordered by their first pixel from the top left.
///
/// Pixels that touch at a corner are connected:
/// ```
/// use flockreel_core::{geometry::Rect, raster::{Mask, runs::components}};
/// let mask = Mask { rect: Rect::of_size(3, 2), bits: vec![1, 0, 0, 0, 1, 1] };
/// let found = components(&mask);
/// assert_eq!((found.len(), found[0].area), (1, 3));
/// ```
pub fn components(mask: &Mask) -> Vec<Component> {
    let (runs, mut parents) = label(mask);
    let mut slots: Vec<Option<usize>> = vec![None; runs.len()];
    let mut found: Vec<Component> = Vec::new();
    for (idx, run) in runs.iter().enumerate() {
        let root = root_of(&mut parents, idx);
        let slot = *slots[root].get_or_insert_with(|| {
            found.push(Component {
                runs: Vec::new(),
                area: 0,
                rect: Rect::default(),
            });
            found.len() - 1
        });
        let component = &mut found[slot];
        component.runs.push(*run);
        component.area += u64::from(run.x1 - run.x0);
        let row = Rect::new(run.x0, run.y, run.x1 - run.x0, 1);
        component.rect = component.rect.union(&row);
    }
    found
}

/// Returns the runs of a mask and the parent of each in the union-find forest (a root is its own parent).
fn label(mask: &Mask) -> (Vec<Run>, Vec<usize>) {
    let mut runs: Vec<Run> = Vec::new();
    let mut parents: Vec<usize> = Vec::new();
    let mut above = 0..0;
    let rows = mask.bits.chunks_exact(mask.width().max(1));
    for (row, y) in rows.zip(mask.rect.y..) {
        let first = runs.len();
        let mut candidate = above.start;
        let mut x = 0;
        while let Some(start) = row[x..].iter().position(|&bit| bit != 0) {
            let x0 = x + start;
            let n = row[x0..].iter().take_while(|&&bit| bit != 0).count();
            let x1 = x0 + n;
            let run = Run {
                y,
                x0: mask.rect.x + x0 as u32,
                x1: mask.rect.x + x1 as u32,
            };
            let idx = runs.len();
            runs.push(run);
            parents.push(idx);
            // A run above that ends before this one cannot touch later runs of this row either.
            while candidate < above.end && runs[candidate].x1 < run.x0 {
                candidate += 1;
            }
            for other in candidate..above.end {
                if runs[other].x0 > run.x1 {
                    break;
                }
                join(&mut parents, other, idx);
            }
            x = x1;
        }
        above = first..runs.len();
    }
    (runs, parents)
}

/// Unites two runs. The smaller index becomes the root, which keeps components in image order.
fn join(parents: &mut [usize], a: usize, b: usize) {
    let (a, b) = (root_of(parents, a), root_of(parents, b));
    parents[a.max(b)] = a.min(b);
}

fn root_of(parents: &mut [usize], mut idx: usize) -> usize {
    while parents[idx] != idx {
        parents[idx] = parents[parents[idx]];
        idx = parents[idx];
    }
    idx
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    /// Flood fill, the reference for the test.
    fn flooded(mask: &Mask) -> Vec<Vec<(u32, u32)>> {
        let (w, h) = (mask.rect.w as i64, mask.rect.h as i64);
        let mut left = mask.bits.clone();
        let mut found = Vec::new();
        for start in 0..left.len() {
            if left[start] == 0 {
                continue;
            }
            left[start] = 0;
            let (mut pixels, mut open) = (Vec::new(), vec![start as i64]);
            while let Some(at) = open.pop() {
                pixels.push(((at % w) as u32 + mask.rect.x, (at / w) as u32 + mask.rect.y));
                for (dx, dy) in (-1..=1).flat_map(|dy| (-1..=1).map(move |dx| (dx, dy))) {
                    let (x, y) = (at % w + dx, at / w + dy);
                    let inside = (0..w).contains(&x) && (0..h).contains(&y);
                    if inside && left[(y * w + x) as usize] == 1 {
                        left[(y * w + x) as usize] = 0;
                        open.push(y * w + x);
                    }
                }
            }
            pixels.sort();
            found.push(pixels);
        }
        found
    }

    proptest! {
        #[test]
        fn components_equal_those_of_a_flood_fill(w in 1u32..12, h in 1u32..12, seed: u64) {
            let rect = Rect::new(3, 5, w, h);
            let bit = |k| u8::from(crate::random::bits(seed, &[k]).is_multiple_of(2));
            let mask = Mask { rect, bits: (0..rect.area()).map(bit).collect() };
            let ours: Vec<Vec<(u32, u32)>> = components(&mask).iter().map(|component| {
                prop_assert_eq!(component.area, component.mask(component.rect).area() as u64);
                let mut pixels: Vec<(u32, u32)> =
                    component.runs.iter().flat_map(|r| (r.x0..r.x1).map(|x| (x, r.y))).collect();
                pixels.sort();
                Ok(pixels)
            }).collect::<Result<_, TestCaseError>>()?;
            prop_assert_eq!(ours, flooded(&mask));
        }
    }
}
