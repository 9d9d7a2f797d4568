//! Ground truth of a frame: how much of each individual is visible, and where.
//!
//! The compositor computes it from the alpha with which it draws: visible_i = alpha_i times the product of
//! (1 - alpha_k) over all nearer individuals k and the occluders
//! (docs/explanation/algorithms.md, "Compositing").
//!
//! All shares are integers, in 16384ths. The shares of occluders, individuals and background add up to
//! exactly one in every pixel.

use super::keypoints::{KeypointSource, N_KEYPOINTS, Points};
use crate::geometry::Rect;
use crate::raster::Mask;

/// Alpha 1, or a whole pixel, in 16384ths.
pub(super) const ONE: u32 = 1 << 14;
/// Least visible share of a pixel for which an individual gets the label of the pixel.
const HALF: u32 = ONE / 2;

/// Ground truth of one frame, in pixels of the film.
#[derive(Clone, Debug, PartialEq, Default)]
pub struct FrameTruth {
    /// Width and height of the film, in pixels.
    pub size_px: [u32; 2],
    /// Label of each pixel, by rows: id + 1 of the individual that makes up at least half of the pixel, or
    /// 0.
    pub labels: Vec<u16>,
    /// Visibility of each individual, by id.
    pub seen: Vec<Seen>,
    /// Share of the light that visible shadows remove from each pixel, 0..=255, by rows. Empty if the film
    /// has no shadows.
    pub shadow: Vec<u8>,
}

/// Visibility of one individual in one frame.
#[derive(Clone, Debug, PartialEq, Default)]
pub struct Seen {
    /// Position of the centroid in the film.
    pub centroid_px: [f64; 2],
    /// Scale of the sprite: film pixels per footage pixel.
    pub scale: f64,
    /// Tightest box around the pixels with its label; `None` if there are none.
    pub visible_box: Option<Rect>,
    /// Number of pixels with its label.
    pub visible_area: u32,
    /// Mask of the pixels where its own alpha is at least one half, covered or not. Clipped to the picture.
    pub silhouette: Mask,
    /// Tightest box around all pixels where its own alpha is at least one half, covered or not:
    /// `[x, y, width, height]`. It may extend beyond the picture. `None` if there are no such pixels.
    pub amodal_box: Option<[i64; 4]>,
    /// Number of these pixels, including those beyond the picture.
    pub amodal_area: u32,
    /// Share of its total alpha that lies in the picture and is not covered, 0..=1.
    pub visibility: f64,
    /// Number of individuals that are nearer to the camera, in or out of the picture.
    pub depth_rank: u32,
    /// Source of the points from head to tail.
    pub keypoint_source: KeypointSource,
    /// Keypoints (`keypoints::NAMES`); `None` if one was not measured.
    pub keypoints: [Option<Keypoint>; N_KEYPOINTS],
}

/// A point of an animal's body in the film.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Keypoint {
    /// Position, which may lie beyond the picture.
    pub px: [f64; 2],
    /// Whether the point lies in the picture, and nearer animals and occluders leave at least half of its pixel.
    pub is_visible: bool,
}

/// Alpha with which an individual was drawn, in 16384ths, over a box.
#[derive(Clone, Debug, Default)]
pub(super) struct Drawn {
    pub(super) id: u32,
    pub(super) centroid_px: [f64; 2],
    pub(super) scale: f64,
    pub(super) rect: Rect,
    pub(super) alpha: Vec<u16>,
    /// Extent without clipping; `None` if the sprite lies inside the picture.
    pub(super) whole: Option<FullExtent>,
    pub(super) keypoint_source: KeypointSource,
    pub(super) keypoints: Points,
}

/// Extent of an individual without clipping at the picture's border.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct FullExtent {
    amodal_box: Option<[i64; 4]>,
    amodal_area: u32,
    alpha_sum: u64,
}

impl FrameTruth {
    /// Returns the ground truth of a frame.
    ///
    /// `drawn` lists the individuals from near to far; their ids are 0..n, each once. `shade` is the alpha
    /// of the shadows below them, and `left` the share of each pixel that the occluders leave. Both are in
    /// 16384ths.
    pub(super) fn new(
        drawn: &[Drawn],
        shade: Option<&[u16]>,
        size_px: [u32; 2],
        mut left: Vec<u16>,
    ) -> FrameTruth {
        let n_pixels = size_px[0] as usize * size_px[1] as usize;
        let mut truth = FrameTruth {
            size_px,
            labels: vec![0; n_pixels],
            seen: vec![Seen::default(); drawn.len()],
            shadow: Vec::new(),
        };
        // Each individual takes its visible share from `left`; farther individuals get the rest.
        for (depth_rank, drawn) in (0..).zip(drawn) {
            truth.seen[drawn.id as usize] = Seen {
                depth_rank,
                ..truth.add(drawn, &mut left)
            };
        }
        let visible = |(&shade, &left): (&u16, &u16)| {
            ((u32::from(shade) * u32::from(left) / ONE * 255 + HALF) / ONE) as u8
        };
        let shaded = shade.map(|shade| shade.iter().zip(&left).map(visible).collect());
        truth.shadow = shaded.unwrap_or_default();
        truth
    }

