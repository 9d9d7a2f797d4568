//! distance.png and candidates.png: pictures of the distances between clips, from one pass over the distances
//! (Okabe et al., figures 2 and 3).
//!
//! distance.png shows D from near (black) to far (white): gray levels are round(255 D / largest drawn D). The
//! exact numbers are in distance.npy. With more than 8192 clips, distances of at least 4 epsilon are white;
//! they are not computed, to save time.
//!
//! The picture candidates.png shows the pairs with D < epsilon faintly and the transitions over them.
//! Mirrored ones have another color. Both pictures have at most 1024 x 1024 cells. For longer footage a cell
//! shows the minimum of its pairs, so that a single similar pair stays visible.

use super::picture;
use crate::analysis::similarity::distance::{AllPairs, Cancelled, ClipPair, Distances};
use crate::library::{Library, Sprites};
use crate::progress::Progress;

/// Maximum number of rows and columns.
pub const MAX_SIDE: usize = 1024;

/// Number of cells per side from which a transition is drawn as 3 x 3 cells instead of one.
const MIN_SIDE_OF_LARGE_MARKS: usize = 256;

/// Number of clips above which only distances below `WHITE_EPSILONS` epsilon are computed.
const MAX_COMPLETE_CLIPS: usize = 8192;
const WHITE_EPSILONS: u64 = 4;
/// Marks a distance that was not computed.
const UNKNOWN: u64 = u64::MAX;

const BACKGROUND: [u8; 3] = [0xfd, 0xfc, 0xf9];
/// A pair with D < epsilon.
const SIMILAR_PAIR: [u8; 3] = [0xc2, 0xc6, 0xbf];
/// A transition.
const TRANSITION: [u8; 3] = [0xc8, 0x3c, 0x08];
/// A transition to the mirror image.
const MIRRORED_TRANSITION: [u8; 3] = [0x12, 0x5c, 0x96];

/// The distances, pooled to the size of the pictures.
pub struct DistanceMap {
    side: usize,
    n_clips: usize,
    /// Minimum D of each cell's pairs, row by row, symmetric.
    min_distance: Vec<u64>,
    /// Whether a cell has a pair with D < epsilon and all sprites present, row by row, symmetric.
    has_similar_pair: Vec<bool>,
}

impl DistanceMap {
    /// Computes the distances and pools D(i, j) into cell (i side / n, j side / n). Divisions are rounded
    /// down, and `side` is min(n, 1024).
    pub fn compute(
        distances: &Distances<'_>,
        library: &Library,
        progress: &dyn Progress,
    ) -> Result<DistanceMap, Cancelled> {
        let present = complete_clips(&library.sprites, library.clip_frames);
        let mut map = DistanceMap::empty(distances.n_clips());
        let mut pool = |pair: ClipPair| map.pool(pair, &present, library.epsilon);
        if distances.n_clips() > MAX_COMPLETE_CLIPS {
            let limit = library.epsilon.saturating_mul(WHITE_EPSILONS);
            let near = |_: usize, pairs: &[ClipPair]| pairs.iter().copied().for_each(&mut pool);
            distances.for_each_row_below(limit, &AllPairs, progress, near)?
        } else {
            distances.for_each_row(progress, |from, row| {
                let pair = |(to, &distance)| ClipPair { from, to, distance };
                (from..).zip(row).map(pair).for_each(&mut pool);
            })?
        }
        map.mirror_triangle();
        Ok(map)
    }

    /// Returns distance.png. Footage shorter than a clip gives a single white pixel.
    pub fn draw_distances(&self) -> Vec<u8> {
        let side = self.side as u32;
        match side {
            0 => picture::write_gray(1, 1, &[255]),
            _ => picture::write_gray(side, side, &gray_levels(&self.min_distance)),
        }
    }

    /// Returns candidates.png with the library's transitions. Footage shorter than a clip gives a single
    /// pixel.
    pub fn draw_candidates(&self, library: &Library) -> Vec<u8> {
        let side = self.side.max(1);
        let mut pixels = vec![BACKGROUND; side * side];
        for (pixel, _) in pixels
            .iter_mut()
            .zip(&self.has_similar_pair)
            .filter(|cell| *cell.1)
        {
            *pixel = SIMILAR_PAIR;
        }
        // Transitions without mirroring are drawn last and stay visible where both overlap.
        for mirrored in [true, false] {
            let color = if mirrored {
                MIRRORED_TRANSITION
            } else {
                TRANSITION
            };
            for transition in library
                .transitions
                .iter()
                .filter(|t| t.mirrored == mirrored)
            {
                let pair = [transition.from, transition.to].map(|clip| clip as usize);
                self.mark(&mut pixels, pair, color);
            }
        }
        let image = crate::raster::RgbImage {
            width: side as u32,
            height: side as u32,
            pixels: pixels.concat(),
        };
        picture::write_rgb(&image)
    }

