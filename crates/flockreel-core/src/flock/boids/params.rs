//! Steering parameters of boids with defaults and limits, and the goals, obstacles and predator in the tank
//! (docs/explanation/algorithms.md, "Boids").
//!
//! The default weight of alignment is high because a school otherwise forms slowly.

use serde::{Deserialize, Serialize};
use smart_default::SmartDefault;
use utoipa::ToSchema;

use crate::parameters::CoordinatePx;

/// Steering of the boids (docs/explanation/algorithms.md, "Boids").
#[derive(Clone, Debug, PartialEq, SmartDefault, Serialize, Deserialize, ToSchema)]
#[serde(default, deny_unknown_fields)]
pub struct Rules {
    /// Weight of separation: boids move away from near neighbors.
    #[default = 1.5]
    #[schema(minimum = 0, maximum = 20)]
    pub separation: f64,
    /// Share of `alignment` and `cohesion` that applies. null = with `position: film` 0 for an animal that is
    /// carried by a perch or a floor, as all are from above, and 1 for one that swims or flies.
    #[schema(minimum = 0, maximum = 1)]
    pub sociality: Option<f64>,
    /// Weight of alignment: boids match the velocity of their neighbors.
    #[default = 2.0]
    #[schema(minimum = 0, maximum = 20)]
    pub alignment: f64,
    /// Weight of cohesion: boids move toward their neighbors.
    #[default = 0.8]
    #[schema(minimum = 0, maximum = 20)]
    pub cohesion: f64,
    /// Weight of avoiding walls and obstacles. At 4, slow boids jam at walls, because a wall turns them only
    /// gradually.
    #[default = 6.0]
    #[schema(minimum = 0, maximum = 20)]
    pub walls: f64,
    /// Weight of random turns. 1 = turn rates vary as much as those of the animal.
    #[default = 0.25]
    #[schema(minimum = 0, maximum = 20)]
    pub wander: f64,
    /// Weight of circling around the middle of the tank.
    #[default = 0.0]
    #[schema(minimum = 0, maximum = 20)]
    pub circling: f64,
    /// Radius of separation, body lengths.
    #[default = 1.0]
    #[schema(minimum = 0.1, maximum = 50)]
    pub separation_bl: f64,
    /// Radius of separation in the image, body lengths. Neighbors nearer than this in the image push each
    /// other apart there, whatever their difference in depth. 0 = off.
    #[default = 0.0]
    #[schema(minimum = 0, maximum = 50)]
    pub picture_separation_bl: f64,
    /// Radius of alignment, body lengths.
    #[default = 3.0]
    #[schema(minimum = 0.1, maximum = 50)]
    pub alignment_bl: f64,
    /// Radius of cohesion, body lengths.
    #[default = 6.0]
    #[schema(minimum = 0.1, maximum = 50)]
    pub cohesion_bl: f64,
    /// Field of view of a boid, degrees.
    #[default = 300.0]
    #[schema(minimum = 1, maximum = 360)]
    pub view_deg: f64,
    /// Largest number of neighbors to which a boid responds, the nearest first.
    #[default = 16]
    #[schema(minimum = 1, maximum = 2000)]
    pub neighbors: u32,
    /// Zonal model of Couzin et al. 2002, which replaces separation, alignment, cohesion, circling and
    /// wander. null = off.
    pub zones: Option<Zones>,
}

/// Three zones around each boid (Couzin et al. 2002). A boid turns away from neighbors in the zone of
/// repulsion and then ignores all others. Otherwise it takes the direction of neighbors in the zone of
/// orientation and heads toward those in the zone of attraction.
#[derive(Clone, Debug, PartialEq, SmartDefault, Serialize, Deserialize, ToSchema)]
#[serde(default, deny_unknown_fields)]
pub struct Zones {
    /// Radius of the zone of repulsion, body lengths.
    #[default = 1.0]
    #[schema(minimum = 0.1, maximum = 50)]
    pub repulsion_bl: f64,
    /// Width of the zone of orientation outside the zone of repulsion, body lengths.
    #[default = 2.0]
    #[schema(minimum = 0, maximum = 50)]
    pub orientation_bl: f64,
    /// Width of the zone of attraction outside the zone of orientation, body lengths.
    #[default = 8.0]
    #[schema(minimum = 0, maximum = 50)]
    pub attraction_bl: f64,
    /// Standard deviation of the random error of each course, radians.
    #[default = 0.05]
    #[schema(minimum = 0, maximum = 1)]
    pub noise_rad: f64,
}