    /// Returns the keypoints of an individual. `left` is the share of each pixel that nearer ones leave.
    fn keypoints(&self, points: Points, left: &[u16]) -> [Option<Keypoint>; N_KEYPOINTS] {
        let [width, height] = self.size_px.map(f64::from);
        let is_visible = |[x, y]: [f64; 2]| {
            (0.0..width).contains(&x)
                && (0.0..height).contains(&y)
                && u32::from(left[y as usize * self.size_px[0] as usize + x as usize]) >= HALF
        };
        points.map(|point| {
            point.map(|px| Keypoint {
                px,
                is_visible: is_visible(px),
            })
        })
    }

    /// Returns the depth order of each pixel, by rows: `depth_rank` + 1 of the individual that has its label, or 0.
    pub fn depth_order(&self) -> Vec<u16> {
        let rank = |label: &u16| match label.checked_sub(1) {
            Some(id) => self.seen[usize::from(id)].depth_rank as u16 + 1,
            None => 0,
        };
        self.labels.iter().map(rank).collect()
    }

    /// Labels the pixels of an individual, and takes its visible share from `left`.
    fn add(&mut self, drawn: &Drawn, left: &mut [u16]) -> Seen {
        let rect = drawn.rect;
        let keypoints = self.keypoints(drawn.keypoints, left);
        let mut extent = Extent::default();
        let (mut visible_sum, mut visible_area) = (0, 0);
        let rows = drawn.alpha.chunks_exact(rect.w.max(1) as usize);
        for (row, y) in rows.zip(rect.y..) {
            let at = y as usize * self.size_px[0] as usize + rect.x as usize;
            let labels = &mut self.labels[at..at + row.len()];
            let left = &mut left[at..at + row.len()];
            for (k, &alpha) in row.iter().enumerate().filter(|(_, alpha)| **alpha > 0) {
                let visible = (u32::from(alpha) * u32::from(left[k]) + HALF) / ONE;
                left[k] -= visible as u16;
                visible_sum += u64::from(visible);
                // If two individuals have exactly half a pixel each, the nearer one gets the label.
                if visible >= HALF && labels[k] == 0 {
                    labels[k] = drawn.id as u16 + 1;
                    extent.add(i64::from(rect.x) + k as i64, i64::from(y));
                    visible_area += 1;
                }
            }
        }
        let whole = drawn
            .whole
            .unwrap_or_else(|| FullExtent::new(&drawn.alpha, rect, [0, 0]));
        Seen {
            centroid_px: drawn.centroid_px,
            scale: drawn.scale,
            visible_box: extent.edges.map(|[x, y, right, bottom]| {
                Rect::clipped(x, y, right, bottom, u32::MAX, u32::MAX)
            }),
            visible_area,
            silhouette: Mask {
                rect,
                bits: drawn
                    .alpha
                    .iter()
                    .map(|&a| u8::from(u32::from(a) >= HALF))
                    .collect(),
            },
            amodal_box: whole.amodal_box,
            amodal_area: whole.amodal_area,
            depth_rank: 0,
            visibility: visible_sum as f64 / whole.alpha_sum.max(1) as f64,
            keypoint_source: drawn.keypoint_source,
            keypoints,
        }
    }
}

impl FullExtent {
    /// Returns the extent of the alpha over a box. The true position of the box is `rect` moved by minus
    /// `shift`.
    pub(super) fn new(alpha: &[u16], rect: Rect, shift: [i64; 2]) -> FullExtent {
        let mut extent = Extent::default();
        let (mut amodal_area, mut alpha_sum) = (0, 0);
        for (row, y) in alpha
            .chunks_exact(rect.w.max(1) as usize)
            .zip(i64::from(rect.y)..)
        {
            for (&alpha, x) in row.iter().zip(i64::from(rect.x)..) {
                alpha_sum += u64::from(alpha);
                if u32::from(alpha) >= HALF {
                    extent.add(x - shift[0], y - shift[1]);
                    amodal_area += 1;
                }
            }
        }
        FullExtent {
            amodal_box: extent
                .edges
                .map(|[x, y, right, bottom]| [x, y, right - x, bottom - y]),
            amodal_area,
            alpha_sum,
        }
    }
}

/// Tightest box around some pixels: left, top, right, bottom. Right and bottom are exclusive.
#[derive(Default)]
struct Extent {
    edges: Option<[i64; 4]>,
}

