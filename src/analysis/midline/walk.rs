//! Both sides of an outline walked from head to tail; the middles of the points that face each other
//! are the midline (ALGORITHMS.md 4; Walter & Couzin, TRex, eLife 2021).

use super::distance;

/// How far ahead a side may be looked at for a nearer partner, of the outline.
const WIGGLE: f64 = 0.025;

/// The midline from `head` to `tail`, indices of a closed outline; unevenly spaced.
pub(super) fn walk(outline: &[[f64; 2]], head: usize, tail: usize) -> Vec<[f64; 2]> {
    let n = outline.len();
    let n_after = (tail + n - head) % n;
    let n_before = n - n_after;
    let after = |k: usize| outline[(head + k.min(n_after)) % n];
    let before = |k: usize| outline[(head + n - k.min(n_before)) % n];
    let wiggle = (WIGGLE * n as f64).round() as usize;
    let mut midline = vec![outline[head]];
    let (mut a, mut b) = (1, 1);
    while a < n_after && b < n_before {
        // One side may run ahead by the wiggle to where it is nearest to the other.
        let ahead = (0..=wiggle)
            .map(|k| (a + k, b))
            .chain((1..=wiggle).map(|k| (a, b + k)))
            .filter(|&(a, b)| a < n_after && b < n_before);
        let nearest = ahead.fold((f64::INFINITY, (a, b)), |best, (a, b)| {
            let apart = distance(after(a), before(b));
            if apart < best.0 {
                (apart, (a, b))
            } else {
                best
            }
        });
        (a, b) = nearest.1;
        let (p, q) = (after(a), before(b));
        midline.push([0, 1].map(|c| (p[c] + q[c]) / 2.0));
        (a, b) = (a + 1, b + 1);
    }
    midline.push(outline[tail]);
    midline
}
