//! Search for the frames that an individual shows in a segment, by where they lead.
//!
//! The place of an animal is the sum of the filmed steps of the frames shown, so frames are chosen together
//! with their places. A beam search keeps the cheapest beginnings of a segment, frame after frame. The cost of
//! a beginning is that of its frames and jumps, as in other plans, and that of its places (`places`).

mod moves;

use super::places::{Place, Surroundings, World};
use super::steps::Trajectory;
use crate::flock::individual::BoidTrack;
use crate::flock::placement::Placer;
use crate::flock::plan::Model;
use crate::flock::plan::cost::Feature;
use crate::geometry::{Turns, rounded, wrap_rad};
use crate::library::View;

/// Number of beginnings kept at each frame in a flock of up to 64 individuals, and in the largest. Free
/// choices.
const WIDTHS: [usize; 2] = [32, 8];
/// Side of the cells, body lengths, and number of headings to a radian, within which two beginnings that show
/// nearly the same frame count as one. Free choices.
const CELL_BL: f64 = 0.3;
const HEADINGS_PER_RAD: f64 = 6.0;
/// Number of entries of the table of cells. Two cells with the same entry count as one.
const N_ENTRIES: usize = 1 << 10;
/// Number of frames with which a walk may begin, spread over the film. Free choice.
const N_STARTS: usize = 512;
/// Top view: time between two choices of the steering, seconds. Free choice.
const STEERING_S: f64 = 0.2;
/// Top view: cost of turning by a radian more than filmed, radians. Free choice.
const COST_OF_STEERING: f64 = 1.0;
/// Time after the segment within which walls still count, seconds. Free choice.
const AHEAD_S: f64 = 0.8;
/// Side view: time constants with which place and rotation follow the boid, seconds. Free choices.
const PULL_S: f64 = 0.5;
const ROTATION_S: f64 = 0.15;

/// Boid and surroundings of an individual at a frame.
pub(super) struct Moment {
    wanted: Feature,
    heading_rad: f64,
    depth_bl: f64,
    around: Surroundings,
    /// State and distance in the image, body lengths, of each animal nearby whose frame is known.
    shown_near: Vec<(u32, [f64; 2])>,
}

/// Frame and place of an individual.
#[derive(Clone, Copy, Debug)]
pub(super) struct Node {
    state: u32,
    /// Number of frames since the last jump, at most the dwell.
    since: u32,
    heading_rad: f64,
    centroid_px: [f64; 2],
    /// Top view: whether the individual turns left (-1) or right (1) beside the filmed turns.
    steering: i8,
    /// Distance beyond the walls, body lengths; negative inside.
    beyond_bl: f64,
    is_clipped: bool,
    /// Cost up to this frame, and of what lies ahead, in turns.
    cost: u64,
    ahead: u64,
    /// Index of the node before.
    parent: u32,
}

impl Node {
    /// Returns the node before a segment. `since` is the number of frames since the last jump.
    pub(super) fn new(state: u32, since: usize, heading_rad: f64, centroid_px: [f64; 2]) -> Node {
        Node {
            state,
            since: since as u32,
            heading_rad,
            centroid_px,
            steering: 0,
            beyond_bl: 0.0,
            is_clipped: false,
            cost: 0,
            ahead: 0,
            parent: 0,
        }
    }
}

/// Frames and places of an individual over a segment.
#[derive(Clone, Debug, Default)]
pub(super) struct Walk {
    pub(super) states: Vec<u32>,
    pub(super) trajectory: Trajectory,
    /// Number of steps that ended at a wall.
    pub(super) n_clipped: usize,
}

/// Animal beside which another one walks: its places, and its states if they are known.
pub(super) struct Other<'a> {
    pub(super) places_px: &'a [[f64; 2]],
    pub(super) states: Option<&'a [u32]>,
}

/// Search for the walks of one individual.
pub(super) struct Walker<'a> {
    model: &'a Model,
    world: World<'a>,
    placer: &'a Placer<'a>,
    /// Number of beginnings kept at each frame.
    width: usize,
    /// Size of the individual relative to the filmed animal.
    size: f64,
    /// Top view: cost of a frame for each radian between the headings of the individual and its boid.
    course_weight: f64,
    /// Shares by which place and rotation follow the boid at each frame.
    pull: f64,
    follow: f64,
}

