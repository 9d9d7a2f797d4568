//! Finds the part of the animal that never leaves its place, and so is part of the background
//! (docs/explanation/algorithms.md, "Still parts").
//!
//! Whatever never uncovers the floor under it looks like floor: the body of a fish that holds its place in a
//! current, the middle of a worm that crawls by less than its length. Two marks give it away. A *ghost outline*
//! is an edge of the background, with the animal's color inside it, where a frame has no edge. A *joint* is a
//! place where the animal of a frame goes on beyond its outline, in frame and background. The cheapest cut around
//! marks that recur is a body. It is the animal's if the animal always touches it: one animal cannot be at two
//! places.

mod body;
mod cut;
mod grid;
mod marks;
mod outline;

use self::grid::Grid;
use self::marks::Marks;
use super::background::Background;
use super::samples::Samples;
use super::survey::Survey;
use crate::raster::Mask;
use crate::raster::runs;

/// Share of the samples in which a mark must recur at its place, 0..=1. Free choice.
const RECURRENCE: f64 = 0.1;
/// Gap up to which marks belong to one cluster, cells. Free choice.
const CLUSTER_REACH: u32 = 5;
/// Largest number of clusters that are cut. Free choice: it bounds the time.
const MAX_CLUSTERS: usize = 4;
/// Least share of the samples with a body in which the animal touches it, and of their successive pairs in which it
/// does so at one place, 0..=1. Free choice.
const MIN_TOUCHING_SHARE: f64 = 0.95;
const MIN_STEADY_SHARE: f64 = 0.8;

/// A part of the animal in the background.
pub(super) struct StillPart {
    /// Its pixels, with a margin.
    pub(super) pixels: Mask,
    /// Its area, pixels.
    pub(super) area_px: f64,
    /// The samples in which it may be at its place, one bit each.
    pub(super) samples: u64,
}

/// Returns the still parts of the animal in the backgrounds.
pub(super) fn find(
    samples: &Samples,
    backgrounds: &[Background],
    background_of: &[Option<usize>],
    survey: &Survey,
) -> Vec<StillPart> {
    let grid = Grid::new(samples.size_px());
    let mut found = Vec::new();
    let Some((marks, colors)) = marks::find(samples, backgrounds, background_of, survey, &grid)
    else {
        return found;
    };
    for (at, background) in backgrounds.iter().enumerate() {
        let own: Vec<&Marks> = marks
            .iter()
            .filter(|marks| marks.background == at)
            .collect();
        let recurring = Recurring::new(&own, &grid);
        let seeds = recurring.seeds(&own, &grid);
        let mut clusters = runs::components(&seeds.dilated_by(CLUSTER_REACH));
        if clusters.is_empty() {
            continue;
        }
        clusters.sort_by_key(|cluster| std::cmp::Reverse(cluster.area));
        clusters.truncate(MAX_CLUSTERS);
        let picture = grid.shrunk(&background.rgb);
        let bodies = clusters
            .iter()
            .filter_map(|cluster| body::cut_out(&picture, cluster, &seeds, &colors));
        let parts = bodies
            .filter(|body| is_touched(body, &own, &grid))
            .map(|body| StillPart {
                area_px: body.area() as f64 * grid.cell_px.powi(2),
                samples: (own.iter().filter(|marks| marks.show_gone(&body)))
                    .fold(!0, |all, m| all & !(1 << m.sample)),
                pixels: grid.pixels(&body),
            });
        found.extend(parts);
    }
    found
}

/// How often marks recur in each cell.
struct Recurring {
    n_ghosts: Vec<u16>,
    n_joints: Vec<u16>,
    least: u16,
}

impl Recurring {
    fn new(marks: &[&Marks], grid: &Grid) -> Recurring {
        Recurring {
            n_ghosts: grid.count_near(marks.iter().map(|marks| &marks.ghosts)),
            n_joints: grid.count_near(marks.iter().map(|marks| &marks.joints)),
            least: ((RECURRENCE * marks.len() as f64).ceil() as u16).max(2),
        }
    }

    fn is_ghost(&self, cell: usize) -> bool {
        self.n_ghosts[cell] >= self.least
    }

    /// Returns the cells of the marks that recur.
    fn seeds(&self, marks: &[&Marks], grid: &Grid) -> Mask {
        let mut seeds = grid.mask();
        for marks in marks {
            let ghosts = marks.ghosts.iter().filter(|&&cell| self.is_ghost(cell));
            let joints = marks
                .joints
                .iter()
                .filter(|&&cell| self.n_joints[cell] >= self.least);
            ghosts.chain(joints).for_each(|&cell| seeds.bits[cell] = 1);
        }
        seeds
    }
}

impl Marks {
    /// Returns whether a body is gone from its place: something other than the animal shows there, the floor.
    fn show_gone(&self, body: &Mask) -> bool {
        2 * n_common(body, &self.differing) > body.area() + 2 * n_common(body, &self.animal)
    }
}

/// Returns whether the animal touches a body in nearly all samples that show it, at a place that stays or wanders
/// slowly, as the end of a worm does.
fn is_touched(body: &Mask, marks: &[&Marks], grid: &Grid) -> bool {
    let is_there = |marks: &&&Marks| 2 * n_common(body, &marks.differing) <= body.area();
    let contacts: Vec<Vec<usize>> = (marks.iter().filter(is_there))
        .map(|marks| {
            let touches = |cell: &&usize| {
                let [x, y] = grid.place(**cell);
                body.is_set(x, y) && marks.differing.bits[**cell] == 0
            };
            marks
                .around
                .iter()
                .chain(&marks.ghosts)
                .filter(touches)
                .copied()
                .collect()
        })
        .collect();
    let n_touching = contacts.iter().filter(|cells| !cells.is_empty()).count() as f64;
    let is_steady = |pair: &&[Vec<usize>]| grid.count_near(pair.iter()).contains(&2);
    let n_steady = contacts.windows(2).filter(is_steady).count() as f64;
    let n = contacts.len() as f64;
    n > 1.0 && n_touching >= MIN_TOUCHING_SHARE * n && n_steady >= MIN_STEADY_SHARE * (n - 1.0)
}

/// Returns the number of cells of a body that are set in a mask.
fn n_common(body: &Mask, mask: &Mask) -> usize {
    let mut common = Mask::new(body.rect);
    common.add(mask);
    common
        .bits
        .iter()
        .zip(&body.bits)
        .filter(|(a, b)| **a & **b == 1)
        .count()
}
