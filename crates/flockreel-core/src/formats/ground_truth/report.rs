//! report.json: where a tracker will find a flock hard. It lists crossings, hidden spans and nearest distances
//! (docs/reference/formats.md, "Ground truth").

use std::collections::BTreeMap;

use serde::Serialize;

use crate::flock::composite::truth::Seen;
use crate::geometry::rounded;

/// The report of the frames seen so far. Frames come in order.
#[derive(Debug, Default)]
pub struct Report {
    individuals: Vec<One>,
    /// First frame of each overlap that goes on, by the ids of the pair.
    open: BTreeMap<[u32; 2], usize>,
    crossings: Vec<Crossing>,
}

/// Two animals whose silhouettes overlap in the picture, covered or not.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
struct Crossing {
    /// Ids of flock.json, the smaller first.
    ids: [u32; 2],
    /// Frame range [a, b) of the overlap.
    frames: [usize; 2],
}

#[derive(Clone, Debug, Default, Serialize)]
struct One {
    id: u32,
    /// Frame ranges [a, b) in which no pixel shows the animal.
    hidden: Vec<[usize; 2]>,
    /// Smallest distance between its centroid and that of another animal.
    nearest_px: Option<f64>,
    /// Id of that animal, and the first frame in which it is so near.
    nearest_id: Option<u32>,
    nearest_frame: Option<usize>,
}

impl Report {
    /// Adds a frame with the truth of each individual, by id. `frame_idx` is its number in the film.
    pub fn add(&mut self, frame_idx: usize, seen: &[Seen]) {
        if self.individuals.is_empty() {
            let of = |id| One {
                id,
                ..One::default()
            };
            self.individuals = (0..seen.len() as u32).map(of).collect();
        }
        for (one, seen) in self.individuals.iter_mut().zip(seen) {
            one.see(frame_idx, seen);
        }
        self.measure(frame_idx, seen);
        self.cross(frame_idx, seen);
    }

    /// Updates the nearest distances.
    fn measure(&mut self, frame_idx: usize, seen: &[Seen]) {
        let mut order: Vec<(usize, [f64; 2])> =
            (seen.iter().map(|seen| seen.centroid_px).enumerate()).collect();
        order.sort_by(|(_, a), (_, b)| a[0].total_cmp(&b[0]));
        for (k, &(id, [x, y])) in order.iter().enumerate() {
            let one = &mut self.individuals[id];
            // Those farther away along x alone need no look.
            for &(other, [other_x, other_y]) in &order[k + 1..] {
                if one.nearest_px.is_some_and(|px| other_x - x > px) {
                    break;
                }
                one.near(frame_idx, other, libm::hypot(other_x - x, other_y - y));
            }
            for &(other, [other_x, other_y]) in order[..k].iter().rev() {
                if one.nearest_px.is_some_and(|px| x - other_x > px) {
                    break;
                }
                one.near(frame_idx, other, libm::hypot(other_x - x, other_y - y));
            }
        }
    }

    /// Updates the overlaps.
    fn cross(&mut self, frame_idx: usize, seen: &[Seen]) {
        let mut boxed: Vec<(u32, &Seen)> = (0u32..).zip(seen).collect();
        boxed.sort_by_key(|(_, seen)| seen.silhouette.rect.x);
        let mut before = std::mem::take(&mut self.open);
        for (k, (id, seen)) in boxed.iter().enumerate() {
            let within = boxed[k + 1..]
                .iter()
                .take_while(|(_, other)| other.silhouette.rect.x < seen.silhouette.rect.right());
            for (other, _) in within.filter(|(_, other)| overlap(seen, other)) {
                let pair = [*id.min(other), *id.max(other)];
                let from = before.remove(&pair).unwrap_or(frame_idx);
                self.open.insert(pair, from);
            }
        }
        let ended = before.into_iter().map(|(ids, from)| Crossing {
            ids,
            frames: [from, frame_idx],
        });
        self.crossings.extend(ended);
    }

    /// Returns the file. `end` is the number after the last frame, and `length_px` a body length in the film.
    pub fn json(mut self, end: usize, length_px: f64) -> String {
        self.crossings
            .extend(self.open.iter().map(|(&ids, &from)| Crossing {
                ids,
                frames: [from, end],
            }));
        self.crossings.sort_by_key(|one| (one.frames, one.ids));
        let n_hidden: usize = self.individuals.iter().map(|one| one.hidden.len()).sum();
        for one in &mut self.individuals {
            one.nearest_px = one.nearest_px.map(|px| rounded(px, 2));
        }
        let report = serde_json::json!({
            "schema": "flockreel/report@1",
            "version": env!("CARGO_PKG_VERSION"),
            "frames": end,
            "length_px": rounded(length_px, 3),
            "n_crossings": self.crossings.len(),
            "n_hidden_spans": n_hidden,
            "crossings": self.crossings,
            "individuals": self.individuals,
        });
        report.to_string() + "\n"
    }
}

impl One {
    fn see(&mut self, frame_idx: usize, seen: &Seen) {
        if seen.visible_area > 0 {
            return;
        }
        match self.hidden.last_mut() {
            Some(span) if span[1] == frame_idx => span[1] += 1,
            _ => self.hidden.push([frame_idx, frame_idx + 1]),
        }
    }

    fn near(&mut self, frame_idx: usize, other: usize, distance_px: f64) {
        if self.nearest_px.is_none_or(|px| distance_px < px) {
            self.nearest_px = Some(distance_px);
            self.nearest_id = Some(other as u32);
            self.nearest_frame = Some(frame_idx);
        }
    }
}

/// Returns whether two silhouettes have a pixel in common.
fn overlap(a: &Seen, b: &Seen) -> bool {
    let (a, b) = (&a.silhouette, &b.silhouette);
    let (left, top) = (a.rect.x.max(b.rect.x), a.rect.y.max(b.rect.y));
    let right = a.rect.right().min(b.rect.right());
    let bottom = a.rect.bottom().min(b.rect.bottom());
    (top..bottom).any(|y| (left..right).any(|x| a.is_set(x, y) && b.is_set(x, y)))
}
