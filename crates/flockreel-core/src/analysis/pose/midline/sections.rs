//! Fallback midline for outlines whose ends cannot be found: the means of the silhouette's cross-sections
//! (docs/explanation/algorithms.md, "Midline and tail beat").

use crate::geometry::Rect;

/// Number of cross-sections. Free choice.
const N_SECTIONS: usize = 12;

/// Returns the means of the cross-sections perpendicular to `toward`, front first, in image pixels.
///
/// `toward` is a unit vector toward the head. Empty sections are omitted.
pub(super) fn section_means(rect: Rect, alpha: &[u8], toward: [f64; 2]) -> Vec<[f64; 2]> {
    let solid = || {
        let width = rect.w.max(1) as usize;
        alpha
            .iter()
            .enumerate()
            .filter(|&(_, &a)| a >= 128)
            .map(move |(k, _)| {
                [
                    f64::from(rect.x) + (k % width) as f64 + 0.5,
                    f64::from(rect.y) + (k / width) as f64 + 0.5,
                ]
            })
    };
    let ahead = |p: [f64; 2]| p[0] * toward[0] + p[1] * toward[1];
    let (back, front) = solid().map(ahead).fold(
        (f64::INFINITY, f64::NEG_INFINITY),
        |(least, most), along| (least.min(along), most.max(along)),
    );
    let step = (front - back) / N_SECTIONS as f64;
    let mut sums = [([0.0; 2], 0.0); N_SECTIONS];
    for point in solid() {
        let section = ((front - ahead(point)) / step.max(1e-9)) as usize;
        let (sum, n) = &mut sums[section.min(N_SECTIONS - 1)];
        *sum = [sum[0] + point[0], sum[1] + point[1]];
        *n += 1.0;
    }
    sums.iter()
        .filter(|(_, n)| *n > 0.0)
        .map(|(sum, n)| sum.map(|s| s / n))
        .collect()
}
