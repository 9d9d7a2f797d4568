//! Limits of the numbers in flock.json. A plan may come from another person, and drawing relies on numbers whose products
//! stay finite. The limits are free choices, far beyond what planning gives.

use std::ops::RangeInclusive;

use crate::flock::{Fade, Flock, Individual, Space};

/// Frame rate, frames per second.
const FPS: RangeInclusive<f64> = 1e-4..=1e4;
/// Width or height of the picture, pixels.
const SIDE_PX: RangeInclusive<u32> = 1..=16384;
/// Body length, pixels.
const LENGTH_PX: RangeInclusive<f64> = 1e-3..=1e6;
/// Coordinate in the picture or the tank, pixels, body lengths or metres.
const PLACE: RangeInclusive<f64> = -1e9..=1e9;
/// Angle, radians: many turns.
const ANGLE_RAD: RangeInclusive<f64> = -1e3..=1e3;
/// Component of a unit vector, with room for rounding.
const COMPONENT: RangeInclusive<f64> = -1.01..=1.01;
/// Size relative to the footage.
const SCALE: RangeInclusive<f64> = 1e-3..=1e3;
/// Speed, body lengths per second.
const SPEED_BL_PER_S: RangeInclusive<f64> = 0.0..=1e6;
/// Cost of a plan, radians.
const COST_RAD: RangeInclusive<f64> = 0.0..=1e9;
/// Distance or index of the camera that must not be 0.
const POSITIVE: RangeInclusive<f64> = 1e-9..=1e9;

/// Fails with the name of the first value that is out of range.
pub(super) fn check(flock: &Flock) -> Result<(), String> {
    let out_of_range = |name: &str| format!("{name} is out of range");
    let require = |holds: bool, name| holds.then_some(()).ok_or_else(|| out_of_range(name));
    let sides_px = flock.image_size_px;
    require(FPS.contains(&flock.fps), "fps")?;
    require(
        sides_px.iter().all(|side| SIDE_PX.contains(side)),
        "image_size_px",
    )?;
    require(LENGTH_PX.contains(&flock.length_px), "length_px")?;
    require(is_space(&flock.space), "space")?;
    let predator = flock.predator_px.iter().flatten();
    require(lie(predator, &PLACE), "predator")?;
    require(flock.individuals.iter().all(is_individual), "individuals")
}

/// Returns whether all values lie in a range. NaN lies in none.
fn lie<'a>(values: impl IntoIterator<Item = &'a f64>, range: &RangeInclusive<f64>) -> bool {
    values.into_iter().all(|value| range.contains(value))
}

fn is_space(space: &Space) -> bool {
    let is_camera = space.lens.camera().is_none_or(|camera| {
        lie(&[camera.focal_px, camera.medium_index], &POSITIVE)
            && lie(&camera.center_px, &PLACE)
            && lie(&[camera.pane_bl], &PLACE)
            && lie(&camera.metres, &POSITIVE)
    });
    is_camera
        && PLACE.contains(&space.front_bl)
        && lie(&space.up, &COMPONENT)
        && (space.walls.iter())
            .all(|wall| lie(&wall.outward, &COMPONENT) && PLACE.contains(&wall.offset_bl))
}

fn is_individual(one: &Individual) -> bool {
    let (boid, cost) = (&one.boid, &one.cost);
    let costs = [
        cost.total,
        cost.heading,
        cost.speed,
        cost.transition,
        cost.crowd,
        cost.repetition,
        cost.lower_bound,
    ];
    let forward = [&one.forward, &boid.forward].into_iter().flatten();
    lie(&one.rotation_rad, &ANGLE_RAD)
        && lie(one.heading_rad.iter().chain(&boid.heading_rad), &ANGLE_RAD)
        && lie(one.centroid_px.iter().flatten(), &PLACE)
        && lie(boid.position_px.iter().flatten(), &PLACE)
        && lie(forward.flatten().flatten(), &COMPONENT)
        && lie(one.scale.iter().chain([&one.size]), &SCALE)
        && lie(one.depth_m.iter().flatten(), &PLACE)
        && lie(&boid.speed_bl_per_s, &SPEED_BL_PER_S)
        && lie(&costs, &COST_RAD)
        && one.fades.iter().all(is_fade)
}

fn is_fade(fade: &Fade) -> bool {
    lie(&fade.rotation_rad, &ANGLE_RAD)
        && lie(&fade.scale, &SCALE)
        && lie(&fade.weight, &(0.0..=1.0))
}
