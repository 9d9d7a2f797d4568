//! Walks both sides of an outline from head to tail. The midpoints of paired points form the midline (Walter
//! & Couzin, TRex, eLife 2021; docs/explanation/algorithms.md, "Midline and tail beat").

use super::distance;

/// Largest lead of one side in search of a nearer partner, as a share of the outline.
const MAX_LEAD: f64 = 0.025;

/// Returns the midline from `head` to `tail`, two indices of a closed outline. The points are unevenly
/// spaced.
pub(super) fn midpoints(outline: &[[f64; 2]], head: usize, tail: usize) -> Vec<[f64; 2]> {
    let n = outline.len();
    let n_after = (tail + n - head) % n;
    let n_before = n - n_after;
    let after = |k: usize| outline[(head + k.min(n_after)) % n];
    let before = |k: usize| outline[(head + n - k.min(n_before)) % n];
    let max_lead = (MAX_LEAD * n as f64).round() as usize;
    let mut midline = vec![outline[head]];
    let (mut a, mut b) = (1, 1);
    while a < n_after && b < n_before {
        // One side may run ahead by up to `max_lead` points to where it is nearest to the other.
        let ahead = (0..=max_lead)
            .map(|k| (a + k, b))
            .chain((1..=max_lead).map(|k| (a, b + k)))
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
