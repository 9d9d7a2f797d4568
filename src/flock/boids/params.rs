//! What a person may set about boids: how they steer, and what else is in the tank. Defaults are those of
//! ALGORITHMS.md 7, but for a stronger alignment, without which a school forms slowly, and a
//! weaker wander.

use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use crate::flock::params::within;

/// How the boids steer (ALGORITHMS.md 7). Weights 0..=20, radii in body lengths 0.1..=50.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(default, deny_unknown_fields)]
pub struct Rules {
    /// Weight of separation.
    pub separation: f64,
    /// Weight of alignment.
    pub alignment: f64,
    /// Weight of cohesion.
    pub cohesion: f64,
    /// Weight of the walls (ALGORITHMS.md 7 has 4: with it slow ones jam at walls that turn nobody at once).
    pub walls: f64,
    /// Weight of the wander: 1 = turn rates as varied as the animal's own.
    pub wander: f64,
    /// Weight of circling about the middle of the tank.
    pub circling: f64,
    /// Neighbors nearer than this push apart.
    pub separation_bl: f64,
    /// Neighbors nearer than this in the picture push apart in the picture, however far one is behind the other; 0 = none.
    pub picture_separation_bl: f64,
    /// Neighbors nearer than this are aligned with.
    pub alignment_bl: f64,
    /// Neighbors nearer than this attract.
    pub cohesion_bl: f64,
    /// Field of view, degrees, 1..=360.
    pub view_deg: f64,
    /// At most this many nearest neighbors count, 1..=2000.
    pub neighbors: u32,
    /// Couzin et al. 2002 in place of separation, alignment, cohesion and wander.
    pub zones: Option<Zones>,
}

/// Three zones around every boid (Couzin et al. 2002). Whoever is nearer than the first is turned away from, and
/// then nothing else counts; otherwise the course is that of those in the second and toward those in the third.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(default, deny_unknown_fields)]
pub struct Zones {
    /// Radius of the zone of repulsion, body lengths, 0.1..=50.
    pub repulsion_bl: f64,
    /// Width of the zone of orientation around it, body lengths, 0..=50.
    pub orientation_bl: f64,
    /// Width of the zone of attraction around that, body lengths, 0..=50.
    pub attraction_bl: f64,
    /// Spread of the error of every course, radians, 0..=1.
    pub noise_rad: f64,
}

/// A place that the flock is drawn to for a while; several in a row are waypoints.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct Goal {
    /// Where, in the footage's picture, pixels.
    pub at_px: [f64; 2],
    /// How far behind the front of the tank, body lengths; null = half way.
    #[serde(default)]
    pub depth_bl: Option<f64>,
    /// From when, seconds of the film.
    #[serde(default)]
    pub from_s: f64,
    /// Until when; null = to the end.
    #[serde(default)]
    pub until_s: Option<f64>,
    /// How strongly, 0..=20.
    #[serde(default = "usual_weight")]
    pub weight: f64,
}

/// What nobody swims through: it is as deep as the tank.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum Obstacle {
    /// A disk in the footage's picture.
    Circle {
        /// Its middle, pixels.
        center_px: [f64; 2],
        /// Its radius, pixels, above 0.
        radius_px: f64,
    },
    /// A box in the footage's picture: x, y, width and height, pixels.
    Box {
        /// Its corner, width and height, above 0.
        box_px: [f64; 4],
    },
}

/// What the flock flees from. It is not drawn; flock.json tells where it is.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(default, deny_unknown_fields)]
pub struct Predator {
    /// Where it is when, in order of time; straight between. Without it, it hunts: always for the nearest.
    pub path: Vec<Waypoint>,
    /// Nearer than this it is fled from, body lengths, 0.1..=50.
    pub flee_bl: Option<f64>,
}

/// A place at a time.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct Waypoint {
    /// Seconds of the film.
    pub time_s: f64,
    /// Where, in the footage's picture, pixels.
    pub at_px: [f64; 2],
    /// How far behind the front of the tank, body lengths; null = half way.
    #[serde(default)]
    pub depth_bl: Option<f64>,
}

fn usual_weight() -> f64 {
    1.0
}

impl Default for Rules {
    fn default() -> Rules {
        Rules {
            separation: 1.5,
            alignment: 2.0,
            cohesion: 0.8,
            walls: 6.0,
            wander: 0.25,
            circling: 0.0,
            separation_bl: 1.0,
            picture_separation_bl: 0.0,
            alignment_bl: 3.0,
            cohesion_bl: 6.0,
            view_deg: 300.0,
            neighbors: 16,
            zones: None,
        }
    }
}

impl Default for Zones {
    fn default() -> Zones {
        Zones {
            repulsion_bl: 1.0,
            orientation_bl: 2.0,
            attraction_bl: 8.0,
            noise_rad: 0.05,
        }
    }
}

