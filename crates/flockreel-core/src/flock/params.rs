//! Parameters of a flock, with defaults, limits and presets (docs/explanation/algorithms.md, "Planning" and
//! "Placement").
//!
//! The steering parameters are in `boids/params.rs`, those of the video in `composite/params.rs`. The preset
//! `papers` reproduces the method of Okabe et al.

use std::ops::RangeInclusive;

use serde::{Deserialize, Serialize};
use smart_default::SmartDefault;
use utoipa::ToSchema;

pub use super::boids::params::{Goal, Obstacle, Predator, Rules, Zones};
use super::composite::params::Render;
use crate::parameters::Parameters;

/// Parameters of a flock. All have defaults.
#[derive(Clone, Debug, PartialEq, SmartDefault, Serialize, Deserialize, ToSchema)]
#[schema(as = FlockParams)]
#[serde(default, deny_unknown_fields)]
pub struct Params {
    /// Number of individuals. null = as many as the tank has room for, but 2 to 20.
    #[schema(minimum = 1, maximum = 10000)]
    pub count: Option<u32>,
    /// Length of the video in frames, at most 10,000 without `position: film`. `count` times `frames` is at
    /// most 4,000,000.
    #[default = 400]
    #[schema(minimum = 1, maximum = 1000000)]
    pub frames: u32,
    /// Random seed. The same input, parameters and seed give the same flock.
    #[default = 1]
    pub seed: u64,
    /// Steering of the boids.
    pub rules: Rules,
    /// Target of the mean distance to the nearest neighbor in the image, body lengths. The separation
    /// radii are scaled until the flock keeps it, as far as the tank has room. null = no target.
    #[schema(minimum = 0.2, maximum = 10)]
    pub spacing_bl: Option<f64>,
    /// Whether the last frame leads into the first, so that the video repeats without a visible cut. A loop
    /// has 30 to 5000 frames. It refuses `position: papers`, and treats `position: film` as `leash`.
    #[serde(rename = "loop")]
    pub is_loop: bool,
    /// Matching of source frames to boids.
    pub matching: Matching,
    /// Minimum number of frames between two jumps. null = the clip length. 1 = no minimum.
    #[schema(minimum = 1, maximum = 120)]
    pub dwell_frames: Option<u32>,
    /// Length of the cross-fade at a jump in frames, an even number. 0 = a hard cut.
    #[default = 4]
    #[schema(minimum = 0, maximum = 16, multiple_of = 2)]
    pub fade_frames: u32,
    /// Whether sprites may be shown mirrored left to right.
    #[default = true]
    pub mirror: bool,
    /// Spread of body size. At 0.05 each individual is drawn at a random scale of 0.95 to 1.05 times
    /// the filmed size. With `position: film` its steps are scaled by the same factor. Loops always use 0.
    #[default = 0.05]
    #[schema(minimum = 0, maximum = 0.3)]
    pub variation: f64,
    /// Rule of separation: `repulsion`, or `papers` (rule A of Okabe et al.).
    #[default(Separation::Repulsion)]
    pub separation: Separation,
    /// How an individual follows its boid: `film` by the filmed steps, `leash` near the boid, `boid` at its
    /// position, `papers` by the sum of its speeds (Okabe et al.).
    #[default(Position::Film)]
    pub position: Position,
    /// Whether boids at the edge of the flock may lead it for 1 to 3 seconds (Hartman & Benes 2006).
    #[default = true]
    pub leaders: bool,
    /// Area in which the flock may move: `seen`, where the animal was seen, or `picture`, the whole image.
    #[default(TankExtent::Seen)]
    pub tank: TankExtent,
    /// Positions that attract the flock.
    #[schema(max_items = 64)]
    pub goals: Vec<Goal>,
    /// Obstacles that the flock avoids.
    #[schema(max_items = 64)]
    pub obstacles: Vec<Obstacle>,
    /// Predator that the flock flees from. null = none.
    pub predator: Option<Predator>,
    /// Depth of the tank in side view, body lengths. null = the range of depths of the filmed animal, but 1
    /// to 6. 0 = boids move in the image plane. Top view ignores it.
    #[schema(minimum = 0, maximum = 100)]
    pub depth_bl: Option<f64>,
    /// Drawing and encoding of the video.
    pub render: Render,
}

