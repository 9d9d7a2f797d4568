//! Parameters of a flock: defaults, ranges and presets (docs/explanation/algorithms.md, "Planning" and
//! "Placement").
//!
//! The steering parameters are in `boids/params.rs`, those of the video in `composite/params.rs`. The preset
//! `papers` reproduces the method of Okabe et al.

use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

pub use super::boids::params::{Goal, Obstacle, Predator, Rules, Zones};
use super::composite::params::Render;

/// Parameters of a flock. All have defaults.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
#[schema(as = FlockParams)]
#[serde(default, deny_unknown_fields)]
pub struct Params {
    /// Number of individuals, 1..=10000. null = as many as the tank has room for, limited to 2..=20.
    pub count: Option<u32>,
    /// Length of the video in frames: 1..=1000000 with `position: film`, else 1..=10000. `count` times
    /// `frames` is at most 4,000,000.
    pub frames: u32,
    /// Random seed. The same input, parameters and seed give the same flock.
    pub seed: u64,
    /// Steering of the boids.
    pub rules: Rules,
    /// Target of the mean distance to the nearest neighbor in the image, body lengths, 0.2..=10. The
    /// separation radii are scaled until the flock keeps it, as far as the tank has room. null = no target.
    pub spacing_bl: Option<f64>,
    /// Whether the last frame leads into the first, so that the video repeats without a seam. A loop has
    /// 30..=5000 frames, excludes `position: papers`, and treats `position: film` as `leash`.
    #[serde(rename = "loop")]
    pub is_loop: bool,
    /// Matching of source frames to boids.
    pub matching: Matching,
    /// Minimum number of frames between two jumps, 1..=120. null = the clip length. 1 = no minimum.
    pub dwell_frames: Option<u32>,
    /// Length of the cross-fade at a jump in frames, even, 0..=16. 0 = a hard cut.
    pub fade_frames: u32,
    /// Whether sprites may be shown mirrored left to right.
    pub mirror: bool,
    /// Spread of body size, 0..=0.3. At 0.05 each individual is drawn at a random scale of 0.95 to 1.05 times
    /// the filmed size. With `position: film` its steps are scaled by the same factor. Loops always use 0.
    pub variation: f64,
    /// Rule of separation: repulsion, or rule A of Okabe et al.
    pub separation: Separation,
    /// How an individual follows its boid.
    pub position: Position,
    /// Whether boids at the edge of the flock may lead it for 1 to 3 seconds (Hartman & Benes 2006).
    pub leaders: bool,
    /// Area in which the flock may swim.
    pub tank: TankExtent,
    /// Positions that attract the flock, at most 64.
    pub goals: Vec<Goal>,
    /// Obstacles that the flock avoids, at most 64.
    pub obstacles: Vec<Obstacle>,
    /// Predator that the flock flees from. null = none.
    pub predator: Option<Predator>,
    /// Depth of the tank in side view, body lengths, 0..=100. null = the range of depths of the filmed
    /// animal, limited to 1..=6. 0 = boids move in the image plane. Top view ignores it.
    pub depth_bl: Option<f64>,
    /// Drawing and encoding of the video.
    pub render: Render,
}