    fn empty(n_clips: usize) -> DistanceMap {
        let side = n_clips.min(MAX_SIDE);
        DistanceMap {
            side,
            n_clips,
            min_distance: vec![UNKNOWN; side * side],
            has_similar_pair: vec![false; side * side],
        }
    }

    fn pool(&mut self, pair: ClipPair, present: &[bool], epsilon: u64) {
        let at = self.cell_of(pair.from) * self.side + self.cell_of(pair.to);
        self.min_distance[at] = pair.distance.min(self.min_distance[at]);
        self.has_similar_pair[at] |=
            pair.distance < epsilon && present[pair.from] && present[pair.to];
    }

    fn mirror_triangle(&mut self) {
        for row in 0..self.side {
            for column in 0..row {
                let (to, from) = (row * self.side + column, column * self.side + row);
                self.min_distance[to] = self.min_distance[from];
                self.has_similar_pair[to] = self.has_similar_pair[from];
            }
        }
    }

    fn cell_of(&self, clip_idx: usize) -> usize {
        clip_idx * self.side / self.n_clips
    }

    /// Marks a pair on both sides of the diagonal.
    fn mark(&self, pixels: &mut [[u8; 3]], [from, to]: [usize; 2], color: [u8; 3]) {
        if from.max(to) >= self.n_clips {
            return;
        }
        let reach = usize::from(self.side >= MIN_SIDE_OF_LARGE_MARKS);
        let around = |clip_idx: usize| {
            let cell = self.cell_of(clip_idx);
            cell.saturating_sub(reach)..(cell + reach + 1).min(self.side)
        };
        for row in around(from) {
            for column in around(to) {
                pixels[row * self.side + column] = color;
                pixels[column * self.side + row] = color;
            }
        }
    }
}

/// Returns which clips have all their sprites. Frames without the animal are similar but show nothing.
fn complete_clips(sprites: &Sprites, clip_frames: usize) -> Vec<bool> {
    let present: Vec<bool> = (0..sprites.n_frames())
        .map(|frame_idx| sprites.is_present(frame_idx))
        .collect();
    let clips = present.windows(clip_frames.max(1));
    clips.map(|clip| clip.iter().all(|&frame| frame)).collect()
}

