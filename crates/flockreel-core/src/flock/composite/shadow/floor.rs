//! Shadows in side view: flat ellipses on a floor below the lowest animal of the flock.
//!
//! The shadow of a farther animal lies higher in the picture. The shadow of an animal is paler the higher
//! the animal swims above the floor (docs/explanation/algorithms.md, "Shadows").

use super::Shade;
use crate::flock::Flock;
use crate::flock::boids::tank::Tank;
use crate::flock::composite::layer::Appearance;
use crate::flock::composite::view::View;
use crate::flock::individual::Individual;
use crate::flock::lens::Lens;
use crate::flock::motion::motion_of;
use crate::geometry::Rect;
use crate::library::Library;
use crate::order::median;
use crate::raster::resample::ONE;

/// Height above the floor from which an animal casts no shadow, in body lengths. Free choice.
const HEIGHT_BL: f64 = 6.0;
/// Half the length of a shadow, in body lengths. Free choice.
const HALF_LENGTH_BL: f64 = 0.6;
/// Half the width of a shadow, in body lengths. Free choice.
const HALF_WIDTH_BL: f64 = 0.26;
/// Least half height of a shadow in the picture, in body lengths. Free choice.
const MIN_HALF_HEIGHT_BL: f64 = 0.1;
/// Least horizontal extent of a shadow as a share of its length, for headings that are nearly vertical in
/// the picture. Free choice.
const MIN_ACROSS: f64 = 0.4;

/// Floor of the tank in side view.
#[derive(Clone, Copy, Debug)]
pub(super) struct Floor {
    lens: Lens,
    /// Depth of the tank's front, in body lengths from the camera.
    front_bl: f64,
    /// Height of the floor, in body lengths, positive down.
    floor_bl: f64,
}

/// Shadow in the film: center and half axes in pixels, and its share of the requested darkness, 0..=1.
pub(super) struct Ellipse {
    center: [f64; 2],
    half: [f64; 2],
    share: f64,
}

impl Floor {
    /// Returns the floor: half a body height below the lowest position of any individual in any frame.
    pub(super) fn new(library: &Library, flock: &Flock) -> Floor {
        let lens = Lens::new(library, &flock.params);
        let tank = Tank::from_library(library, &lens, &motion_of(library, &lens), &flock.params);
        let mut floor = Floor {
            lens,
            front_bl: tank.corners[0][2],
            floor_bl: f64::NEG_INFINITY,
        };
        let heights = library
            .poses
            .frames
            .iter()
            .filter_map(|pose| pose.height_px);
        let height_bl = median(heights).unwrap_or(0.0) / flock.length_px;
        let lowest = flock.individuals.iter().flat_map(|individual| {
            (0..individual.centroid_px.len()).map(|t| floor.place(individual, t)[1])
        });
        floor.floor_bl = lowest.fold(f64::NEG_INFINITY, f64::max) + height_bl / 2.0;
        floor
    }

    /// Returns the shadow of an individual in one frame.
    pub(super) fn shadow(&self, appearance: &Appearance, view: &View) -> Ellipse {
        let (individual, t) = (appearance.individual, appearance.frame_idx);
        let [x, y, depth_bl] = self.place(individual, t);
        let length = self.lens.px_per_bl(depth_bl) * view.scale;
        let across = libm::fabs(libm::cos(individual.heading_rad[t])).max(MIN_ACROSS);
        let high = (HALF_WIDTH_BL * self.floor_bl / depth_bl.max(1.0)).max(MIN_HALF_HEIGHT_BL);
        let left = 1.0 - (self.floor_bl - y) / HEIGHT_BL;
        let center = self.lens.picture_px([x, self.floor_bl, depth_bl]);
        Ellipse {
            center: view.point(center),
            half: [HALF_LENGTH_BL * across, high].map(|bl| bl * length),
            share: left.clamp(0.0, 1.0),
        }
    }

