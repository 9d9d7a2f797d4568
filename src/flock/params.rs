//! What a person may set about a flock. Defaults are those of ALGORITHMS.md 6 and 8, and of
//! `boids/params.rs`;
//! `papers` is O's plain objective.

use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

pub use super::boids::params::{Goal, Obstacle, Predator, Rules, Zones};
use super::composite::params::Render;

/// Parameters of a flock; all have defaults.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
#[schema(as = FlockParams)]
#[serde(default, deny_unknown_fields)]
pub struct Params {
    /// Individuals, 1..=10000; null = as many as there is room for, 2 to 20.
    pub count: Option<u32>,
    /// Frames of the film, 1..=1000000, or 1..=10000 unless `position` is `film`; times the individuals at most 4,000,000.
    pub frames: u32,
    /// Everything random follows from it.
    pub seed: u64,
    /// How the boids steer.
    pub rules: Rules,
    /// Wanted mean distance to the nearest other in the picture, body lengths, 0.2..=10, as far as there is room: the radii of
    /// separation are scaled until the animals keep it. null = as the rules say.
    pub spacing_bl: Option<f64>,
    /// The last frame plays into the first, so that the film repeats without a seam. Frames 30..=5000 then, and
    /// no `position: papers`.
    #[serde(rename = "loop")]
    pub is_loop: bool,
    /// How real frames are matched with boids.
    pub matching: Matching,
    /// Least frames between two jumps, 1..=120; null = the clips' length, 1 = no least.
    pub dwell_frames: Option<u32>,
    /// Frames of the cross-fade at a jump, 0..=16, even; 0 = a hard cut.
    pub fade_frames: u32,
    /// Whether an individual may be shown left-right mirrored.
    pub mirror: bool,
    /// Natural spread of body size: each individual is drawn at 1 - variation to 1 + variation times the size of the filmed
    /// animal, 0..=0.3, and its steps are scaled alike. 0 = all have one size. Loops have none.
    pub variation: f64,
    /// What rule A is: repulsion, or O's wording.
    pub separation: Separation,
    /// How an individual follows its boid.
    pub position: Position,
    /// Whether boids at the rim may lead for a while (Hartman & Benes 2006).
    pub leaders: bool,
    /// Where the flock may go.
    pub tank: TankExtent,
    /// Where it is drawn to, at most 64.
    pub goals: Vec<Goal>,
    /// What it swims round, at most 64.
    pub obstacles: Vec<Obstacle>,
    /// What it flees from.
    pub predator: Option<Predator>,
    /// Depth of the tank in side view, body lengths, 0..=100; null = as deep as the animal was seen to be, 1 to 6.
    /// Top view has none.
    pub depth_bl: Option<f64>,
    /// The film.
    pub render: Render,
}

/// How real frames are matched with boids (ALGORITHMS.md 6). Weights 0..=4.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(default, deny_unknown_fields)]
pub struct Matching {
    /// What is matched.
    pub by: MatchBy,
    /// Cost of a radian of heading (in top view: of a quarter second's turn) that stays wrong.
    pub w_h: f64,
    /// Share of a difference along the line of sight that counts when directions are matched, 0..=1: 1 = the whole
    /// angle in space. A wrong heading is seen at once, a wrong foreshortening hardly.
    pub w_d: f64,
    /// Cost of a radian that rotating the sprite must make up for.
    pub w_r: f64,
    /// How far a sprite may be rotated in side view, degrees, 0..=45.
    pub rho_deg: f64,
    /// Cost of a unit of log speed.
    pub w_v: f64,
    /// Cost of a jump at D = epsilon, radians.
    pub wx: f64,
    /// Cost of looking like a neighbor, radians for each at no distance.
    pub w_c: f64,
    /// Cost of each frame that a jump goes back, radians, where it goes back by less than 1.3 s: it shows again what was just
    /// seen.
    pub w_p: f64,
    /// Frames of a segment, 2..=2000; null = three seconds. With `position: film` a flock is simulated, planned and placed one
    /// segment at a time, and boids begin each segment at the positions of their animals.
    pub segment_frames: Option<u32>,
}

/// What real frames and boids are matched by.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum MatchBy {
    /// O: where the animal points in the picture, and how fast it is. A wrong heading is seen at once.
    Heading,
    /// The same, but where it points in space, at the expense of headings in the picture. Without depth headings are
    /// matched. What stays wrong is the chord between two unit vectors; without a camera, away
    /// from the viewer and toward are one.
    Direction,
    /// Colqui et al. 2008: how the animal moved in the picture against how the boid moves, frame by
    /// frame. `w_h` is then the cost of a body length a second each way; `w_r`, `rho_deg` and `w_v` play
    /// no part in the plan.
    Position,
}

/// What rule A is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum Separation {
    /// Push apart.
    Repulsion,
    /// O 4, rule A: slow down when ahead, speed up when behind, align.
    Papers,
}

/// How an individual follows its boid.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum Position {
    /// By the steps that the animal took in the frames shown, each corrected toward the boid by a fifth of its length at
    /// most. Boids take their speeds from the film. A loop is placed as with `leash`.
    Film,
    /// Along its own heading at the boid's speed, drawn gently to the boid.
    Leash,
    /// Where the boid is.
    Boid,
    /// O 5.2: the boid's speed along the shown heading, summed.
    Papers,
}

/// Where the flock may go.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum TankExtent {
    /// Where the animal was seen. Farther out if there is no room for the flock: from above as far as what looks like
    /// the floor there, from the side up to seven tenths of the picture.
    Seen,
    /// The whole picture.
    Picture,
}

/// The most that individuals times frames may be: where everyone is in every frame is held in memory, and told in
/// `flock.json`, with some hundreds of bytes each.
const MOST_SHOWN: u64 = 4_000_000;
/// Individuals where nothing is asked, if there is room for them.
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
    /// The names that `preset` knows.
    pub const PRESETS: [&'static str; 6] =
        ["school", "swarm", "mill", "scatter", "zonal", "papers"];

    /// The parameters of a named preset; `None` for an unknown name. `school` is the default.
    pub fn preset(name: &str) -> Option<Params> {
        let with_rules = |rules| Params {
            rules,
            ..Params::default()
        };
        match name {
            "school" => Some(Params::default()),
            "swarm" => Some(with_rules(Rules {
                alignment: 0.0,
                // Who seeks the others more swims to and fro with them in a narrow tank.
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

    /// O's plain objective: headings only, no mirror, no rotation, hard cuts, its wording of rule A
    /// and its sum of speeds as position, in the plane of the picture.
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

    /// The number of individuals, or without one the greatest default.
    pub fn most_individuals(&self) -> u32 {
        self.count.unwrap_or(MOST_BY_DEFAULT)
    }

    /// Checks every range; the sentence says which parameter is out of which range.
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
                    "position papers sums up speeds and never comes back: not in a loop".into(),
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
        params.matching.wx = f64::NAN;
        let sentence = params.check().expect_err("NaN lies in no range");
        assert!(sentence.starts_with("matching.wx"), "{sentence}");
    }
}
