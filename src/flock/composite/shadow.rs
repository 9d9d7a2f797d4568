//! Soft shadows on the floor, off by default (ALGORITHMS.md 8): seen from above, a blurred ellipse under
//! the animal and a little beside it; from the side, a flat one below it on the floor, which lies under the lowest place
//! where anybody of the flock swims, farther up in the picture the farther it is, and paler the higher the animal swims.
//! They are part of the scenery: no label and no box takes notice of them.

use super::layer::Appearance;
use super::view::View;
use crate::flock::Flock;
use crate::flock::boids::tank::Tank;
use crate::flock::individual::Individual;
use crate::flock::lens::Lens;
use crate::flock::motion::motion_of;
use crate::geometry::Rect;
use crate::library::Library;
use crate::order::median;
use crate::raster::resample::{ONE, Resampled};

/// A shadow has faded out so high above the floor.
const HEIGHT_BL: f64 = 6.0;
/// Half the length and the width of a shadow.
const HALF_LENGTH_BL: f64 = 0.6;
const HALF_WIDTH_BL: f64 = 0.26;
/// Seen from the side a shadow is at least so high, from its middle.
const LEAST_HALF_BL: f64 = 0.1;

/// Where shadows fall.
#[derive(Clone, Copy, Debug)]
pub(super) struct Floor {
    darkness: f64,
    length_px: f64,
    below: Option<Below>,
}

/// A floor that is seen from the side.
#[derive(Clone, Copy, Debug)]
struct Below {
    lens: Lens,
    /// The depth of the tank's front and the height of the floor, body lengths from the camera, down.
    front_bl: f64,
    floor_bl: f64,
}

/// A shadow in the picture: its middle, its half axes, how far the first is turned, and how dark it is.
struct Ellipse {
    center: [f64; 2],
    half: [f64; 2],
    turn_rad: f64,
    darkness: f64,
}

impl Floor {
    /// The floor below a flock, for shadows of so much darkness.
    pub(super) fn of(library: &Library, flock: &Flock, darkness: f64) -> Floor {
        let lens = Lens::of(library, &flock.params);
        let is_side = library.poses.view == crate::library::View::Side;
        Floor {
            darkness,
            length_px: flock.length_px,
            below: is_side.then(|| Below::of(library, flock, lens)),
        }
    }

    /// Draws the shadows of all as one layer: where several lie, the darkest.
    pub(super) fn draw(&self, all: &[Appearance], view: &View, layer: &mut Resampled) {
        let ellipses = all.iter().map(|who| self.shadow(who, view));
        let boxed = ellipses.map(|ellipse| (ellipse.rect(view.size_px), ellipse));
        let seen: Vec<(Rect, Ellipse)> = boxed.filter(|(rect, _)| !rect.is_empty()).collect();
        let whole = seen.iter().map(|(rect, _)| *rect);
        layer.begin(whole.reduce(|a, b| a.union(&b)).unwrap_or_default());
        layer.pixels.fill([0; 4]);
        for (rect, ellipse) in &seen {
            ellipse.draw(*rect, layer);
        }
        layer.show_whole();
    }

    fn shadow(&self, who: &Appearance, view: &View) -> Ellipse {
        let (individual, t) = (who.individual, who.frame_idx);
        let heading = individual.heading_rad[t];
        let Some(below) = &self.below else {
            let length = self.length_px * individual.scale[t] * view.scale;
            let off = 0.12 * length;
            let center = view.point(individual.centroid_px[t]);
            return Ellipse {
                center: center.map(|px| px + off),
                half: [HALF_LENGTH_BL, HALF_WIDTH_BL].map(|bl| bl * length),
                turn_rad: heading,
                darkness: self.darkness,
            };
        };
        let [x, y, depth_bl] = below.place(individual, t);
        let length = below.lens.px_per_bl(depth_bl) * view.scale;
        let across = libm::fabs(libm::cos(heading)).max(0.4);
        let high = (HALF_WIDTH_BL * below.floor_bl / depth_bl.max(1.0)).max(LEAST_HALF_BL);
        let left = 1.0 - (below.floor_bl - y) / HEIGHT_BL;
        let center = below.lens.picture_px([x, below.floor_bl, depth_bl]);
        Ellipse {
            center: view.point(center),
            half: [HALF_LENGTH_BL * across, high].map(|bl| bl * length),
            turn_rad: 0.0,
            darkness: self.darkness * left.clamp(0.0, 1.0),
        }
    }
}