impl Rules {
    /// How far the farthest rule looks.
    pub fn reach_bl(&self) -> f64 {
        match &self.zones {
            Some(zones) => zones.radii_bl()[2],
            None => (self.separation_bl)
                .max(self.picture_separation_bl)
                .max(self.alignment_bl)
                .max(self.cohesion_bl),
        }
    }

    /// The same rules at another distance of all from all.
    pub fn closer(&self, share: f64) -> Rules {
        let mut rules = self.clone();
        let zones = rules.zones.iter_mut();
        let of_zones = zones.flat_map(|z| {
            [
                &mut z.repulsion_bl,
                &mut z.orientation_bl,
                &mut z.attraction_bl,
            ]
        });
        let own = [
            &mut rules.separation_bl,
            &mut rules.picture_separation_bl,
            &mut rules.alignment_bl,
            &mut rules.cohesion_bl,
        ];
        for radius_bl in own.into_iter().chain(of_zones) {
            *radius_bl *= share;
        }
        rules
    }

    pub(in crate::flock) fn check(&self) -> Result<(), String> {
        let weights = [
            ("rules.separation", self.separation),
            ("rules.alignment", self.alignment),
            ("rules.cohesion", self.cohesion),
            ("rules.walls", self.walls),
            ("rules.wander", self.wander),
            ("rules.circling", self.circling),
        ];
        let radii = [
            ("rules.separation_bl", self.separation_bl),
            ("rules.alignment_bl", self.alignment_bl),
            ("rules.cohesion_bl", self.cohesion_bl),
        ];
        for (name, value) in weights {
            within(name, value, 0.0, 20.0)?;
        }
        for (name, value) in radii {
            within(name, value, 0.1, 50.0)?;
        }
        within("rules.view_deg", self.view_deg, 1.0, 360.0)?;
        within("rules.neighbors", f64::from(self.neighbors), 1.0, 2000.0)?;
        self.zones.iter().try_for_each(Zones::check)
    }
}

impl Zones {
    /// The outer radii of the three zones.
    pub fn radii_bl(&self) -> [f64; 3] {
        let orientation = self.repulsion_bl + self.orientation_bl;
        [
            self.repulsion_bl,
            orientation,
            orientation + self.attraction_bl,
        ]
    }

    fn check(&self) -> Result<(), String> {
        within("rules.zones.repulsion_bl", self.repulsion_bl, 0.1, 50.0)?;
        within("rules.zones.orientation_bl", self.orientation_bl, 0.0, 50.0)?;
        within("rules.zones.attraction_bl", self.attraction_bl, 0.0, 50.0)?;
        within("rules.zones.noise_rad", self.noise_rad, 0.0, 1.0)
    }
}

impl Goal {
    pub(in crate::flock) fn check(&self) -> Result<(), String> {
        place("goals", self.at_px, self.depth_bl)?;
        within("goals.from_s", self.from_s, 0.0, MOST_S)?;
        within(
            "goals.until_s",
            self.until_s.unwrap_or(MOST_S),
            self.from_s,
            MOST_S,
        )?;
        within("goals.weight", self.weight, 0.0, 20.0)
    }
}

impl Obstacle {
    pub(in crate::flock) fn check(&self) -> Result<(), String> {
        match *self {
            Obstacle::Circle {
                center_px,
                radius_px,
            } => {
                place("obstacles.circle", center_px, None)?;
                within("obstacles.circle.radius_px", radius_px, 0.5, MOST_PX)
            }
            Obstacle::Box {
                box_px: [x, y, w, h],
            } => {
                place("obstacles.box", [x, y], None)?;
                within("obstacles.box width", w, 0.5, MOST_PX)?;
                within("obstacles.box height", h, 0.5, MOST_PX)
            }
        }
    }
}

impl Predator {
    /// Nearer than this it is fled from (ALGORITHMS.md 7: 5 BL).
    pub fn flee_bl(&self) -> f64 {
        self.flee_bl.unwrap_or(5.0)
    }

    pub(in crate::flock) fn check(&self) -> Result<(), String> {
        within("predator.flee_bl", self.flee_bl(), 0.1, 50.0)?;
        within("predator.path", self.path.len() as f64, 0.0, 1000.0)?;
        for waypoint in &self.path {
            place("predator.path", waypoint.at_px, waypoint.depth_bl)?;
            within("predator.path.time_s", waypoint.time_s, 0.0, MOST_S)?;
        }
        let in_order = self
            .path
            .windows(2)
            .all(|pair| pair[0].time_s < pair[1].time_s);
        in_order
            .then_some(())
            .ok_or("predator.path must be in order of time".into())
    }
}

/// Farther off the picture, and later, nothing is.
const MOST_PX: f64 = 100_000.0;
const MOST_S: f64 = 1e6;

fn place(name: &str, at_px: [f64; 2], depth_bl: Option<f64>) -> Result<(), String> {
    for px in at_px {
        within(name, px, -MOST_PX, MOST_PX)?;
    }
    within(name, depth_bl.unwrap_or(0.0), 0.0, 100.0)
}