/// Weights by which source frames are matched to boids (docs/explanation/algorithms.md, "Planning").
#[derive(Clone, Debug, PartialEq, SmartDefault, Serialize, Deserialize, ToSchema)]
#[serde(default, deny_unknown_fields)]
pub struct Matching {
    /// Quantity by which film frames are chosen for a boid: `heading` in the image, `direction` in space, or
    /// `position` (velocity in the image).
    #[default(MatchBy::Heading)]
    pub by: MatchBy,
    /// Weight of the heading error that rotation cannot correct, per radian. Top view instead compares how
    /// far animal and boid turn in 0.25 s.
    #[default = 1.0]
    #[schema(minimum = 0, maximum = 4)]
    pub w_h: f64,
    /// Weight of differences along the line of sight with `by: direction`. 1 = they count as much as those in
    /// the image plane. A wrong foreshortening is harder to see than a wrong heading.
    #[default = 0.3]
    #[schema(minimum = 0, maximum = 1)]
    pub w_d: f64,
    /// Weight of the rotation of a sprite in side view, per radian.
    #[default = 0.1]
    #[schema(minimum = 0, maximum = 4)]
    pub w_r: f64,
    /// Largest rotation of a sprite in side view, degrees. Top view allows any rotation.
    #[default = 10.0]
    #[schema(minimum = 0, maximum = 45)]
    pub rho_deg: f64,
    /// Weight of the speed error: the difference between the logarithms of the speeds of animal and boid.
    #[default = 0.3]
    #[schema(minimum = 0, maximum = 4)]
    pub w_v: f64,
    /// Cost of a jump whose distance D equals epsilon, radians. The cost is proportional to D.
    #[default = 2.4]
    #[schema(minimum = 0, maximum = 4)]
    pub wx: f64,
    /// Cost of showing nearly the same frame as a neighbor, radians at distance 0. The cost falls with
    /// distance and adds up over neighbors.
    #[default = 0.6]
    #[schema(minimum = 0, maximum = 4)]
    pub w_c: f64,
    /// Cost of a jump back by at most 1.3 s, radians for each frame that it goes back. Such a jump repeats
    /// what was just shown.
    #[default = 0.3]
    #[schema(minimum = 0, maximum = 4)]
    pub w_p: f64,
    /// Length of a segment in frames. null = 3 s. With `position: film` a flock is simulated, planned and
    /// placed one segment after the other. Each boid starts a segment at the position of its animal.
    #[schema(minimum = 2, maximum = 2000)]
    pub segment_frames: Option<u32>,
}

/// Quantity by which source frames are matched to boids.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum MatchBy {
    /// Heading in the image and speed, as Okabe et al. propose. In top view, turn rate and speed.
    Heading,
    /// Direction in space and speed. Headings in the image then match less well. The error is the chord
    /// between two unit vectors. If the library has no directions in space, toward the viewer and away from
    /// it count as equal. Without depth, `heading` is used instead.
    Direction,
    /// Velocity in the image, frame by frame (Colqui et al. 2008). `w_h` is then the cost of a difference of
    /// one body length per second along each image axis. The plan ignores `w_r`, `rho_deg` and `w_v`.
    Position,
}

/// Rule by which boids keep apart.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum Separation {
    /// Near boids push each other apart.
    Repulsion,
    /// Rule A of Okabe et al., section 4: slow down when ahead of neighbors, speed up when behind, align.
    Papers,
}

/// How an individual follows its boid.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum Position {
    /// Moves by the filmed steps of the frames shown, each corrected toward the boid by at most a fifth of
    /// its length. Boids take their speeds from the footage. A loop uses `leash` instead.
    Film,
    /// Moves at the speed of the boid along the shown heading. It is drawn gently to the boid and stays
    /// within half a body length of it.
    Leash,
    /// Takes the position of the boid.
    Boid,
    /// Moves at the speed of the boid along the shown heading (Okabe et al., section 5.2). Without correction
    /// it may drift away from the boid.
    Papers,
}

/// Area in which the flock may swim.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum TankExtent {
    /// The area in which the animal was seen. If the flock lacks room, the area grows. In top view it grows
    /// as far as the background looks like the floor, in side view up to 70 % of the image.
    Seen,
    /// The whole image.
    Picture,
}

/// Largest product of individuals and frames. Memory and `flock.json` hold some hundred bytes for each
/// individual and frame.
const MAX_SHOWN: u64 = 4_000_000;
/// Largest number of individuals when `count` is null. Free choice.
pub(super) const MOST_BY_DEFAULT: u32 = 20;

impl Params {
    /// Returns the plain objective of Okabe et al.: heading error only, no mirroring, no rotation, hard cuts,
    /// and rule A. Positions are sums of boid speeds in the image plane.
    pub fn papers() -> Params {
        Params {
            matching: Matching {
                by: MatchBy::Heading,
                w_h: 1.0,
                w_d: 1.0,
                w_r: 0.0,
                rho_deg: 0.0,
                w_v: 0.0,
                wx: 0.0,
                w_c: 0.0,
                w_p: 0.0,
                segment_frames: None,
            },
            dwell_frames: Some(1),
            fade_frames: 0,
            mirror: false,
            variation: 0.0,
            separation: Separation::Papers,
            position: Position::Papers,
            leaders: false,
            tank: TankExtent::Picture,
            depth_bl: Some(0.0),
            ..Params::default()
        }
    }

