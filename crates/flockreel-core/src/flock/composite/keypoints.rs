//! Keypoints of the animals: head, midline, tail and centroid of each source frame, carried to the film through
//! mirroring, rotation and scale (docs/explanation/algorithms.md, "Compositing").
//!
//! A frame with a measured midline has all points. A frame without one has the two ends of the body, which
//! are read from its matte. Within a fade, the points are those of the main sprite, which has the larger weight.

use std::collections::BTreeMap;

use crate::flock::Flock;
use crate::geometry::wrap_rad;
use crate::library::{Library, Pose};
use crate::raster::resample::Placement;

/// Number of points from head to tail: those of a midline in poses.json.
const N_ALONG: usize = 11;
/// Number of keypoints: the points from head to tail, and the centroid.
pub const N_KEYPOINTS: usize = N_ALONG + 1;
/// Names of the keypoints, in order.
pub const NAMES: [&str; N_KEYPOINTS] = [
    "head",
    "midline_1",
    "midline_2",
    "midline_3",
    "midline_4",
    "midline_5",
    "midline_6",
    "midline_7",
    "midline_8",
    "midline_9",
    "tail",
    "centroid",
];
/// Least alpha of a pixel of the body when its ends are searched: one half.
const HALF_ALPHA: u8 = 128;
/// Length of the piece of the body whose middle is its end, as a share of the body's length. Free choice: a
/// shorter piece follows single pixels of the outline, a longer one ignores a bent tail.
const END_SHARE: f64 = 0.1;

/// Points in order, each `None` if it was not measured.
pub type Points = [Option<[f64; 2]>; N_KEYPOINTS];

/// Source of the points from head to tail in a frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub enum KeypointSource {
    /// The measured midline.
    Midline,
    /// The two ends of the silhouette along the heading. The points between them are not measured.
    BodyEnds,
    /// Nothing: only the centroid is known.
    #[default]
    Nothing,
}

impl KeypointSource {
    /// Returns the name in files.
    pub fn name(self) -> &'static str {
        match self {
            KeypointSource::Midline => "midline",
            KeypointSource::BodyEnds => "body_ends",
            KeypointSource::Nothing => "none",
        }
    }
}

/// Keypoints of the source frames that a flock shows, in pixels of the footage from the centroid.
pub(super) struct SourceKeypoints(BTreeMap<u32, (KeypointSource, Points)>);

impl SourceKeypoints {
    /// Finds the keypoints of all frames that the flock shows.
    pub(super) fn of(library: &Library, flock: &Flock) -> SourceKeypoints {
        let mut by_frame = BTreeMap::new();
        let mut rgba = Vec::new();
        for individual in &flock.individuals {
            for &frame in &individual.source_frame {
                by_frame
                    .entry(frame)
                    .or_insert_with(|| of_frame(library, frame as usize, &mut rgba));
            }
        }
        SourceKeypoints(by_frame)
    }

    /// Returns the keypoints of a source frame as placed in the film, in pixels of the film.
    pub(super) fn placed(&self, frame: u32, place: &Placement) -> (KeypointSource, Points) {
        let (source, points) = self.0.get(&frame).copied().unwrap_or_default();
        (source, points.map(|point| Some(place.point(point?))))
    }
}

/// Returns the keypoints of every frame of the footage, in pixels of the footage, and the confidence of the pose; all
/// `None` and 0 where the animal was not found.
pub fn of_footage(library: &Library) -> impl Iterator<Item = (Points, f64)> {
    let mut rgba = Vec::new();
    library
        .poses
        .frames
        .iter()
        .enumerate()
        .map(move |(frame, pose)| {
            let Some(center) = pose.centroid_px else {
                return (Points::default(), 0.0);
            };
            let (_, points) = of_frame(library, frame, &mut rgba);
            let shifted = |[x, y]: [f64; 2]| [x + center[0], y + center[1]];
            (
                points.map(|point| point.map(shifted)),
                pose.confidence.unwrap_or(1.0),
            )
        })
}

fn of_frame(library: &Library, frame: usize, rgba: &mut Vec<u8>) -> (KeypointSource, Points) {
    let mut points = Points::default();
    points[N_ALONG] = Some([0.0; 2]);
    let Some(pose) = library.poses.frames.get(frame) else {
        return (KeypointSource::Nothing, points);
    };
    if let (Some(midline), Some(center)) = (&pose.midline_px, pose.centroid_px) {
        for (k, point) in points[..N_ALONG].iter_mut().enumerate() {
            let [x, y] = along(midline, k as f64 / (N_ALONG - 1) as f64);
            *point = Some([x - center[0], y - center[1]]);
        }
        return (KeypointSource::Midline, points);
    }
    let ends = forward_rad(pose).and_then(|forward| body_ends(library, frame, forward, rgba));
    let Some([head, tail]) = ends else {
        return (KeypointSource::Nothing, points);
    };
    (points[0], points[N_ALONG - 1]) = (Some(head), Some(tail));
    (KeypointSource::BodyEnds, points)
}

