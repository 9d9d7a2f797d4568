//! Move of an individual from one frame to the next: the filmed step and turn, with the steering or the small
//! correction that the view allows.

use super::{Moment, Node, Walker};
use crate::flock::follow::places::{MAX_BEYOND_BL, Place};
use crate::flock::placement::is_jump;
use crate::geometry::{rounded, wrap_rad};
use crate::library::View;

/// Side view: largest correction of a step, as a share of its length. It stays below the quarter up to which
/// `bench/flocks.py` counts shown and filmed speeds as equal.
const MAX_CORRECTION_SHARE: f64 = 0.2;
/// A hovering animal has short steps although it moves. The mean speed around the frame then sets the limit
/// of the correction, up to this speed, body lengths per second. Free choice.
const HOVERING_BL_PER_S: f64 = 0.2;

impl Walker<'_> {
    /// Returns `node` moved by its filmed step from `before`. `None` for a barrier.
    pub(super) fn moved(&self, before: &Node, mut node: Node, moment: &Moment) -> Option<Node> {
        let placer = self.placer;
        let from = self.model.trellis.shown(before.state as usize)?;
        let to = self.model.trellis.shown(node.state as usize)?;
        let scale = placer.scale(to.0, moment.depth_bl, self.size);
        let is_side = placer.library.poses.view == View::Side;
        let heading = if is_side {
            self.followed_rad(before, from, to, moment)
        } else {
            before.heading_rad + placer.filmed_turn_rad(from, to) + self.steered_rad(&node, to.0)
        };
        node.heading_rad = rounded(wrap_rad(heading), 5);
        let mut step = placer.shown_step_px(from, to, node.heading_rad, scale);
        if is_jump(from, to) {
            // A foot that stays on its ledge keeps its height.
            let feet = self
                .world
                .support
                .and_then(|support| support.foot_px(from.0).zip(support.foot_px(to.0)));
            step[1] = feet.map_or(step[1], |(from_px, to_px)| scale * (from_px - to_px));
        }
        let mut place = [0, 1].map(|axis| before.centroid_px[axis] + step[axis]);
        if is_side {
            let stepped = Place {
                frame: to.0,
                centroid_px: place,
                scale,
            };
            let correction = self.correction_px(&node, stepped, step, moment);
            place = [0, 1].map(|axis| place[axis] + correction[axis]);
        }
        let last = before.beyond_bl;
        node.beyond_bl = moment.around.beyond_bl(place);
        node.is_clipped = node.beyond_bl > MAX_BEYOND_BL.max(last);
        if node.is_clipped {
            let share = ((MAX_BEYOND_BL - last) / (node.beyond_bl - last)).clamp(0.0, 1.0);
            node.beyond_bl = MAX_BEYOND_BL.max(last);
            let along = |axis: usize| {
                before.centroid_px[axis] + share * (place[axis] - before.centroid_px[axis])
            };
            place = [0, 1].map(along);
        }
        node.centroid_px = place.map(|px| rounded(px, 2));
        Some(node)
    }

    /// Returns the heading in side view: that of the frame, rotated smoothly toward the boid, radians.
    fn followed_rad(
        &self,
        before: &Node,
        from: (u32, bool),
        to: (u32, bool),
        moment: &Moment,
    ) -> f64 {
        let placer = self.placer;
        let last = if is_jump(from, to) {
            placer.rotation(to, before.heading_rad)
        } else {
            wrap_rad(before.heading_rad - placer.source_heading(from))
        };
        let wanted = placer.rotation(to, moment.heading_rad);
        placer.source_heading(to) + last + self.follow * (wanted - last)
    }

    /// Returns the turn by steering, radians. An animal at rest is not turned.
    pub(super) fn steered_rad(&self, node: &Node, frame: u32) -> f64 {
        let (placer, speed) = (
            self.placer,
            self.placer.motion[frame as usize].speed_bl_per_s,
        );
        let share = (speed / placer.calibration.cruise_bl_per_s).min(1.0);
        let most_rad = placer.calibration.turn_rad_per_s / placer.library.poses.fps;
        f64::from(node.steering) * share * most_rad
    }

    /// Returns the correction of a step in side view, pixels: toward the boid, or toward the filmed place of
    /// an animal that is carried. Right after a jump such an animal may hop there.
    fn correction_px(
        &self,
        node: &Node,
        place: Place,
        step: [f64; 2],
        moment: &Moment,
    ) -> [f64; 2] {
        let placer = self.placer;
        let px_per_frame = place.scale * placer.lens.length_px / placer.library.poses.fps;
        let hovering_px = placer.speed_around(place.frame).min(HOVERING_BL_PER_S) * px_per_frame;
        let mut most_px = MAX_CORRECTION_SHARE * step[0].hypot(step[1]).max(hovering_px);
        let home = self.world.home_px(place.frame, place.scale);
        let (goal, share) = home.map_or((moment.around.goal_px, self.pull), |home| (home, 1.0));
        if home.is_some() && node.since <= placer.params.fade_frames {
            most_px = placer.calibration.speed_limits_bl_per_s[1] * px_per_frame;
        }
        let off = [0, 1].map(|axis| share * (goal[axis] - place.centroid_px[axis]));
        let share = (most_px / off[0].hypot(off[1]).max(1e-9)).min(1.0);
        off.map(|px| share * px)
    }
}
