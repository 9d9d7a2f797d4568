//! Support: what carries an animal seen from the side, such as a perch or the floor.
//!
//! The foot of an animal is the lowest point of its outline. The foot of an animal that is carried keeps its
//! height, while that of one that swims or flies rises and sinks. An animal counts as carried in a film if its
//! foot keeps its height in most frames. It is then shown only where something carries it.

use crate::flock::lens::Lens;
use crate::flock::motion::REST_BL_PER_S;
use crate::library::{Library, View};

/// Time before and after a frame over which the height of the foot is compared, seconds. Free choice.
const SPAN_S: f64 = 0.2;
/// Difference of heights below which two footholds belong to one ledge, and gap that a ledge bridges, body
/// lengths. Free choices.
const SAME_HEIGHT_BL: f64 = 0.08;
const BRIDGED_BL: f64 = 1.0;
/// How far a ledge goes on beyond the outermost foothold, body lengths. Free choice.
const GOES_ON_BL: f64 = 0.2;

/// Perches and floors that carry the filmed animal, and the frames in which they do.
#[derive(Clone, Debug)]
pub(in crate::flock) struct Support {
    /// Distance from the centroid down to the foot, pixels; `None` if the animal is not carried in the frame.
    foot_px: Vec<Option<f64>>,
    /// Frame in which the animal lands after its next flight, from each frame on.
    landing: Vec<Option<u32>>,
    ledges: Vec<Ledge>,
}

/// Part of a perch or of the floor on which a foot stood.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Ledge {
    y_px: f64,
    /// Left and right end.
    ends_px: [f64; 2],
}

impl Support {
    /// Returns the support of a library's animal, or `None` if it swims, flies or is seen from above.
    pub(in crate::flock) fn new(library: &Library, lens: &Lens) -> Option<Support> {
        let poses = &library.poses;
        if poses.view == View::Top {
            return None;
        }
        let foot = |frame: usize| {
            let pose = poses.frames.get(frame).filter(|pose| !pose.cut)?;
            Some((pose.centroid_px?, f64::from(pose.box_px?.bottom())))
        };
        let reach = ((SPAN_S * poses.fps).round() as usize).max(1);
        let rate = |frame: usize| {
            let (before, after) = (foot(frame.checked_sub(reach)?)?, foot(frame + reach)?);
            Some((after.1 - before.1).abs() * poses.fps / (2 * reach) as f64 / lens.length_px)
        };
        let rates: Vec<Option<f64>> = (0..poses.frames.len()).map(rate).collect();
        let keeps = |rate: &Option<f64>| rate.is_some_and(|rate| rate < REST_BL_PER_S);
        let n_known = rates.iter().flatten().count();
        // A foot keeps its height for a moment at the top of a leap, too.
        let runs = rates.chunk_by(|a, b| keeps(a) == keeps(b));
        let is_carried: Vec<bool> = runs
            .flat_map(|run| vec![keeps(&run[0]) && run.len() >= 2 * reach; run.len()])
            .collect();
        if 2 * is_carried.iter().filter(|&&is_carried| is_carried).count() <= n_known {
            return None;
        }
        let carried = is_carried.iter().enumerate();
        let foot_px: Vec<Option<f64>> = carried
            .map(|(frame, &is_carried)| is_carried.then(|| foot(frame)).flatten())
            .map(|foot| foot.map(|([_, y], bottom)| bottom - y))
            .collect();
        let mut landing = vec![None; foot_px.len()];
        let (mut ahead, mut after_flight) = (None, None);
        for frame in (0..foot_px.len()).rev() {
            if foot_px[frame].is_some() {
                ahead = Some(frame as u32);
            } else {
                after_flight = ahead;
            }
            landing[frame] = after_flight;
        }
        let footholds = (0..foot_px.len()).filter(|&frame| foot_px[frame].is_some());
        let footholds = footholds
            .filter_map(foot)
            .map(|([x, _], bottom)| [x, bottom]);
        Some(Support {
            ledges: ledges(footholds.collect(), lens.length_px),
            landing,
            foot_px,
        })
    }

    /// Returns the distance from the centroid down to the foot, pixels, or `None` if the animal is not carried
    /// in the frame.
    pub(in crate::flock) fn foot_px(&self, frame: u32) -> Option<f64> {
        self.foot_px[frame as usize]
    }

    /// Returns the frame in which the animal lands after its next flight, from a frame on.
    pub(super) fn landing(&self, frame: u32) -> Option<u32> {
        self.landing[frame as usize]
    }

    /// Returns the way from a foot to the nearest place that carries it, pixels.
    pub(super) fn way_px(&self, [x, y]: [f64; 2]) -> [f64; 2] {
        let ways = self.ledges.iter().map(|ledge| {
            let [left, right] = ledge.ends_px;
            [x.clamp(left, right) - x, ledge.y_px - y]
        });
        let length = |way: &[f64; 2]| way[0].hypot(way[1]);
        ways.min_by(|a, b| length(a).total_cmp(&length(b)))
            .unwrap_or_default()
    }