/// Place that attracts the flock for some time. Several goals one after another act as waypoints.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct Goal {
    /// Position in the image of the footage, x and y, pixels.
    #[schema(value_type = [CoordinatePx; 2], inline, min_items = 2, max_items = 2)]
    pub at_px: [f64; 2],
    /// Distance behind the front of the tank, body lengths. null = the middle of its depth.
    #[serde(default)]
    #[schema(default = json!(null), minimum = 0, maximum = 100)]
    pub depth_bl: Option<f64>,
    /// Start time, seconds of the video.
    #[serde(default)]
    #[schema(default = 0.0, minimum = 0, maximum = 1000000)]
    pub from_s: f64,
    /// End time, seconds of the video. null = the end of the video.
    #[serde(default)]
    #[schema(default = json!(null), minimum = 0, maximum = 1000000)]
    pub until_s: Option<f64>,
    /// Strength of the attraction, a weight like those of `rules`.
    #[serde(default = "usual_weight")]
    #[schema(default = usual_weight, minimum = 0, maximum = 20)]
    pub weight: f64,
}

/// Obstacle that boids avoid. It extends over the whole depth of the tank.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum Obstacle {
    /// Disk in the image of the footage.
    Circle {
        /// Center, x and y, pixels.
        #[schema(value_type = [CoordinatePx; 2], inline, min_items = 2, max_items = 2)]
        center_px: [f64; 2],
        /// Radius, pixels.
        #[schema(minimum = 0.5, maximum = 100000)]
        radius_px: f64,
    },
    /// Rectangle in the image of the footage.
    Box {
        /// Left edge, top edge, width and height, pixels. Width and height are at least 0.5.
        #[schema(value_type = [CoordinatePx; 4], inline, min_items = 4, max_items = 4)]
        box_px: [f64; 4],
    },
}

/// Predator that the flock flees from. It is not drawn. flock.json holds its track.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(default, deny_unknown_fields)]
pub struct Predator {
    /// Positions of the predator in order of time. It moves in straight lines between them. If
    /// empty, it hunts the nearest boid.
    #[schema(max_items = 1000)]
    pub path: Vec<Waypoint>,
    /// Distance within which boids flee, body lengths. null = 5.
    #[schema(minimum = 0.1, maximum = 50)]
    pub flee_bl: Option<f64>,
}

/// Position of the predator at a time.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct Waypoint {
    /// Time, seconds of the video.
    #[schema(minimum = 0, maximum = 1000000)]
    pub time_s: f64,
    /// Position in the image of the footage, x and y, pixels.
    #[schema(value_type = [CoordinatePx; 2], inline, min_items = 2, max_items = 2)]
    pub at_px: [f64; 2],
    /// Distance behind the front of the tank, body lengths. null = the middle of its depth.
    #[serde(default)]
    #[schema(default = json!(null), minimum = 0, maximum = 100)]
    pub depth_bl: Option<f64>,
}

fn usual_weight() -> f64 {
    1.0
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

    /// Returns the rules with the weights that `sociality` leaves.
    pub fn social(self) -> Rules {
        let share = self.sociality.unwrap_or(1.0);
        Rules {
            alignment: share * self.alignment,
            cohesion: share * self.cohesion,
            ..self
        }
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
}

impl Goal {
    pub(in crate::flock) fn check(&self) -> Result<(), String> {
        match self.until_s {
            Some(until_s) if until_s < self.from_s => Err(format!(
                "goals.until_s must be at least goals.from_s: {until_s}"
            )),
            _ => Ok(()),
        }
    }
}

impl Obstacle {
    pub(in crate::flock) fn check(&self) -> Result<(), String> {
        match *self {
            Obstacle::Box {
                box_px: [_, _, w, h],
            } if w.min(h) < 0.5 => Err(format!(
                "width and height of obstacles.box must be at least 0.5: {w}, {h}"
            )),
            _ => Ok(()),
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
        let in_order = self
            .path
            .windows(2)
            .all(|pair| pair[0].time_s < pair[1].time_s);
        in_order
            .then_some(())
            .ok_or("the times of predator.path must increase".into())
    }
}