fn gray_levels(cells: &[u64]) -> Vec<u8> {
    let drawn = cells.iter().copied().filter(|&d| d != UNKNOWN);
    let largest = drawn.max().unwrap_or(0).max(1);
    let level = |&distance: &u64| match distance {
        UNKNOWN => 255,
        _ => (255.0 * distance as f64 / largest as f64).round() as u8,
    };
    cells.iter().map(level).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::Arc;

    use crate::analysis::Params;
    use crate::analysis::params::Planes;
    use crate::analysis::similarity::distance::{ComparedSprites, Side};
    use crate::cpu::Level;
    use crate::flock::synthetic;
    use crate::library::{Transition, View};
    use crate::progress::Silent;
    use crate::scratch::{Full, InMemory};

    #[test]
    fn small_distances_are_black_and_large_ones_white() {
        assert_eq!(gray_levels(&[0, 50, 200, 100]), [0, 64, 255, 128]);
        assert_eq!(gray_levels(&[0, 0]), [0, 0]);
        assert_eq!(gray_levels(&[0, UNKNOWN, 10]), [0, 255, 255]);
    }

    /// Returns a map of `n_clips` clips, all distant except the given pairs.
    fn map(n_clips: usize, near: &[(usize, usize)], present: &[bool]) -> DistanceMap {
        let mut map = DistanceMap::empty(n_clips);
        for i in 0..n_clips {
            let distance = |j| if near.contains(&(i, j)) { 5 } else { 10 };
            let row: Vec<u64> = (i..n_clips).map(distance).collect();
            for (to, distance) in (i..).zip(row) {
                let pair = ClipPair {
                    from: i,
                    to,
                    distance,
                };
                map.pool(pair, present, 10);
            }
        }
        map.mirror_triangle();
        map
    }

    fn transition(from: u32, to: u32, mirrored: bool) -> Transition {
        Transition {
            from,
            to,
            mirrored,
            distance: 5,
            heading_gap_rad: 0.0,
        }
    }

    fn colors(map: &DistanceMap, transitions: Vec<Transition>) -> Vec<[u8; 3]> {
        let mut library = synthetic::library(View::Side);
        library.transitions = transitions;
        let image =
            picture::read_rgb(&map.draw_candidates(&library), [1024; 2]).expect("our own PNG");
        let pixels = image.pixels.chunks_exact(3);
        pixels.map(|rgb| [rgb[0], rgb[1], rgb[2]]).collect()
    }

    #[test]
    fn transitions_are_drawn_over_similar_pairs() {
        let map = map(4, &[(0, 2), (1, 3)], &[true; 4]);
        let pixels = colors(&map, vec![transition(0, 2, false), transition(0, 3, true)]);
        let (p, a, k, m) = (BACKGROUND, SIMILAR_PAIR, TRANSITION, MIRRORED_TRANSITION);
        assert_eq!(
            pixels,
            [p, p, k, m, p, p, p, a, k, p, p, p, m, a, p, p],
            "symmetric"
        );
    }

    #[test]
    fn single_similar_pair_of_long_footage_stays_visible() {
        let map = map(3000, &[(700, 2999)], &[true; 3000]);
        assert_eq!(
            (
                map.side,
                map.has_similar_pair.iter().filter(|&&cell| cell).count()
            ),
            (1024, 2)
        );
        assert!(map.has_similar_pair[(700 * 1024 / 3000) * 1024 + 1023]);
        assert_eq!(
            map.min_distance
                .iter()
                .filter(|&&min_distance| min_distance == 5)
                .count(),
            2
        );
    }

    #[test]
    fn above_the_limit_only_near_clips_are_compared() {
        // Dark in the first half, bright in the second.
        let n = MAX_COMPLETE_CLIPS + 8;
        let mut library = synthetic::library(View::Side);
        let scratch = Arc::new(InMemory::default());
        let draw = |frame_idx: usize, rgba: &mut [u8]| {
            let red = if frame_idx < n / 2 { 10 } else { 200 };
            rgba.copy_from_slice(&[red + (frame_idx % 2) as u8, 0, 0, 255]);
            Ok::<_, Full>(true)
        };
        library.sprites = Sprites::drawn([1, 1], n, scratch, draw).expect("memory has room");
        library.poses.frames.resize(n, Default::default());
        (library.clip_frames, library.epsilon) = (1, 2);
        let pixels = ComparedSprites::new(&library.sprites, &library.poses, Planes::Rgba);
        let distances = Distances {
            pixels: &pixels.expect("memory has room"),
            clip: Params::default().clip(1),
            side: Side::Plain,
            cpu: Level::detect(),
        };
        let map = DistanceMap::compute(&distances, &library, &Silent).expect("nobody cancels");
        assert_eq!((map.min_distance[0], map.min_distance[1023]), (0, UNKNOWN));
        assert_eq!(gray_levels(&map.min_distance)[1023], 255);
    }

    #[test]
    fn frames_without_the_animal_are_not_similar() {
        let map = map(4, &[(0, 2), (1, 3)], &[true, true, true, false]);
        assert_eq!(map.has_similar_pair.iter().filter(|&&cell| cell).count(), 2);
    }

    #[test]
    fn drawn_pairs_are_those_below_epsilon() {
        let mut library = synthetic::library(View::Side);
        library.transitions.clear();
        let pixels = ComparedSprites::new(&library.sprites, &library.poses, Planes::Rgba);
        let pixels = pixels.expect("memory has room");
        let distances = Distances {
            pixels: &pixels,
            clip: crate::analysis::Params::default().clip(library.clip_frames),
            side: Side::Plain,
            cpu: Level::detect(),
        };
        let mut all = Vec::new();
        let collect = |_: usize, row: &[u64]| all.extend_from_slice(&row[1..]);
        distances
            .for_each_row(&Silent, collect)
            .expect("nobody cancels");
        all.sort_unstable();
        library.epsilon = all[all.len() / 50];
        let n_below = all.iter().filter(|&&d| d < library.epsilon).count();
        let map = DistanceMap::compute(&distances, &library, &Silent).expect("nobody cancels");
        let drawn = map.has_similar_pair.iter().filter(|&&cell| cell).count();
        assert_eq!(drawn, 2 * n_below + distances.n_clips());
    }
}