    /// Returns `count`, or the largest default number if `count` is null.
    pub fn most_individuals(&self) -> u32 {
        self.count.unwrap_or(MOST_BY_DEFAULT)
    }
}

impl Parameters for Params {
    const PRESETS: &'static [&'static str] =
        &["school", "swarm", "mill", "scatter", "zonal", "papers"];

    /// `school` has all defaults, but `sociality` 1.
    fn preset(name: &str) -> Option<Params> {
        let with_rules = |rules| Params {
            rules,
            ..Params::default()
        };
        match name {
            "school" => Some(with_rules(Rules {
                sociality: Some(1.0),
                ..Rules::default()
            })),
            "swarm" => Some(with_rules(Rules {
                sociality: Some(1.0),
                alignment: 0.0,
                // With more cohesion, boids in a narrow tank swim back and forth together.
                cohesion: 0.4,
                wander: 2.5,
                ..Rules::default()
            })),
            "mill" => Some(with_rules(Rules {
                circling: 1.5,
                alignment: 0.0,
                cohesion: 0.0,
                ..Rules::default()
            })),
            "scatter" => Some(with_rules(Rules {
                separation: 2.5,
                alignment: 0.0,
                cohesion: 0.0,
                wander: 1.0,
                separation_bl: 3.0,
                ..Rules::default()
            })),
            "zonal" => Some(with_rules(Rules {
                zones: Some(Zones::default()),
                neighbors: 256,
                ..Rules::default()
            })),
            "papers" => Some(Params::papers()),
            _ => None,
        }
    }

    fn check_combinations(&self) -> Result<(), String> {
        if self.position != Position::Film {
            check_frames("frames without position film", self.frames, 1..=10_000)?;
        }
        let n_shown = u64::from(self.most_individuals()) * u64::from(self.frames);
        if n_shown > MAX_SHOWN {
            return Err(format!(
                "count times frames must be at most {MAX_SHOWN}: {n_shown}"
            ));
        }
        if self.is_loop {
            check_frames("frames of a loop", self.frames, 30..=5000)?;
            if self.position == Position::Papers {
                return Err(
                    "position must not be papers in a loop: that placement never returns to its start".into(),
                );
            }
        }
        self.render.check_combinations()?;
        self.goals.iter().try_for_each(Goal::check)?;
        self.obstacles.iter().try_for_each(Obstacle::check)?;
        self.predator.iter().try_for_each(Predator::check)
    }
}

fn check_frames(name: &str, frames: u32, limits: RangeInclusive<u32>) -> Result<(), String> {
    if limits.contains(&frames) {
        return Ok(());
    }
    let (min, max) = limits.into_inner();
    Err(format!("{name} must lie in {min}..={max}: {frames}"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_preset_passes_the_check() {
        for name in Params::PRESETS {
            let params = Params::preset(name).expect("a listed preset exists");
            assert_eq!(params.check(), Ok(()), "{name}");
        }
        assert_eq!(Params::preset("herd"), None);
    }

    fn shown(count: u32, frames: u32) -> Params {
        Params {
            count: Some(count),
            frames,
            ..Params::default()
        }
    }

    #[test]
    fn number_of_frames_is_limited_by_count_and_position() {
        for (count, frames) in [(2000, 2000), (400, 10_000), (20, 200_000)] {
            assert_eq!(shown(count, frames).check(), Ok(()), "{count} {frames}");
        }
        let sentence = "count times frames must be at most 4000000: 20000000";
        assert_eq!(shown(2000, 10_000).check(), Err(sentence.into()));
        let leash = Params {
            position: Position::Leash,
            ..shown(20, 200_000)
        };
        let sentence = "frames without position film must lie in 1..=10000: 200000";
        assert_eq!(leash.check(), Err(sentence.into()));
    }

    #[test]
    fn errors_name_the_parameter_its_limits_and_its_value() {
        let sentence = "count must lie in 1..=10000: 0";
        assert_eq!(shown(0, 400).check(), Err(sentence.into()));
        let mut params = Params::default();
        params.rules.picture_separation_bl = -1.0;
        let sentence = "rules.picture_separation_bl must lie in 0..=50: -1";
        assert_eq!(params.check(), Err(sentence.into()));
    }

    #[test]
    fn numbers_that_are_not_finite_are_refused() {
        let mut params = Params::default();
        params.matching.wx = f64::NAN;
        assert_eq!(params.check(), Err("all numbers must be finite".into()));
        let infinite = Params {
            spacing_bl: Some(f64::INFINITY),
            ..Params::default()
        };
        assert_eq!(infinite.check(), Err("all numbers must be finite".into()));
    }
}