    /// Returns the position of an individual in the tank, in body lengths.
    fn place(&self, individual: &Individual, t: usize) -> [f64; 3] {
        let behind_px = individual.boid.position_px[t][2];
        let depth_bl = if self.lens.is_flat() {
            0.0
        } else {
            self.front_bl + behind_px / self.lens.length_px
        };
        self.lens.place_bl(individual.centroid_px[t], depth_bl)
    }
}

impl Ellipse {
    /// Draws the ellipse. Its center has the share of `darkness`; the alpha falls smoothly to 0 at the rim.
    pub(super) fn draw(&self, darkness: f64, shade: &mut Shade) {
        let [left, right] = [-1.0, 1.0].map(|side| self.center[0] + side * self.half[0]);
        let [top, bottom] = [-1.0, 1.0].map(|side| self.center[1] + side * self.half[1]);
        let [width, height] = shade.size_px;
        let rect = Rect::clipped(
            left.floor() as i64,
            top.floor() as i64,
            right.ceil() as i64,
            bottom.ceil() as i64,
            width,
            height,
        );
        if rect.is_empty() {
            return;
        }
        shade.reach(rect);
        for (y, x) in
            (rect.y..rect.bottom()).flat_map(|y| (rect.x..rect.right()).map(move |x| (y, x)))
        {
            let u = (f64::from(x) + 0.5 - self.center[0]) / self.half[0];
            let v = (f64::from(y) + 0.5 - self.center[1]) / self.half[1];
            let inside = (1.0 - u * u - v * v).max(0.0);
            let alpha = darkness * self.share * inside * inside * f64::from(ONE);
            shade.darken(x, y, alpha.round() as u16);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::flock::{Params, plan_flock, synthetic};
    use crate::library;
    use crate::progress::Silent;

    #[test]
    fn an_ellipse_is_darkest_in_its_middle() {
        let mut ellipse = Ellipse {
            center: [20.5, 15.5],
            half: [10.0, 4.0],
            share: 1.0,
        };
        let mut shade = Shade::default();
        shade.begin([40, 30]);
        ellipse.draw(0.5, &mut shade);
        let alpha = |x: usize, y: usize| shade.alpha()[y * 40 + x];
        assert_eq!(alpha(20, 15), ONE as u16 / 2);
        assert!(alpha(27, 15) > 0 && alpha(27, 15) < alpha(23, 15));
        assert_eq!(alpha(20, 21), 0);
        ellipse.center = [-50.0, 15.0];
        shade.begin([40, 30]);
        ellipse.draw(0.5, &mut shade);
        assert!(shade.rect.is_empty());
    }

    #[test]
    fn shadows_lie_below_all_individuals_and_nearer_ones_lower() {
        let library = synthetic::library(library::View::Side);
        let params = Params {
            count: Some(12),
            frames: 60,
            ..Params::default()
        };
        let flock = plan_flock(&library, &params, &Silent).expect("a good library");
        let floor = Floor::new(&library, &flock);
        let view = View::fitted(flock.image_size_px, flock.image_size_px);
        let mut shadows = Vec::new();
        for individual in &flock.individuals {
            let frame_idx = 30;
            let shadow = floor.shadow(
                &Appearance {
                    individual,
                    frame_idx,
                    fade: None,
                },
                &view,
            );
            let [x, y] = individual.centroid_px[frame_idx];
            assert!(shadow.center[1] > y && (shadow.center[0] - x).abs() < 1e-6);
            assert!(shadow.share > 0.0 && shadow.share < 1.0);
            let depth_px = individual.boid.position_px[frame_idx][2];
            shadows.push((depth_px, shadow.center[1]));
        }
        shadows.sort_unstable_by(|a, b| a.0.total_cmp(&b.0));
        assert!(
            shadows.is_sorted_by(|near, far| near.1 >= far.1),
            "{shadows:?}"
        );
        assert!(shadows[0].1 > shadows[11].1 + 1.0);
    }
}