    /// Returns the number of animals that can stand `clear_px` apart.
    pub(in crate::flock) fn capacity(&self, clear_px: f64) -> u32 {
        let mut stands: Vec<[f64; 2]> = Vec::new();
        for ledge in &self.ledges {
            let [left, right] = ledge.ends_px;
            let n = ((right - left) / clear_px).floor() as usize + 1;
            for k in 0..n {
                let place = [left + k as f64 * clear_px, ledge.y_px];
                if stands
                    .iter()
                    .all(|other| (other[0] - place[0]).hypot(other[1] - place[1]) >= clear_px)
                {
                    stands.push(place);
                }
            }
        }
        stands.len() as u32
    }
}

/// Returns the ledges on which these footholds lie. Each foothold lies on one.
fn ledges(mut footholds: Vec<[f64; 2]>, length_px: f64) -> Vec<Ledge> {
    footholds.sort_by(|a, b| a[1].total_cmp(&b[1]));
    let mut ledges = Vec::new();
    let mut rest = &footholds[..];
    while let Some(&[_, top]) = rest.first() {
        let n = rest.partition_point(|foot| foot[1] <= top + SAME_HEIGHT_BL * length_px);
        let (level, below) = rest.split_at(n);
        let mut level = level.to_vec();
        level.sort_by(|a, b| a[0].total_cmp(&b[0]));
        for stretch in level.chunk_by(|a, b| b[0] - a[0] <= BRIDGED_BL * length_px) {
            let sum: f64 = stretch.iter().map(|foot| foot[1]).sum();
            ledges.push(Ledge {
                y_px: sum / stretch.len() as f64,
                ends_px: [
                    stretch[0][0] - GOES_ON_BL * length_px,
                    stretch[stretch.len() - 1][0] + GOES_ON_BL * length_px,
                ],
            });
        }
        rest = below;
    }
    ledges
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::flock::{Params, synthetic};
    use crate::geometry::Rect;

    #[test]
    fn ledges_bridge_small_gaps_and_keep_heights_apart() {
        let footholds = vec![[0.0, 100.0], [60.0, 103.0], [300.0, 101.0], [10.0, 40.0]];
        let found = ledges(footholds, 100.0);
        let ledge = |y_px, ends_px| Ledge { y_px, ends_px };
        assert_eq!(
            found,
            [
                ledge(40.0, [-10.0, 30.0]),
                ledge(101.5, [-20.0, 80.0]),
                ledge(101.0, [280.0, 320.0]),
            ]
        );
    }

    /// Returns the side-view library with feet at these heights, pixels, by frame.
    fn with_feet(foot_px: impl Fn(usize) -> f64) -> (Library, Lens) {
        let mut library = synthetic::library(View::Side);
        for (frame, pose) in library.poses.frames.iter_mut().enumerate() {
            let bottom = foot_px(frame) as u32;
            pose.centroid_px = Some([100.0 + (frame % 50) as f64, f64::from(bottom) - 12.0]);
            pose.box_px = Some(Rect {
                x: 90,
                y: bottom - 24,
                w: 20,
                h: 24,
            });
        }
        let lens = Lens::new(&library, &Params::default());
        (library, lens)
    }

    #[test]
    fn a_percher_is_carried_between_its_flights_and_a_swimmer_never() {
        // Sits for two seconds on each of two perches, and flies for one second.
        let perch = |frame: usize| match frame % 180 {
            t @ 0..60 => (100.0, t),
            t @ 60..90 => (100.0 + 2.0 * (t - 60) as f64, t),
            t @ 90..150 => (160.0, t),
            t => (160.0 - 2.0 * (t - 150) as f64, t),
        };
        let (library, lens) = with_feet(|frame| perch(frame).0);
        let support = Support::new(&library, &lens).expect("it sits most of the time");
        assert_eq!(support.foot_px(30), Some(12.0));
        assert_eq!(support.foot_px(75), None, "in flight");
        assert!(
            support
                .landing(30)
                .is_some_and(|frame| (85..100).contains(&frame))
        );
        let [dx, dy] = support.way_px([120.0, 157.0]);
        assert!(dx == 0.0 && (dy - 3.0).abs() < 1.5, "{dx} {dy}");
        let swimmer = with_feet(|frame| 120.0 + 40.0 * libm::sin(frame as f64 / 20.0));
        assert!(Support::new(&swimmer.0, &swimmer.1).is_none());
        let (mut from_above, lens) = with_feet(|_| 100.0);
        from_above.poses.view = View::Top;
        assert!(Support::new(&from_above, &lens).is_none());
    }

    #[test]
    fn as_many_stand_as_ledges_have_room_for() {
        let (library, lens) = with_feet(|_| 100.0);
        let support = Support::new(&library, &lens).expect("it stands");
        // 49 px of footholds, and 0.2 body lengths of 40 px beyond either end.
        assert_eq!(support.capacity(30.0), 3);
        assert_eq!(support.capacity(200.0), 1);
    }
}
