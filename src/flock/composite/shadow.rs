//! Soft shadows on the floor, off by default (ALGORITHMS.md 8): seen from above, a blurred ellipse under
//! the animal and a little beside it; from the side, a flat one on the floor below, paler the higher the
//! animal swims. They are part of the scenery: no label and no box takes notice of them.

use super::layer::Appearance;
use super::view::View;
use crate::geometry::Rect;
use crate::library::{self, Library};
use crate::raster::resample::{ONE, Resampled};

/// A shadow has faded out so high above the floor.
const HEIGHT_BL: f64 = 6.0;

/// Where shadows fall.
#[derive(Clone, Copy, Debug)]
pub(super) struct Floor {
    darkness: f64,
    length_px: f64,
    /// Height of the floor in the footage, where it is seen from the side.
    floor_y_px: Option<f64>,
}

impl Floor {
    /// The floor of a library's scene, for shadows of so much darkness: below the lowest place where the
    /// animal was seen.
    pub(super) fn of(library: &Library, length_px: f64, darkness: f64) -> Floor {
        let lowest = |pose: &library::Pose| {
            let [_, y] = pose.centroid_px?;
            Some(y + pose.height_px? / 2.0)
        };
        let bottoms = library.poses.frames.iter().filter_map(lowest);
        let bottom = bottoms.fold(0.0, f64::max);
        let height = f64::from(library.background.height);
        Floor {
            darkness,
            length_px,
            floor_y_px: match library.poses.view {
                library::View::Side => Some(bottom.min(height - 0.06 * length_px)),
                library::View::Top => None,
            },
        }
    }

    /// Draws the shadow of one individual as a layer.
    pub(super) fn draw(&self, who: &Appearance, view: &View, layer: &mut Resampled) {
        let t = who.frame_idx;
        let [x, y] = who.individual.centroid_px[t];
        let length = self.length_px * who.individual.scale[t];
        let heading = who.individual.heading_rad[t];
        let (center, half, turn, darkness) = match self.floor_y_px {
            None => {
                let off = 0.12 * length;
                ([x + off, y + off], [0.6, 0.26], heading, self.darkness)
            }
            Some(floor_y) => {
                let height_bl = (floor_y - y).max(0.0) / length;
                let along = 0.6 * libm::fabs(libm::cos(heading)).max(0.4);
                let left = (1.0 - height_bl / HEIGHT_BL).max(0.0);
                ([x, floor_y], [along, 0.1], 0.0, self.darkness * left)
            }
        };
        let half = half.map(|bl| bl * length * view.scale);
        ellipse(
            layer,
            (view.point(center), half, turn),
            darkness,
            view.size_px,
        );
    }
}

/// A black ellipse about a center, of two half axes, the first turned so far; as dark as said in its middle,
/// softer toward its rim.
fn ellipse(
    layer: &mut Resampled,
    (center, half, turn_rad): ([f64; 2], [f64; 2], f64),
    darkness: f64,
    [width, height]: [u32; 2],
) {
    let reach = half[0].max(half[1]) + 1.0;
    let [left, top] = center.map(|px| (px - reach).floor() as i64);
    let [right, bottom] = center.map(|px| (px + reach).ceil() as i64);
    layer.rect = Rect::clipped(left, top, right, bottom, width, height);
    let (cos, sin) = (libm::cos(turn_rad), libm::sin(turn_rad));
    layer.show_whole();
    layer.pixels.clear();
    for y in layer.rect.y..layer.rect.bottom() {
        for x in layer.rect.x..layer.rect.right() {
            let (dx, dy) = (
                f64::from(x) + 0.5 - center[0],
                f64::from(y) + 0.5 - center[1],
            );
            let (u, v) = (
                (cos * dx + sin * dy) / half[0],
                (cos * dy - sin * dx) / half[1],
            );
            let inside = (1.0 - u * u - v * v).max(0.0);
            let alpha = darkness * inside * inside * f64::from(ONE);
            layer.pixels.push([0, 0, 0, alpha.round() as i16]);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_ellipse_is_darkest_in_its_middle_and_turned() {
        let mut layer = Resampled::default();
        let quarter = std::f64::consts::FRAC_PI_2;
        ellipse(
            &mut layer,
            ([20.5, 15.5], [10.0, 4.0], quarter),
            0.5,
            [40, 30],
        );
        let alpha = |x: u32, y: u32| {
            let rect = layer.rect;
            layer.pixels[((y - rect.y) * rect.w + x - rect.x) as usize][3]
        };
        assert_eq!(alpha(20, 15), ONE / 2);
        assert!(alpha(20, 22) > 0 && alpha(20, 22) < alpha(20, 18));
        assert_eq!(alpha(26, 15), 0);
        ellipse(&mut layer, ([-50.0, 15.0], [10.0, 4.0], 0.0), 0.5, [40, 30]);
        assert!(layer.pixels.is_empty());
    }
}