/// Returns the point at a share of the number of points.
fn along(line: &[[f64; 2]], share: f64) -> [f64; 2] {
    let at = share * (line.len() - 1) as f64;
    let (before, after) = (line[at as usize], line[at.ceil() as usize]);
    std::array::from_fn(|k| before[k] + at.fract() * (after[k] - before[k]))
}

/// Returns the direction of the length axis toward the head, radians.
fn forward_rad(pose: &Pose) -> Option<f64> {
    let heading = pose.heading_rad?;
    let axis = pose.axis_rad.unwrap_or(heading);
    let is_ahead = wrap_rad(axis - heading).abs() <= std::f64::consts::FRAC_PI_2;
    Some(if is_ahead {
        axis
    } else {
        axis + std::f64::consts::PI
    })
}

/// Returns the two ends of the silhouette in a direction and against it, from the centroid. An end lies at the
/// outermost pixel along the direction and at the middle of the last piece of the body across it.
fn body_ends(
    library: &Library,
    frame: usize,
    forward_rad: f64,
    rgba: &mut Vec<u8>,
) -> Option<[[f64; 2]; 2]> {
    let matte = library.sprites.matte(frame)?;
    library.sprites.read_matte(&matte, rgba);
    let (cos, sin) = (libm::cos(forward_rad), libm::sin(forward_rad));
    let width = matte.size[0].max(1) as usize;
    let body: Vec<[f64; 2]> = (rgba.chunks_exact(4).enumerate())
        .filter(|(_, pixel)| pixel[3] >= HALF_ALPHA)
        .map(|(k, _)| {
            let x = (k % width) as f64 + 0.5 - matte.center_px[0];
            let y = (k / width) as f64 + 0.5 - matte.center_px[1];
            [cos * x + sin * y, cos * y - sin * x]
        })
        .collect();
    let edge = |sign: f64| body.iter().map(|[u, _]| sign * u).reduce(f64::max);
    let (front, back) = (edge(1.0)?, -edge(-1.0)?);
    let piece = END_SHARE * (front - back);
    let end = |u: f64, is_within: &dyn Fn(f64) -> bool| {
        let across = body.iter().filter(|[u, _]| is_within(*u)).map(|[_, v]| v);
        let v = across.clone().sum::<f64>() / across.count().max(1) as f64;
        [cos * u - sin * v, sin * u + cos * v]
    };
    Some([
        end(front, &|u| u >= front - piece),
        end(back, &|u| u <= back + piece),
    ])
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use super::*;
    use crate::flock::composite::params::Background;
    use crate::flock::{Compositor, Params, Shot, plan_flock, synthetic};
    use crate::library::{Sprites, View};
    use crate::parameters::Parameters;
    use crate::progress::Silent;
    use crate::scratch::{Full, InMemory};

    const N_FRAMES: usize = 60;

    fn swarm(library: &Library, count: u32) -> Flock {
        let params = Params {
            count: Some(count),
            frames: N_FRAMES as u32,
            fade_frames: 0,
            ..Params::preset("swarm").expect("a known preset")
        };
        let mut flock = plan_flock(library, &params, &Silent).expect("a good library");
        flock.params.render.background = Background::Transparent;
        flock
    }

    /// Returns the library with sprites of a soft dot, 17 pixels ahead of the centroid and 6 beside it. The first
    /// point of each midline is there.
    fn library_of_dots() -> Library {
        let mut library = synthetic::library(View::Top);
        let at = |pose: &Pose| {
            let heading = pose.heading_rad.expect("measured");
            let (cos, sin) = (libm::cos(heading), libm::sin(heading));
            [17.0 * cos - 6.0 * sin, 17.0 * sin + 6.0 * cos]
        };
        let poses = library.poses.frames.clone();
        let draw = |frame: usize, rgba: &mut [u8]| {
            let [dx, dy] = at(&poses[frame]);
            for (k, pixel) in rgba.chunks_exact_mut(4).enumerate() {
                let (x, y) = ((k % 56) as f64 - 27.5, (k / 56) as f64 - 27.5);
                let alpha = 255.0 * (-((x - dx).powi(2) + (y - dy).powi(2)) / 8.0).exp();
                pixel.copy_from_slice(&[9, 9, 9, alpha.round() as u8]);
            }
            Ok::<_, Full>(true)
        };
        let scratch = Arc::new(InMemory::default());
        library.sprites =
            Sprites::drawn([56, 56], poses.len(), scratch, draw).expect("memory has room");
        for pose in &mut library.poses.frames {
            let ([dx, dy], [x, y]) = (at(pose), pose.centroid_px.expect("measured"));
            pose.midline_px = Some(vec![[x + dx, y + dy], [x, y]]);
        }
        library
    }

    #[test]
    fn head_lies_where_its_pixels_are_drawn() {
        let library = library_of_dots();
        let mut flock = swarm(&library, 1);
        flock.params.render.size_px = Some([400, 300]);
        let compositor = Compositor::new(&library, &flock).straight().with_truth();
        let (mut shot, mut n_mirrored, mut n_turned) = (Shot::default(), 0, 0);
        for frame in 0..N_FRAMES {
            compositor.render(frame, &mut shot);
            let mut sum = [0.0; 3];
            for (k, pixel) in shot.rgba.chunks_exact(4).enumerate() {
                let alpha = f64::from(pixel[3]);
                let place = [(k % 400) as f64 + 0.5, (k / 400) as f64 + 0.5, 1.0];
                for (sum, value) in sum.iter_mut().zip(place) {
                    *sum += alpha * value;
                }
            }
            let seen = &shot.truth.seen[0];
            assert_eq!(seen.keypoint_source, KeypointSource::Midline);
            let [x, y] = seen.keypoints[0].expect("measured").px;
            let miss = (x - sum[0] / sum[2]).hypot(y - sum[1] / sum[2]);
            assert!(seen.visibility < 0.99 || miss < 0.05, "{frame}: {miss}");
            n_mirrored += usize::from(flock.individuals[0].mirrored[frame]);
            n_turned += usize::from(flock.individuals[0].rotation_rad[frame].abs() > 0.3);
        }
        assert!(
            n_turned > 10 && n_mirrored < N_FRAMES,
            "{n_mirrored} {n_turned}"
        );
    }

    #[test]
    fn hidden_keypoints_lie_under_nearer_animals_drawn_alone() {
        let library = synthetic::library(View::Side);
        let flock = swarm(&library, 12);
        let compositor = Compositor::new(&library, &flock).straight().with_truth();
        let alone: Vec<Flock> = (flock.individuals.iter())
            .map(|one| {
                let mut alone = flock.clone();
                alone.individuals = vec![one.clone()];
                alone.individuals[0].id = 0;
                alone
            })
            .collect();
        let alone: Vec<Compositor> = (alone.iter())
            .map(|flock| Compositor::new(&library, flock).straight())
            .collect();
        let depth = |id: usize, frame: usize| flock.individuals[id].boid.position_px[frame][2];
        let (mut shot, mut single, mut n_hidden) = (Shot::default(), Shot::default(), 0);
        for frame in (0..N_FRAMES).step_by(2) {
            compositor.render(frame, &mut shot);
            let alpha: Vec<Vec<f64>> = (alone.iter())
                .map(|one| {
                    one.render(frame, &mut single);
                    let alpha = single.rgba.chunks_exact(4).map(|pixel| f64::from(pixel[3]));
                    alpha.map(|alpha| alpha / 255.0).collect()
                })
                .collect();
            for (id, seen) in shot.truth.seen.iter().enumerate() {
                let is_nearer =
                    |other: &usize| (depth(*other, frame), id) < (depth(id, frame), *other);
                let n_nearer = (0..12).filter(is_nearer).count();
                assert_eq!(seen.depth_rank as usize, n_nearer);
                assert_eq!(seen.keypoint_source, KeypointSource::BodyEnds);
                for point in seen.keypoints.iter().flatten() {
                    let [x, y] = point.px;
                    let is_inside = (0.0..320.0).contains(&x) && (0.0..240.0).contains(&y);
                    let left: f64 = (0..12)
                        .filter(|other| is_inside && is_nearer(other))
                        .map(|other| 1.0 - alpha[other][y as usize * 320 + x as usize])
                        .product();
                    let is_tie = (left - 0.5).abs() < 0.01;
                    assert!(
                        is_tie || point.is_visible == (is_inside && left > 0.5),
                        "{left}"
                    );
                    n_hidden += usize::from(!point.is_visible);
                }
            }
        }
        assert!(n_hidden > 20, "{n_hidden}");
    }

    #[test]
    fn ends_of_a_body_are_the_middles_of_its_outermost_pieces() {
        let mut library = synthetic::library(View::Side);
        let draw = |_, rgba: &mut [u8]| {
            for (k, pixel) in rgba.chunks_exact_mut(4).enumerate() {
                let is_body = (8..38).contains(&(k % 56)) && (20..26).contains(&(k / 56));
                pixel[3] = if is_body { 255 } else { 100 };
            }
            Ok::<_, Full>(true)
        };
        let scratch = Arc::new(InMemory::default());
        library.sprites = Sprites::drawn([56, 56], 2, scratch, draw).expect("memory has room");
        for (heading, [head, tail]) in [(0.2, [9.5, -19.5]), (3.0, [-19.5, 9.5])] {
            library.poses.frames[1].heading_rad = Some(heading);
            library.poses.frames[1].axis_rad = Some(0.0);
            let (source, points) = of_frame(&library, 1, &mut Vec::new());
            assert_eq!(source, KeypointSource::BodyEnds);
            let close = |point: Option<[f64; 2]>, x: f64| {
                let [found, y] = point.expect("measured");
                assert!(
                    (found - x).abs() < 1e-9 && (y + 5.0).abs() < 1e-9,
                    "{point:?}"
                );
            };
            close(points[0], head);
            close(points[N_ALONG - 1], tail);
            assert_eq!(points[1..N_ALONG - 1], [None; N_ALONG - 2]);
            assert_eq!(points[N_ALONG], Some([0.0; 2]));
        }
        library.poses.frames[1].heading_rad = None;
        assert_eq!(
            of_frame(&library, 1, &mut Vec::new()).0,
            KeypointSource::Nothing
        );
    }
}