/// Weights by which source frames are matched to boids, 0..=4 (docs/explanation/algorithms.md, "Planning").
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(default, deny_unknown_fields)]
pub struct Matching {
    /// Quantity that is matched.
    pub by: MatchBy,
    /// Weight of the heading error that rotation cannot correct, per radian. Top view instead compares how
    /// far animal and boid turn in 0.25 s.
    pub w_h: f64,
    /// Weight of differences along the line of sight with `by: direction`, 0..=1. 1 = they count as much as
    /// those in the image plane. A wrong foreshortening is harder to see than a wrong heading.
    pub w_d: f64,
    /// Weight of the rotation of a sprite in side view, per radian.
    pub w_r: f64,
    /// Largest rotation of a sprite in side view, degrees, 0..=45. Top view allows any rotation.
    pub rho_deg: f64,
    /// Weight of the speed error: the difference of log speed between animal and boid.
    pub w_v: f64,
    /// Cost of a jump whose distance D equals epsilon, radians. The cost is proportional to D.
    pub wx: f64,
    /// Cost of showing nearly the same frame as a neighbor, radians at distance 0. The cost falls with
    /// distance and adds up over neighbors.
    pub w_c: f64,
    /// Cost of a jump back by at most 1.3 s, radians for each frame that it goes back. Such a jump repeats
    /// what was just shown.
    pub w_p: f64,
    /// Length of a segment in frames, 2..=2000. null = 3 s. With `position: film` a flock is simulated,
    /// planned and placed segment by segment. Each boid starts a segment at the position of its animal.
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
const MOST_SHOWN: u64 = 4_000_000;
/// Largest number of individuals when `count` is null. Free choice.
pub(super) const MOST_BY_DEFAULT: u32 = 20;

impl Default for Matching {
    fn default() -> Matching {
        Matching {
            by: MatchBy::Heading,
            w_h: 1.0,
            w_d: 0.3,
            w_r: 0.1,
            rho_deg: 10.0,
            w_v: 0.3,
            wx: 1.2,
            w_c: 0.6,
            w_p: 0.3,
            segment_frames: None,
        }
    }
}

impl Default for Params {
    fn default() -> Params {
        Params {
            count: None,
            frames: 400,
            seed: 1,
            is_loop: false,
            rules: Rules::default(),
            spacing_bl: None,
            matching: Matching::default(),
            dwell_frames: None,
            fade_frames: 4,
            mirror: true,
            variation: 0.05,
            separation: Separation::Repulsion,
            position: Position::Film,
            leaders: true,
            tank: TankExtent::Seen,
            goals: Vec::new(),
            obstacles: Vec::new(),
            predator: None,
            depth_bl: None,
            render: Render::default(),
        }
    }
}

impl Params {
    /// Names that `preset` accepts.
    pub const PRESETS: [&'static str; 6] =
        ["school", "swarm", "mill", "scatter", "zonal", "papers"];

    /// Returns the parameters of a named preset, or `None` for an unknown name. `school` has all defaults.
    pub fn preset(name: &str) -> Option<Params> {
        let with_rules = |rules| Params {
            rules,
            ..Params::default()
        };
        match name {
            "school" => Some(Params::default()),
            "swarm" => Some(with_rules(Rules {
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

    /// Checks all ranges. The error message names the parameter, its range and its value.
    pub fn check(&self) -> Result<(), String> {
        within("count", f64::from(self.most_individuals()), 1.0, 10_000.0)?;
        let (most, what) = match self.position {
            Position::Film => (1e6, "frames"),
            _ => (1e4, "frames without position film"),
        };
        within(what, f64::from(self.frames), 1.0, most)?;
        let n_shown = u64::from(self.most_individuals()) * u64::from(self.frames);
        if n_shown > MOST_SHOWN {
            return Err(format!(
                "count times frames must be at most {MOST_SHOWN}: {n_shown}"
            ));
        }
        if let Some(spacing_bl) = self.spacing_bl {
            within("spacing_bl", spacing_bl, 0.2, 10.0)?;
        }
        if self.is_loop {
            within("frames of a loop", f64::from(self.frames), 30.0, 5000.0)?;
            if self.position == Position::Papers {
                return Err(
                    "position must not be papers in a loop: that placement never returns to its start".into(),
                );
            }
        }
        if let Some(dwell) = self.dwell_frames {
            within("dwell_frames", f64::from(dwell), 1.0, 120.0)?;
        }
        within("fade_frames", f64::from(self.fade_frames), 0.0, 16.0)?;
        if self.fade_frames % 2 == 1 {
            return Err(format!("fade_frames must be even: {}", self.fade_frames));
        }
        within("variation", self.variation, 0.0, 0.3)?;
        if let Some(depth_bl) = self.depth_bl {
            within("depth_bl", depth_bl, 0.0, 100.0)?;
        }
        self.render.check()?;
        self.rules.check()?;
        within("goals", self.goals.len() as f64, 0.0, 64.0)?;
        within("obstacles", self.obstacles.len() as f64, 0.0, 64.0)?;
        self.goals.iter().try_for_each(Goal::check)?;
        self.obstacles.iter().try_for_each(Obstacle::check)?;
        self.predator.iter().try_for_each(Predator::check)?;
        self.matching.check()
    }
}

impl Matching {
    fn check(&self) -> Result<(), String> {
        let weights = [
            ("matching.w_h", self.w_h),
            ("matching.w_r", self.w_r),
            ("matching.w_v", self.w_v),
            ("matching.wx", self.wx),
            ("matching.w_c", self.w_c),
            ("matching.w_p", self.w_p),
        ];
        for (name, value) in weights {
            within(name, value, 0.0, 4.0)?;
        }
        if let Some(frames) = self.segment_frames {
            within("matching.segment_frames", f64::from(frames), 2.0, 2000.0)?;
        }
        within("matching.w_d", self.w_d, 0.0, 1.0)?;
        within("matching.rho_deg", self.rho_deg, 0.0, 45.0)
    }
}

pub(super) fn within(name: &str, value: f64, least: f64, most: f64) -> Result<(), String> {
    (least..=most)
        .contains(&value)
        .then_some(())
        .ok_or(format!("{name} must lie in {least}..={most}: {value}"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_preset_passes_its_own_check() {
        for name in Params::PRESETS {
            let params = Params::preset(name).expect("a listed preset exists");
            assert_eq!(params.check(), Ok(()), "{name}");
        }
        assert_eq!(Params::preset("herd"), None);
    }

    #[test]
    fn what_is_out_of_range_is_named() {
        let no_one = Params {
            count: Some(0),
            ..Params::default()
        };
        assert_eq!(no_one.check(), Err("count must lie in 1..=10000: 0".into()));
        let of = |count, frames| Params {
            count: Some(count),
            frames,
            ..Params::default()
        };
        assert_eq!(of(2000, 2000).check(), Ok(()));
        assert_eq!(of(400, 10_000).check(), Ok(()));
        assert_eq!(of(20, 200_000).check(), Ok(()));
        let whole = Params {
            position: Position::Leash,
            ..of(20, 200_000)
        };
        let sentence = "frames without position film must lie in 1..=10000: 200000";
        assert_eq!(whole.check(), Err(sentence.into()));
        let crowd = of(2000, 10_000).check();
        let sentence = "count times frames must be at most 4000000: 20000000";
        assert_eq!(crowd, Err(sentence.into()));
        let mut params = Params::default();
        params.rules.picture_separation_bl = -1.0;
        assert!(params.check().is_err(), "a negative radius");
        let mut params = Params::default();
        params.matching.wx = f64::NAN;
        let sentence = params.check().expect_err("NaN lies in no range");
        assert!(sentence.starts_with("matching.wx"), "{sentence}");
    }
}
