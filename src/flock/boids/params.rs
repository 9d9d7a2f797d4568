//! Steering parameters of boids, and the goals, obstacles and predator in the tank
//! (docs/explanation/algorithms.md, "Boids").
//!
//! The default weight of alignment is high because a school otherwise forms slowly.

use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use crate::flock::params::within;

/// Steering of the boids (docs/explanation/algorithms.md, "Boids"). Weights are 0..=20, radii 0.1..=50 body
/// lengths.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(default, deny_unknown_fields)]
pub struct Rules {
    /// Weight of separation: boids move away from near neighbors.
    pub separation: f64,
    /// Weight of alignment: boids match the velocity of their neighbors.
    pub alignment: f64,
    /// Weight of cohesion: boids move toward their neighbors.
    pub cohesion: f64,
    /// Weight of avoiding walls and obstacles. At 4, slow boids jam at walls, because a wall turns them only
    /// gradually.
    pub walls: f64,
    /// Weight of random turns. 1 = turn rates vary as much as those of the animal.
    pub wander: f64,
    /// Weight of circling around the middle of the tank.
    pub circling: f64,
    /// Radius of separation, body lengths.
    pub separation_bl: f64,
    /// Radius of separation in the image, body lengths. Neighbors nearer than this in the image push each
    /// other apart there, whatever their difference in depth. 0 = off.
    pub picture_separation_bl: f64,
    /// Radius of alignment, body lengths.
    pub alignment_bl: f64,
    /// Radius of cohesion, body lengths.
    pub cohesion_bl: f64,
    /// Field of view, degrees, 1..=360.
    pub view_deg: f64,
    /// Largest number of neighbors that count, the nearest first, 1..=2000.
    pub neighbors: u32,
    /// Zonal model of Couzin et al. 2002, which replaces separation, alignment, cohesion, circling and
    /// wander. null = off.
    pub zones: Option<Zones>,
}

/// Three zones around each boid (Couzin et al. 2002). A boid turns away from neighbors in the zone of
/// repulsion and then ignores all others. Otherwise it takes the direction of neighbors in the zone of
/// orientation and heads toward those in the zone of attraction.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(default, deny_unknown_fields)]
pub struct Zones {
    /// Radius of the zone of repulsion, body lengths, 0.1..=50.
    pub repulsion_bl: f64,
    /// Width of the zone of orientation outside the zone of repulsion, body lengths, 0..=50.
    pub orientation_bl: f64,
    /// Width of the zone of attraction outside the zone of orientation, body lengths, 0..=50.
    pub attraction_bl: f64,
    /// Standard deviation of the random error of each course, radians, 0..=1.
    pub noise_rad: f64,
}

/// Place that attracts the flock for some time. Several goals one after another act as waypoints.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct Goal {
    /// Position in the image of the footage, x and y, pixels.
    pub at_px: [f64; 2],
    /// Distance behind the front of the tank, body lengths, 0..=100. null = the middle of its depth.
    #[serde(default)]
    pub depth_bl: Option<f64>,
    /// Start time, seconds of the video.
    #[serde(default)]
    pub from_s: f64,
    /// End time, seconds of the video. null = the end of the video.
    #[serde(default)]
    pub until_s: Option<f64>,
    /// Weight, 0..=20.
    #[serde(default = "usual_weight")]
    pub weight: f64,
}

/// Obstacle that boids avoid. It extends over the whole depth of the tank.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum Obstacle {
    /// Disk in the image of the footage.
    Circle {
        /// Center, x and y, pixels.
        center_px: [f64; 2],
        /// Radius, pixels, at least 0.5.
        radius_px: f64,
    },
    /// Rectangle in the image of the footage.
    Box {
        /// Left edge, top edge, width and height, pixels. Width and height are at least 0.5.
        box_px: [f64; 4],
    },
}

/// Predator that the flock flees from. It is not drawn. flock.json holds its track.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(default, deny_unknown_fields)]
pub struct Predator {
    /// Positions of the predator in order of time, at most 1000. It moves in straight lines between them. If
    /// empty, it hunts the nearest boid.
    pub path: Vec<Waypoint>,
    /// Distance within which boids flee, body lengths, 0.1..=50. null = 5.
    pub flee_bl: Option<f64>,
}

/// Position of the predator at a time.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct Waypoint {
    /// Time, seconds of the video.
    pub time_s: f64,
    /// Position in the image of the footage, x and y, pixels.
    pub at_px: [f64; 2],
    /// Distance behind the front of the tank, body lengths, 0..=100. null = the middle of its depth.
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
    /// Returns the largest radius of all rules, body lengths.
    pub fn reach_bl(&self) -> f64 {
        match &self.zones {
            Some(zones) => zones.radii_bl()[2],
            None => (self.separation_bl)
                .max(self.picture_separation_bl)
                .max(self.alignment_bl)
                .max(self.cohesion_bl),
        }
    }

    /// Returns the rules with all radii multiplied by `share`.
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
        within(
            "rules.picture_separation_bl",
            self.picture_separation_bl,
            0.0,
            50.0,
        )?;
        within("rules.view_deg", self.view_deg, 1.0, 360.0)?;
        within("rules.neighbors", f64::from(self.neighbors), 1.0, 2000.0)?;
        self.zones.iter().try_for_each(Zones::check)
    }
}

impl Zones {
    /// Returns the outer radii of the three zones, body lengths.
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
    /// Returns the distance within which boids flee, body lengths. The default is 5
    /// (docs/explanation/algorithms.md, "Boids").
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
            .ok_or("the times of predator.path must increase".into())
    }
}

/// Largest coordinate, pixels. Free choice.
const MOST_PX: f64 = 100_000.0;
/// Latest time, seconds. Free choice.
const MOST_S: f64 = 1e6;

fn place(name: &str, at_px: [f64; 2], depth_bl: Option<f64>) -> Result<(), String> {
    for px in at_px {
        within(name, px, -MOST_PX, MOST_PX)?;
    }
    within(name, depth_bl.unwrap_or(0.0), 0.0, 100.0)
}