impl Extent {
    fn add(&mut self, x: i64, y: i64) {
        let [left, top, right, bottom] = self.edges.unwrap_or([x, y, x + 1, y + 1]);
        self.edges = Some([left.min(x), top.min(y), right.max(x + 1), bottom.max(y + 1)]);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn layer(id: u32, rect: Rect, alpha: u16) -> Drawn {
        Drawn {
            id,
            rect,
            alpha: vec![alpha; rect.area() as usize],
            ..Drawn::default()
        }
    }

    fn clear(n_pixels: usize) -> Vec<u16> {
        vec![ONE as u16; n_pixels]
    }

    fn rect(x: u32, y: u32, w: u32, h: u32) -> Rect {
        Rect { x, y, w, h }
    }

    #[test]
    fn nearer_individuals_hide_farther_ones_by_their_alpha() {
        let far = layer(1, rect(0, 0, 4, 2), ONE as u16);
        let near = layer(0, rect(2, 0, 4, 2), 3 * ONE as u16 / 4);
        let truth = FrameTruth::new(&[near, far], None, [8, 2], clear(16));
        assert_eq!(truth.labels[..8], [2, 2, 1, 1, 1, 1, 0, 0]);
        // Half of the far one is covered by three quarters.
        assert!((truth.seen[1].visibility - 0.625).abs() < 1e-4);
        assert_eq!(truth.seen[0].visibility, 1.0);
        assert_eq!(truth.seen[1].visible_box, Some(rect(0, 0, 2, 2)));
        assert_eq!(truth.seen[1].amodal_box, Some([0, 0, 4, 2]));
        assert_eq!(truth.depth_order()[..8], [2, 2, 1, 1, 1, 1, 0, 0]);
        assert_eq!(
            (truth.seen[1].visible_area, truth.seen[1].amodal_area),
            (4, 8)
        );
    }

    #[test]
    fn pixel_shared_equally_belongs_to_the_nearer() {
        let box_px = rect(0, 0, 1, 1);
        let far = layer(0, box_px, ONE as u16);
        let near = layer(1, box_px, HALF as u16);
        assert_eq!(
            FrameTruth::new(&[near, far], None, [1, 1], clear(1)).labels,
            [2]
        );
    }

    #[test]
    fn hidden_individual_has_no_label_but_an_extent() {
        let far = layer(0, rect(1, 0, 2, 1), ONE as u16);
        let near = layer(1, rect(0, 0, 4, 1), ONE as u16);
        let hidden = &FrameTruth::new(&[near, far], None, [4, 1], clear(4)).seen[0];
        assert_eq!((hidden.visible_box, hidden.visible_area), (None, 0));
        assert_eq!(
            (hidden.amodal_box, hidden.visibility),
            (Some([1, 0, 2, 1]), 0.0)
        );
    }

    #[test]
    fn occluder_has_no_label_and_reduces_visibility() {
        let bird = layer(0, rect(0, 0, 4, 1), ONE as u16);
        let left = vec![ONE as u16, 0, ONE as u16 / 4, 3 * ONE as u16 / 4];
        let truth = FrameTruth::new(&[bird], None, [4, 1], left);
        assert_eq!(truth.labels, [1, 0, 0, 1]);
        let seen = &truth.seen[0];
        assert_eq!((seen.visible_area, seen.amodal_area), (2, 4));
        assert_eq!(
            (seen.visibility, seen.visible_box),
            (0.5, Some(rect(0, 0, 4, 1)))
        );
    }

    proptest! {
        /// Each pixel has the label of the individual that makes up half of it. No visibility exceeds 1,
        /// and each box is tight around its label.
        #[test]
        fn labels_are_those_of_the_formula(
            layers in prop::collection::vec((0u32..6, 0u32..6, 1u32..5, 1u32..5, 0u16..=ONE as u16), 1..7),
        ) {
            let drawn: Vec<Drawn> = (0u32..)
                .zip(&layers)
                .map(|(id, &(x, y, w, h, alpha))| layer(id, rect(x, y, w, h), alpha))
                .collect();
            let truth = FrameTruth::new(&drawn, None, [12, 12], clear(144));
            for at in 0..144u32 {
                let (x, y) = (at % 12, at / 12);
                let mut through = 1.0;
                let mut label = 0;
                for layer in drawn.iter().filter(|layer| layer.rect.contains(x, y)) {
                    let alpha = f64::from(layer.alpha[0]) / f64::from(ONE);
                    // Rounding decides the ties.
                    if (alpha * through - 0.5f64).abs() < 1e-3 {
                        label = truth.labels[at as usize];
                    } else if alpha * through > 0.5 {
                        label = layer.id as u16 + 1;
                    }
                    through *= 1.0 - alpha;
                }
                prop_assert_eq!(truth.labels[at as usize], label);
            }
            for (id, seen) in truth.seen.iter().enumerate() {
                let own: Vec<(u32, u32)> = (0..144)
                    .filter(|&at| truth.labels[at as usize] == id as u16 + 1)
                    .map(|at| (at % 12, at / 12))
                    .collect();
                prop_assert_eq!(own.len(), seen.visible_area as usize);
                let tight = own.iter().fold(None, |tight: Option<Rect>, &(x, y)| {
                    let pixel = rect(x, y, 1, 1);
                    Some(tight.map_or(pixel, |tight| tight.union(&pixel)))
                });
                prop_assert_eq!(tight, seen.visible_box);
                prop_assert!((0.0..=1.0 + 1e-9).contains(&seen.visibility));
            }
        }
    }
}