impl Below {
    /// Under the lowest place of anybody at any time.
    fn of(library: &Library, flock: &Flock, lens: Lens) -> Below {
        let tank = Tank::of(library, &lens, &motion_of(library, &lens), &flock.params);
        let mut below = Below {
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
            (0..individual.centroid_px.len()).map(|t| below.place(individual, t)[1])
        });
        below.floor_bl = lowest.fold(f64::NEG_INFINITY, f64::max) + height_bl / 2.0;
        below
    }

    /// Where one is drawn, in the tank.
    fn place(&self, individual: &Individual, t: usize) -> [f64; 3] {
        let behind_px = individual.boid.position_px[t][2];
        let depth_bl = match self.lens.is_flat() {
            true => 0.0,
            false => self.front_bl + behind_px / self.lens.length_px,
        };
        self.lens.place_bl(individual.centroid_px[t], depth_bl)
    }
}

impl Ellipse {
    /// The box that it lies in.
    fn rect(&self, [width, height]: [u32; 2]) -> Rect {
        let reach = self.half[0].max(self.half[1]) + 1.0;
        let [left, top] = self.center.map(|px| (px - reach).floor() as i64);
        let [right, bottom] = self.center.map(|px| (px + reach).ceil() as i64);
        Rect::clipped(left, top, right, bottom, width, height)
    }

    /// Black, as dark as said in its middle, softer toward its rim, where nothing darker is yet.
    fn draw(&self, rect: Rect, layer: &mut Resampled) {
        let (cos, sin) = (libm::cos(self.turn_rad), libm::sin(self.turn_rad));
        for y in rect.y..rect.bottom() {
            for x in rect.x..rect.right() {
                let (dx, dy) = (
                    f64::from(x) + 0.5 - self.center[0],
                    f64::from(y) + 0.5 - self.center[1],
                );
                let (u, v) = (
                    (cos * dx + sin * dy) / self.half[0],
                    (cos * dy - sin * dx) / self.half[1],
                );
                let inside = (1.0 - u * u - v * v).max(0.0);
                let alpha = self.darkness * inside * inside * f64::from(ONE);
                let at = (y - layer.rect.y) * layer.rect.w + x - layer.rect.x;
                let [.., before] = &mut layer.pixels[at as usize];
                *before = (*before).max(alpha.round() as i16);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::flock::{Params, plan_flock, synthetic};
    use crate::library;
    use crate::progress::Silent;

    fn layer_of(rect: Rect) -> Resampled {
        let mut layer = Resampled::default();
        layer.begin(rect);
        layer
    }

    #[test]
    fn an_ellipse_is_darkest_in_its_middle_and_turned() {
        let mut ellipse = Ellipse {
            center: [20.5, 15.5],
            half: [10.0, 4.0],
            turn_rad: std::f64::consts::FRAC_PI_2,
            darkness: 0.5,
        };
        let rect = ellipse.rect([40, 30]);
        let mut layer = layer_of(rect);
        // Twice is no darker.
        ellipse.draw(rect, &mut layer);
        ellipse.draw(rect, &mut layer);
        let alpha = |x: u32, y: u32| {
            let rect = layer.rect;
            layer.pixels[((y - rect.y) * rect.w + x - rect.x) as usize][3]
        };
        assert_eq!(alpha(20, 15), ONE / 2);
        assert!(alpha(20, 22) > 0 && alpha(20, 22) < alpha(20, 18));
        assert_eq!(alpha(26, 15), 0);
        ellipse.center = [-50.0, 15.0];
        assert!(ellipse.rect([40, 30]).is_empty());
    }

    #[test]
    fn from_the_side_the_floor_lies_below_everybody_and_the_nearer_the_lower() {
        let library = synthetic::library(library::View::Side);
        let params = Params {
            count: Some(12),
            frames: 60,
            ..Params::default()
        };
        let flock = plan_flock(&library, &params, &Silent).expect("a good library");
        let floor = Floor::of(&library, &flock, 0.5);
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
            assert!(shadow.darkness > 0.0 && shadow.darkness < 0.5);
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