impl<'a> Walker<'a> {
    /// Returns the search for an individual of a flock of `n`.
    pub(super) fn new(model: &'a Model, world: World<'a>, size: f64, n: usize) -> Walker<'a> {
        let placer = world.placer;
        let share = |time_s: f64| 1.0 - libm::exp(-1.0 / (time_s * placer.library.poses.fps));
        let params = placer.params;
        let course_weight = match placer.library.poses.view {
            View::Top => params.rules.sociality.unwrap_or(1.0) * params.matching.w_h,
            View::Side => 0.0,
        };
        Walker {
            model,
            world,
            placer,
            course_weight,
            width: (WIDTHS[0] * 64 / n.max(1)).clamp(WIDTHS[1], WIDTHS[0]),
            size,
            pull: share(PULL_S),
            follow: share(ROTATION_S),
        }
    }

    /// Returns what the individual finds at each frame.
    pub(super) fn moments(&self, boid: &BoidTrack, others: &[Other]) -> Vec<Moment> {
        let length_px = self.placer.lens.length_px;
        let wanted = self.model.wanted(boid).into_iter().enumerate();
        wanted
            .map(|(t, wanted)| {
                let [x, y, behind_px] = boid.position_px[t];
                let depth_bl = self.placer.depth_bl(behind_px);
                let places = others.iter().map(|other| other.places_px[t]);
                let shown = others.iter().filter_map(|other| {
                    let [ox, oy] = other.places_px[t];
                    let off_bl = [ox - x, oy - y].map(|px| px / length_px);
                    Some((other.states?[t], off_bl))
                });
                Moment {
                    wanted,
                    heading_rad: boid.heading_rad[t],
                    depth_bl,
                    around: self.world.around([x, y], depth_bl, places),
                    shown_near: shown
                        .filter(|(_, off)| self.model.crowd_cost(*off) > 0)
                        .collect(),
                }
            })
            .collect()
    }

    /// Returns the cheapest walk found through `moments`, after the frame `start` or from any frame. `first` is
    /// the number of the first frame. Returns `None` if playback cannot continue.
    pub(super) fn walk(
        &self,
        start: Option<Node>,
        moments: &[Moment],
        first: usize,
    ) -> Option<Walk> {
        let (begun, rest) = match start {
            Some(start) => (vec![Self::among_walls(start, moments.first()?)], moments),
            None => (self.starts(moments.first()?), &moments[1..]),
        };
        let mut table = vec![u32::MAX; N_ENTRIES];
        let mut columns: Vec<Vec<Node>> = vec![self.pruned(begun, &mut table, u32::MAX - 1)];
        let every = ((STEERING_S * self.placer.library.poses.fps).round() as usize).max(1);
        for (t, moment) in rest.iter().enumerate() {
            let steers = (first + t).is_multiple_of(every);
            let mut nodes = Vec::new();
            for (parent, before) in columns[t].iter().enumerate() {
                self.expand(before, parent as u32, moment, steers, &mut nodes);
            }
            columns.push(self.pruned(nodes, &mut table, t as u32));
        }
        let last = columns.last()?;
        let mut at = (0..last.len()).min_by_key(|&k| last[k].cost + last[k].ahead)?;
        let mut nodes = Vec::with_capacity(columns.len());
        for column in columns.iter().rev() {
            nodes.push(column[at]);
            at = column[at].parent as usize;
        }
        nodes.truncate(moments.len());
        nodes.reverse();
        Some(Walk {
            states: nodes.iter().map(|node| node.state).collect(),
            trajectory: Trajectory {
                heading_rad: nodes.iter().map(|node| node.heading_rad).collect(),
                centroid_px: nodes.iter().map(|node| node.centroid_px).collect(),
            },
            n_clipped: nodes.iter().filter(|node| node.is_clipped).count(),
        })
    }

    /// Returns the nodes with which a walk may begin: frames from which playback can continue. It begins
    /// at its boid in a school that has room to form, else at the filmed place.
    fn starts(&self, moment: &Moment) -> Vec<Node> {
        let placer = self.placer;
        let is_social = placer.params.rules.sociality != Some(0.0);
        let forms = is_social && self.world.radius_scale >= 1.0;
        let n_states = self.model.trellis.n_states();
        let states = (0..n_states as u32).filter(|&state| self.model.is_endless(state));
        let node = |state| {
            let shown = self.model.trellis.shown(state as usize)?;
            let rotation = match placer.library.poses.view {
                View::Top if !forms => 0.0,
                View::Top | View::Side => placer.rotation(shown, moment.heading_rad),
            };
            let heading_rad = rounded(wrap_rad(placer.source_heading(shown) + rotation), 5);
            let scale = placer.scale(shown.0, moment.depth_bl, self.size);
            let place = match self.world.home_px(shown.0, scale) {
                Some(home) => home,
                None if forms => moment.around.goal_px,
                None => placer.library.poses.frames[shown.0 as usize].centroid_px?,
            };
            let place = place.map(|px| rounded(px, 2));
            let node = Node::new(state, self.model.dwell, heading_rad, place);
            let node = Self::among_walls(node, moment);
            Some(self.settled(node, moment, 0))
        };
        states
            .step_by(n_states.div_ceil(N_STARTS))
            .filter_map(node)
            .collect()
    }

    /// Returns a node with its distance from the walls.
    fn among_walls(node: Node, moment: &Moment) -> Node {
        let beyond_bl = moment.around.beyond_bl(node.centroid_px);
        Node { beyond_bl, ..node }
    }

    /// Adds the nodes that may follow a node.
    fn expand(
        &self,
        before: &Node,
        parent: u32,
        moment: &Moment,
        steers: bool,
        nodes: &mut Vec<Node>,
    ) {
        let (model, dwell) = (self.model, self.model.dwell as u32);
        let next = before.state + 1;
        let goes_on = model.trellis.continues(before.state as usize, 1) && model.is_endless(next);
        let on = goes_on.then_some((next, 0, (before.since + 1).min(dwell)));
        let jumps = if before.since >= dwell {
            model.jumps_from(before.state)
        } else {
            &[]
        };
        let jumps = jumps.iter().map(|&(state, cost)| (state, cost, 1));
        for (state, jump, since) in on.into_iter().chain(jumps) {
            let steerings = match self.placer.library.poses.view {
                View::Top if steers => -1..=1,
                View::Top | View::Side => before.steering..=before.steering,
            };
            for steering in steerings {
                let node = Node {
                    state,
                    since,
                    steering,
                    parent,
                    ..*before
                };
                let moved = self.moved(before, node, moment);
                nodes.extend(moved.map(|node| self.settled(node, moment, jump)));
            }
        }
    }

    /// Returns a node with the cost of its frame and its place added.
    fn settled(&self, node: Node, moment: &Moment, jump: u32) -> Node {
        let model = self.model;
        let Some((frame, _)) = model.trellis.shown(node.state as usize) else {
            return node;
        };
        // Boids do not know what carries an animal, so it takes only their speed.
        let [heading, speed] = model.match_costs(moment.wanted, node.state);
        let heading = if self.world.support.is_some() {
            0
        } else {
            heading
        };
        let alike = moment
            .shown_near
            .iter()
            .filter(|(state, _)| model.looks_alike(*state, node.state));
        let alike: u32 = alike.map(|&(_, off_bl)| model.crowd_cost(off_bl)).sum();
        let place = Place {
            frame,
            centroid_px: node.centroid_px,
            scale: self.placer.scale(frame, moment.depth_bl, self.size),
        };
        let steered_rad = self.steered_rad(&node, frame).abs();
        let rad = self.world.cost(place, node.beyond_bl, &moment.around)
            + COST_OF_STEERING * steered_rad
            + self.course_weight * wrap_rad(node.heading_rad - moment.heading_rad).abs();
        let turns = heading + speed + jump + alike;
        let cost = node.cost + u64::from(turns) + (rad * Turns::PER_RAD) as u64;
        let ahead = u64::from(model.future(node.state)) + self.cost_ahead(&node, place, moment);
        Node {
            cost,
            ahead,
            ..node
        }
    }

    /// Returns the cost of where a walk would go on from a place, in turns.
    fn cost_ahead(&self, node: &Node, place: Place, moment: &Moment) -> u64 {
        let (placer, fps) = (self.placer, self.placer.library.poses.fps);
        let speed = place.scale * placer.motion[place.frame as usize].speed_bl_per_s;
        let ahead_px = AHEAD_S * speed * placer.lens.length_px;
        let along = [libm::cos(node.heading_rad), libm::sin(node.heading_rad)];
        let ahead = along.map(|part| ahead_px * part);
        let rad = self.world.cost_ahead(place, ahead, &moment.around);
        (0.5 * AHEAD_S * fps * rad * Turns::PER_RAD) as u64
    }

    /// Returns the cheapest nodes that differ in frame, place or heading, cheapest first. `table` remembers
    /// cells by `stamp`, which must differ at each call.
    fn pruned(&self, mut nodes: Vec<Node>, table: &mut [u32], stamp: u32) -> Vec<Node> {
        // In top view steering avoids what lies ahead.
        let foresees = u64::from(self.placer.library.poses.view == View::Side);
        nodes.sort_unstable_by_key(|node| {
            let rank = node.cost + foresees * node.ahead;
            (rank, node.state, node.parent, node.steering)
        });
        let cell_px = CELL_BL * self.placer.lens.length_px;
        let mut n_kept = 0;
        nodes.retain(|node| {
            if n_kept == self.width {
                return false;
            }
            let [x, y] = node.centroid_px.map(|px| (px / cell_px).floor() as i64);
            let heading = (node.heading_rad * HEADINGS_PER_RAD).floor() as i64;
            let parts = [i64::from(node.state / 2), x, y, heading];
            let hash = parts.iter().fold(0u64, |hash, &part| {
                (hash ^ part as u64)
                    .wrapping_mul(0x9e37_79b9_7f4a_7c15)
                    .rotate_left(29)
            });
            let entry = &mut table[hash as usize % N_ENTRIES];
            let is_new = *entry != stamp;
            *entry = stamp;
            n_kept += usize::from(is_new);
            is_new
        });
        nodes
    }
}
